"""The model that a caller gives: a model, a result that has one, or the path of a model file."""

import os
from collections.abc import Mapping
from typing import Protocol

import numpy as np

from edge_ident.errors import ModelError
from edge_ident.model.effects import named
from edge_ident.model.model import BASE, AxisModel, Model, Term
from edge_ident.model.model_files import load_model
from edge_ident.support.given import type_of
from edge_ident.support.words import listed


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
