"""Model files: JSON of schema edge-ident/model/1, the same for every command's --model."""

import math
import os
from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import asdict
from pathlib import Path
from typing import Any, Final, Protocol

import numpy as np

from edge_ident.errors import ModelError
from edge_ident.model.effect import Parameter
from edge_ident.model.effects import named
from edge_ident.model.inverse import left_by_terms
from edge_ident.model.model import (
    BASE,
    QUANTITIES,
    AxisModel,
    Model,
    SourceFile,
    SupportedRange,
    Term,
    axes_of,
    effect_names,
    inertia_unit,
)
from edge_ident.support.documents import file_sha256, finite, no_file, read_json, write_json
from edge_ident.support.given import path as path_of
from edge_ident.support.given import type_of
from edge_ident.support.version import VERSION
from edge_ident.support.words import brief, listed

# Model files: JSON of schema edge-ident/model/1, the same for every command's --model.

# No deviation is as small: what is left of a parameter that a bound holds.
_UNDERFLOW: Final = 1e-100
_UNSEEN: Final = 1e6  # deviation over value from which a recording says nothing about a parameter


def save_model(model: "GivenModel", path: str | Path) -> None:
    """Write a model of one drive, whole or not at all.

    Parameters
    ----------
    model : Model, or a result that has one
    path : str or Path
        The JSON file.

    Raises
    ------
    ModelError
        It is no model, or a parameter of an effect is missing or no number.
    OSError
        The file cannot be written.

    Examples
    --------
    >>> import edge_ident
    >>> found = edge_ident.identify(edge_ident.simulate())
    >>> edge_ident.save_model(found.model, "model.json")
    """

    write_json(model_document(given_model(model)), path_of(path, "the file to write (.json)"))


def model_document(model: Model) -> dict[str, Any]:
    """The model as schema edge-ident/model/1."""
    return {
        "schema": SCHEMA,
        "axes": {name: _axis_document(axis) for name, axis in model.axes.items()},
        **({"passive": model.passive} if model.passive else {}),
        "provenance": {
            "recordings": [asdict(recording) for recording in model.recordings],
            "versions": dict(model.versions),
        },
    }


def _axis_document(axis: AxisModel) -> dict[str, Any]:
    return {
        "position_unit": axis.position_unit,
        "effort_unit": axis.effort_unit,
        "terms": [_term_document(term, axis) for term in axis.terms],
    }


def _term_document(term: Term, axis: AxisModel) -> dict[str, Any]:
    source = {} if term.source_axis is None else {"source_axis": term.source_axis}
    return {
        "effect": term.effect,
        **source,
        "parameters": values_document(term, axis),
        **_range_document(term),
    }


def _range_document(term: Term) -> dict[str, Any]:
    """Lowest and highest value of each quantity, in the units of the axis; empty where unknown."""
    if term.supported is None:
        return {}
    return {"supported": {name: list(getattr(term.supported, name)) for name in QUANTITIES}}


def values_document(term: Term, axis: AxisModel) -> dict[str, Any]:
    """Value, standard deviation (null where unknown) and unit of each of a term's parameters."""
    return {
        parameter.name: {
            "value": float(term.values[parameter.name]),
            "std": _meaningful(term, parameter.name),
            "unit": unit_of(parameter, *axis.units),
        }
        for parameter in named(term.effect).parameters
        if parameter.name in term.values
    }


def _meaningful(term: Term, name: str) -> float | None:
    """Standard deviation of a parameter, None where there is none or where it is rounding alone: of
    a parameter at its bound, or of one that the recording does not show."""
    std, value = float(term.std.get(name, math.inf)), float(term.values[name])
    underflown = 0.0 < std < _UNDERFLOW
    unseen = std > _UNSEEN * (abs(value) or 1.0)
    return None if underflown or unseen else finite(std)


def sourced_model(model: Model, files: Sequence[str | Path], known: Model | None = None) -> Model:
    """Note in a model the recordings that it was made from, and this version.

    Parameters
    ----------
    model : Model
    files : sequence of str or Path
        The recordings.
    known : Model, optional
        The model from which effects were taken; its recordings are sources as well.

    Returns
    -------
    Model

    Raises
    ------
    OSError
        A recording cannot be read.

    Examples
    --------
    >>> import edge_ident
    >>> recording = edge_ident.simulate()
    >>> edge_ident.save_recording(recording, "drive.csv")
    >>> model = edge_ident.identify(recording).model
    >>> edge_ident.sourced_model(model, ["drive.csv"]).recordings[0].file
    'drive.csv'
    """
    sources = [SourceFile(file.name, file_sha256(file)) for file in map(Path, files)]
    older = [source for source in known.recordings if source not in sources] if known else []
    return Model(model.axes, (*sources, *older), {"edge-ident": VERSION})


def load_model(path: str | Path) -> Model:
    """Read and check a model file.

    Parameters
    ----------
    path : str or Path
        The JSON file.

    Returns
    -------
    Model

    Raises
    ------
    ModelError
        The file is missing or no model; an effect is unknown; a parameter is missing, no number,
        outside its physical bounds or in another unit; what the effects take from inertia or
        Coulomb friction is more than there is.

    Examples
    --------
    >>> import edge_ident
    >>> edge_ident.save_model(edge_ident.reduced_model(), "model.json")
    >>> edge_ident.load_model("model.json").axes["x"].terms[0].effect
    'rigid_body'
    """
    path = path_of(path, "a model file (.json)")
    if not path.is_file():
        raise ModelError(no_file(path), "give the path of a model file (.json)")
    try:
        document = read_json(path)
    except ValueError as error:
        raise ModelError(
            f"{path}: not a JSON file ({error})", "write it again with identify --output DIR"
        ) from error
    return model_of(document, str(path))


# Model documents, read and checked: what is wrong is named with axis, term and parameter.

SCHEMA: Final = "edge-ident/model/1"
_POSITION_UNITS: Final = ("rad", "m")
_EFFORT_UNITS: Final = ("N*m", "N", "A", "V")


def unit_of(parameter: Parameter, position_unit: str, effort_unit: str) -> str:
    """A parameter's unit on an axis with these units."""
    return parameter.unit.format(
        position=position_unit, effort=effort_unit, inertia=inertia_unit(position_unit, effort_unit)
    )


def model_of(document: Any, source: str) -> Model:
    """Check what `edge_ident.model.model_files.model_document` made.

    Parameters
    ----------
    document : Any
    source : str
        Where it comes from, for messages.

    Raises
    ------
    ModelError
        As `edge_ident.model.model_files.load_model`.
    """
    return _Reader(source).model(document)


def _text(value: Any) -> str:
    """A name or a hash.

    Raises
    ------
    TypeError
        It is none.
    """
    if not isinstance(value, str):
        raise TypeError(f"{brief(value)} is no text")
    return value


class _Reader:
    """Checks one document, and names the place of what is wrong in it."""

    def __init__(self, source: str) -> None:
        self._source = source

    def model(self, document: Any) -> Model:
        schema = document.get("schema") if isinstance(document, dict) else None
        if schema != SCHEMA:
            raise self._error(
                "", f"its schema is {brief(schema)}", f"give a file of schema {SCHEMA}"
            )
        axes = self._mapping(document, "axes", "")
        read = {name: self._axis(f"axis {name}", axes, name) for name in axes}
        passive = document.get("passive", [])
        if not (isinstance(passive, list) and all(isinstance(name, str) for name in passive)):
            raise self._error("", f"passive is {brief(passive)}", "give a list of names of axes")
        for name, axis in read.items():
            self._check_sources(name, axis, [*read, *passive])
        provenance = document.get("provenance", {})
        try:
            recordings = tuple(
                SourceFile(_text(r["file"]), _text(r["sha256"])) for r in provenance["recordings"]
            )
            versions = {str(k): str(v) for k, v in provenance["versions"].items()}
        except (KeyError, TypeError, AttributeError) as error:
            raise self._error(
                "provenance", "lacks recordings or versions",
                'write "provenance": {"recordings": [], "versions": {}}',
            ) from error  # fmt: skip
        return Model(read, recordings, versions)

    def _axis(self, place: str, axes: Mapping[str, Any], name: str) -> AxisModel:
        document = self._mapping(axes, name, place)
        units = []
        for key, known in (("position_unit", _POSITION_UNITS), ("effort_unit", _EFFORT_UNITS)):
            if document.get(key) not in known:
                raise self._error(
                    place, f"{key} is {brief(document.get(key))}", f"allowed: {', '.join(known)}"
                )
            units.append(document[key])
        given = document.get("terms")
        terms = given if isinstance(given, list) else []
        first = terms[0] if terms else None
        if not (isinstance(first, dict) and first.get("effect") == BASE):
            raise self._error(place, f"its first term is not {BASE}", f"begin terms with {BASE}")
        axis = AxisModel(tuple(self._term(place, term, units) for term in terms), *units)
        if BASE in effect_names(axis):
            raise self._error(place, f"it has {BASE} twice", "write it once, as the first term")
        self._check_sums(place, axis)
        return axis

    def _term(self, axis_place: str, document: Any, units: list[str]) -> Term:
        if not isinstance(document, dict):
            raise self._error(axis_place, "a term is not an object", 'write {"effect": …}')
        name = document.get("effect")
        if not isinstance(name, str):
            raise self._error(axis_place, f"an effect is {brief(name)}", "give its name")
        place = f"{axis_place}, term {name}"
        try:
            effect = named(name)
        except ModelError as error:
            raise self._error(axis_place, error.cause, error.next_step) from error
        given = self._mapping(document, "parameters", place)
        known = [parameter.name for parameter in effect.parameters]
        unknown = sorted(set(given) - set(known))
        if unknown:
            raise self._error(
                place, f"there is no parameter {unknown[0]}", f"known: {', '.join(known)}"
            )
        values, std = {}, {}
        for parameter in effect.parameters:
            if parameter.default is not None and parameter.name not in given:
                continue
            entry = self._mapping(given, parameter.name, f"{place}, parameter {parameter.name}")
            values[parameter.name] = self._value(place, parameter, entry, units)
            if entry.get("std") is not None:
                std[parameter.name] = self._deviation(place, parameter.name, entry["std"])
        supported = self._range(place, document)
        return Term(name, values, std, self._source_axis(place, document), supported)

    def _range(self, place: str, document: Mapping[str, Any]) -> SupportedRange | None:
        if document.get("supported") is None:
            return None
        given = self._mapping(document, "supported", place)
        intervals = []
        for name in QUANTITIES:
            ends = given.get(name)
            if not isinstance(ends, list) or len(ends) != 2:
                raise self._error(
                    f"{place}, supported", f"{name} is {brief(ends)}", "write [lowest, highest]"
                )
            low, high = (self._number(place, "supported", name, end) for end in ends)
            if low > high:
                raise self._error(
                    f"{place}, supported", f"{name} is {ends!r}", "write the lowest value first"
                )
            intervals.append((low, high))
        return SupportedRange(*intervals)

    def _value(
        self, place: str, parameter: Parameter, entry: Mapping[str, Any], units: list[str]
    ) -> float:
        value = self._number(place, parameter.name, "value", entry.get("value"))
        unit = unit_of(parameter, *units)
        if entry.get("unit", unit) != unit:
            raise self._error(
                f"{place}, parameter {parameter.name}", f"its unit is {brief(entry['unit'])}",
                f"convert it to {unit}",
            )  # fmt: skip
        if not parameter.low <= value <= parameter.high:
            raise self._error(
                f"{place}, parameter {parameter.name}", f"its value {value:g} is not physical",
                f"allowed are {parameter.low:g} to {parameter.high:g} {unit}",
            )  # fmt: skip
        return value

    def _deviation(self, place: str, parameter: str, value: Any) -> float:
        std = self._number(place, parameter, "std", value)
        if std < 0.0:
            raise self._error(
                f"{place}, parameter {parameter}", f"its std is {std:g}", "give 0 or more"
            )
        return std

    def _number(self, place: str, parameter: str, key: str, value: Any) -> float:
        number = math.nan
        if isinstance(value, int | float) and not isinstance(value, bool):
            with suppress(OverflowError):  # an integer of more than 308 digits
                number = float(value)
        if not math.isfinite(number):
            raise self._error(
                f"{place}, parameter {parameter}", f"its {key} is {brief(value)}",
                "give a finite number",
            )  # fmt: skip
        return number

    def _check_sources(self, name: str, axis: AxisModel, axes: Iterable[str]) -> None:
        others = [other for other in axes if other != name]
        for term in axis.terms:
            effect = named(term.effect)
            wanted = effect.needs_source or term.source_axis is not None
            source = str(term.source_axis)
            if wanted and not set(axes_of(source, others)) <= set(others):
                raise self._error(
                    f"axis {name}, term {term.effect}", f"source_axis is {term.source_axis!r}",
                    f"name the axis that acts on it: {', '.join(others) or 'there is no other'}",
                )  # fmt: skip

    def _check_sums(self, place: str, axis: AxisModel) -> None:
        """Effects may take no more from inertia and Coulomb friction than there is."""
        left = left_by_terms(axis)
        for what, amount, enough in (
            ("inertia", left.inertia, left.inertia > 0.0),
            ("coulomb_friction", left.coulomb_friction, left.physical),
        ):
            if not enough:
                raise self._error(
                    place, f"its terms leave {amount:.3g} of {what}",
                    f"raise {what} of {BASE}, or lower what the effects take from it",
                )  # fmt: skip

    def _source_axis(self, place: str, document: Mapping[str, Any]) -> str | None:
        source = document.get("source_axis")
        if source is not None and not isinstance(source, str):
            raise self._error(place, f"source_axis is {brief(source)}", "give the name of an axis")
        return source

    def _mapping(self, parent: Mapping[str, Any], key: str, place: str) -> dict[str, Any]:
        found = parent.get(key)
        if not isinstance(found, dict):
            raise self._error(place, f"{key} is missing or not an object", f'write "{key}": {{…}}')
        return found

    def _error(self, place: str, cause: str, next_step: str) -> ModelError:
        where = ": ".join(part for part in (self._source, place) if part)
        return ModelError(f"{where}: {cause}", next_step)


# The model that a caller gives: a model, a result that has one, or the path of a model file.


class HasModel(Protocol):
    """A result of `identify` or of `diagnose`."""

    @property
    def model(self) -> Model: ...


GivenModel = Model | HasModel | str | os.PathLike[str]


def given_model(given: GivenModel) -> Model:
    """The model that is meant, with everything in it that its effects need.

    Parameters
    ----------
    given : Model, result with a `model`, str or Path

    Raises
    ------
    ModelError
        It is none of these, the file holds no model, an effect is unknown, or a parameter is
        missing, unknown or no number.
    """
    if isinstance(given, str | os.PathLike):
        return load_model(os.fspath(given))
    model = given if isinstance(given, Model) else getattr(given, "model", None)
    if not isinstance(model, Model):
        raise ModelError(
            f"{type_of(given)} is no model",
            "give a Model, what identify or diagnose returned, or the path of a model file",
        )
    if not isinstance(model.axes, Mapping):
        raise ModelError(
            f"the model's axes are {type_of(model.axes)}",
            'give a mapping from axis name to AxisModel: Model({"x": axis})',
        )
    if not model.axes:
        raise ModelError("the model has no axis", "give an AxisModel for each axis")
    for name, axis in model.axes.items():
        _check_axis(name, axis)
    return model


def _check_axis(name: str, axis: object) -> None:
    if not isinstance(axis, AxisModel):
        raise ModelError(
            f"axis {name} of the model is {type_of(axis)}",
            "give an AxisModel: AxisModel((base_term, *effects))",
        )
    terms = axis.terms
    if not terms or not all(isinstance(term, Term) for term in terms) or terms[0].effect != BASE:
        raise ModelError(
            f"axis {name} of the model: its terms do not begin with {BASE}",
            "begin with the base term, as in reduced_model().axes['x'].terms[0]",
        )
    for term in terms:
        _check_term(f"axis {name}, term {term.effect}", term)


def _check_term(place: str, term: Term) -> None:
    """All parameters are there, and no others; all are finite numbers."""
    effect = named(term.effect)
    known = [parameter.name for parameter in effect.parameters]
    required = [parameter.name for parameter in effect.parameters if parameter.default is None]
    faults = []
    if missing := [name for name in required if name not in term.values]:
        faults.append(f"{listed(missing)} missing")
    if unknown := [name for name in term.values if name not in known]:
        faults.append(f"there is no parameter {listed(unknown)}")
    if wrong := [name for name, value in term.values.items() if not _finite(value)]:
        faults.append(f"{listed(wrong)}: not a finite number")
    if faults:
        raise ModelError(f"{place}: {'; '.join(faults)}", f"its parameters are {listed(known)}")
    if effect.needs_source and term.source_axis is None:
        raise ModelError(
            f"{place}: the axis that acts on it is missing", 'name it: Term(..., source_axis="z")'
        )


def _finite(value: object) -> bool:
    try:
        return bool(np.all(np.isfinite(np.asarray(value, dtype=np.float64))))
    except (TypeError, ValueError):
        return False
