"""Model documents, read and checked: what is wrong is named with axis, term and parameter."""

import math
from collections.abc import Iterable, Mapping
from contextlib import suppress
from typing import Any, Final

from edge_ident.errors import ModelError
from edge_ident.model.effect import Parameter
from edge_ident.model.effects import named
from edge_ident.model.model import (
    BASE,
    AxisModel,
    Model,
    SourceFile,
    Term,
    effect_names,
    inertia_unit,
)
from edge_ident.model.physical_sums import left_by_terms
from edge_ident.model.sources import axes_of
from edge_ident.model.supported_range import QUANTITIES, SupportedRange
from edge_ident.support.visible_text import brief

SCHEMA: Final = "edge-ident/model/1"
_POSITION_UNITS: Final = ("rad", "m")
_EFFORT_UNITS: Final = ("N*m", "N", "A", "V")


def unit_of(parameter: Parameter, position_unit: str, effort_unit: str) -> str:
    """A parameter's unit on an axis with these units."""
    return parameter.unit.format(
        position=position_unit,
        effort=effort_unit,
        inertia=inertia_unit(position_unit, effort_unit),
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
