"""Whether one of several recordings has a column in another scale.

A torque constant, a rated torque or a gain that differs makes inertia and all friction differ by
one factor; a gear ratio or a resolution of the encoder, inertia and viscous friction; a sampling
period, the inertia by its square. A payload and friction of their own for the recordings explain
that, too, and need more parameters for it.
"""

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
import scipy.optimize

from edge_ident.diagnosis.fit.bounded import solve_within
from edge_ident.diagnosis.fit.fitting import FittedModel, bounds, fit
from edge_ident.diagnosis.fit.summary import nonzero_rms
from edge_ident.diagnosis.prepare.axis_data import AxisData
from edge_ident.diagnosis.select.acceptance import about_alike
from edge_ident.diagnosis.select.selection import Selected
from edge_ident.diagnosis.select.thresholds import DECISIVE
from edge_ident.model.effects import named
from edge_ident.model.model import PARAMETERS

_CHANGED: Final[Mapping[str, tuple[str, ...]]] = {
    "effort": (),
    "position": ("inertia", "viscous_friction"),
    "time": ("inertia", "inertia", "viscous_friction"),
}
"""Base parameters that are larger by the factor of the time, or smaller by that of the position,
each time that they are named; by that of an effort, all are larger."""


@dataclass(frozen=True)
class OwnScale:
    """A column of one recording is larger than in the others.

    Attributes
    ----------
    column : {"effort", "position", "time"}
    place : int
        Of the recording.
    factor : float
    """

    column: str
    place: int
    factor: float


def scale_instead(selected: Selected, tolerance: float) -> OwnScale | None:
    """A factor of one recording that explains about as much as a changed base model.

    Parameters
    ----------
    selected : Selected
    tolerance : float
        Smallest share of the rms effort that is worth naming.

    Returns
    -------
    OwnScale or None
        None where no base parameter differs between the recordings, a factor explains decidedly
        less, or it is too near to one to be worth naming.
    """
    search, model = selected.search, selected.supported.model
    data, criterion = search.data, search.criterion
    others = tuple(t for t in model.terms if not named(t.candidate.effect).changes_base)
    loads = [t for t in model.terms if named(t.candidate.effect).changes_base]
    differ = len(data.own) - 1 + sum(len({*t.linear} - {"offset"}) for t in loads)
    if len(data.segments) == 1 or not differ:
        return None
    same = replace(data, own=("offset",), cache={})
    common = fit(same, search.template, model.base, others)
    found = {each: error for each, error in _scales(same, common, bool(loads) and differ > 1)}
    best, error = min(found.items(), key=lambda pair: pair[1])
    if abs(math.log(best.factor)) <= tolerance:
        return None
    penalties = sum(criterion.penalty(t.candidate) for t in others) + math.log(criterion.samples)
    decided = criterion.misfit(error) + penalties > criterion.value(model) + DECISIVE.value
    told = best.column == "effort" or len(data.own) > 1  # a payload has no viscous friction
    if decided and not (told and _within_formula(data, model, (common.error, error), tolerance)):
        return None
    return best


def _within_formula(
    data: AxisData, model: FittedModel, errors: tuple[float, float], tolerance: float
) -> bool:
    """Whether a model with a payload worth naming leaves less than one factor does by no more than
    is worth naming, and than a small share of what it explains: what its formula may be off.

    Parameters
    ----------
    errors : tuple of 2 floats
        Of the common base model without a factor, and with it.
    """
    places = [k for k, t in enumerate(model.terms) if named(t.candidate.effect).changes_base]
    least = tolerance * nonzero_rms(data.effort[data.valid])
    own = [
        model.jacobian[:, model.columns_of(k)] @ [*model.terms[k].linear.values()] for k in places
    ]
    if not any(nonzero_rms(each[data.valid]) > least for each in own):
        return False
    off = max(named(model.terms[k].candidate.effect).search.discrepancy for k in places)
    without, scaled = errors
    worth_naming = np.count_nonzero(data.valid) * least**2
    return about_alike(scaled - model.error, without - model.error, off, worth_naming)


def _scales(data: AxisData, model: FittedModel, every: bool) -> Iterator[tuple[OwnScale, float]]:
    """The best factor of each column and recording, and the sum of squares that it leaves.

    Parameters
    ----------
    model : FittedModel
        With one base model for all recordings.
    every : bool
        Whether a factor of the position or of the time is asked for.
    """
    jacobian, linear = model.derivatives[data.valid], model.linear_parameters
    low, high = bounds(data, model.template, model.terms)
    rest = model.predicted[data.valid] - jacobian @ linear
    effort, recording = data.effort[data.valid], data.recording[data.valid]
    own = np.zeros(len(linear), dtype=np.bool_)
    own[model.base_columns.start : model.base_columns.stop] = True
    own[: len(model.base)] = False

    def left(logarithm: float, place: int, column: str) -> float:
        here, factor = recording == place, math.exp(logarithm)
        weights = np.where(own, 1.0, factor)
        target = effort - rest * np.where(here, factor, 1.0)
        if _CHANGED[column]:
            weights, target = np.ones(len(linear)), effort - rest
        for name in _CHANGED[column]:
            weights[PARAMETERS.index(name)] *= factor if column == "time" else 1.0 / factor
        columns = jacobian * np.where(here[:, None], weights, 1.0)
        fitted = columns @ solve_within(columns, target, low, high).solution
        return float(np.sum(np.square(target - fitted)))

    # of two recordings, either one may be it
    last = len(data.segments) - 1
    for column, changed in _CHANGED.items():
        if every or not changed:
            for place in range(last + 1) if last > 1 else (last,):
                best = scipy.optimize.minimize_scalar(left, args=(place, column))
                yield OwnScale(column, place, math.exp(best.x)), float(best.fun)
