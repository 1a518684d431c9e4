"""What a model leaves of another recording, where what differs between days is fitted anew."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from edge_ident.diagnosis.fit.bounded import solve_within
from edge_ident.diagnosis.fit.candidates import base_regressor
from edge_ident.diagnosis.fit.fitting import FittedModel, delayed
from edge_ident.diagnosis.fit.own_columns import own_columns, own_limits
from edge_ident.diagnosis.prepare.axis_data import AxisData
from edge_ident.model.effects import named
from edge_ident.model.model import BASE, PARAMETERS, POSITIVE, AxisModel

Array = NDArray[np.float64]


def fitted_anew(model: FittedModel) -> list[int]:
    """Places of the base parameters that differ between recordings: the offset, and what terms of
    the model that are tied to time change."""
    effects = [named(t.candidate.effect) for t in model.terms]
    changed = {name for e in effects if e.tied_to_time for name in e.changes_base}
    return [k for k, name in enumerate(PARAMETERS) if name in {"offset", *changed}]


def residual_elsewhere(
    other: AxisData, model: FittedModel, anew: list[int], moved: AxisData | None = None
) -> Array:
    """What a model leaves at the valid samples of another recording, its timing fitted anew.

    Parameters
    ----------
    anew : list of int
        Places of base parameters that are fitted anew, too.
    moved : AxisData, optional
        The other recording with another motion, which the model follows then.
    """
    axis = _carried_axis(model.axis)
    residual = (other.effort - (moved or other).predicted(axis))[other.valid]
    columns = np.hstack([base_regressor(other)[:, anew], own_columns(other)])[other.valid]
    own_low, own_high = own_limits(other, shifted=not delayed(axis))
    least = [-axis.parameters[k] if POSITIVE[k] else -np.inf for k in anew]
    low, high = np.array([*least, *own_low]), np.array([*np.full(len(anew), np.inf), *own_high])
    return np.asarray(residual - columns @ solve_within(columns, residual, low, high).solution)


def _carried_axis(axis: AxisModel) -> AxisModel:
    """The physical axis, without the terms that are tied to the time of their recording."""
    base = axis.terms[0]
    values = {
        name: max(float(base.values[name]), low) for name, (low, _) in named(BASE).bounds.items()
    }
    terms = [t for t in axis.terms[1:] if not named(t.effect).tied_to_time]
    return replace(axis, terms=(replace(base, values=values), *terms))
