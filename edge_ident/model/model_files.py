"""Model files: JSON of schema edge-ident/model/1, the same for every command's --model."""

import math
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from edge_ident.errors import ModelError
from edge_ident.model.effects import named
from edge_ident.model.model import AxisModel, Model, SourceFile, Term
from edge_ident.model.model_reading import SCHEMA, model_of, unit_of
from edge_ident.model.supported_range import QUANTITIES
from edge_ident.support.atomic_files import no_file
from edge_ident.support.given import path as path_of
from edge_ident.support.hashing import file_sha256
from edge_ident.support.json_text import finite, read_json, write_json
from edge_ident.support.version import VERSION

if TYPE_CHECKING:
    from edge_ident.model.given_model import GivenModel

_UNDERFLOW: Final = 1e-100
"""No deviation is as small: what is left of a parameter that a bound holds."""
_UNSEEN: Final = 1e6
"""Deviation over value from which a recording says nothing about a parameter."""


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
    from edge_ident.model.given_model import given_model

    write_json(model_document(given_model(model)), path_of(path, "the file to write (.json)"))


def model_document(model: Model) -> dict[str, Any]:
    """The model as schema edge-ident/model/1."""
    return {
        "schema": SCHEMA,
        "axes": {name: _axis_document(axis) for name, axis in model.axes.items()},
        **({"passive": model.passive} if model.passive else {}),
        "provenance": {
            "recordings": [
                {"file": recording.file, "sha256": recording.sha256}
                for recording in model.recordings
            ],
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
