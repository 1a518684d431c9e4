"""A second look at the shift of an effort, where the first one was wrong.

The first look asks how the effort's slow part is shifted, since noise that the controller answers
imitates a shift of the rest. It is wrong in two ways:

- A motion of short moves has no slow part that tells. Then the shift at which the base model leaves
  least is tried, and taken where the model is adequate at it. It is tried as well where a shift of
  zero is adequate, just: the rest would go to a play or a compliance.
- No cause is known yet. A dead band, say, asks for a shift of its own, and what it lacks is then in
  the model to first order only: the rest looks like a spring with much damping. So an effort is
  moved again beside the causes that were found: first beside those that the grids alone show, as
  soon as these decide it, because what the search finds at a wrong shift is of no use.
"""

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from operator import is_

import numpy as np

from edge_ident.diagnosis.fit.fitting import FittedModel, FittedTerm, delayed, fit
from edge_ident.diagnosis.fit.noise_floor import noise_floor
from edge_ident.diagnosis.fit.summary import nonzero_rms
from edge_ident.diagnosis.prepare.axis_data import AxisData
from edge_ident.diagnosis.prepare.segment import Segment
from edge_ident.diagnosis.prepare.timing import MOST_MOVES, at_best_fit, moved_beside, untold
from edge_ident.diagnosis.select.acceptance import structure_left
from edge_ident.diagnosis.select.hidden_delay import causes_in_turn
from edge_ident.diagnosis.select.selection import Selected, fitted_base
from edge_ident.diagnosis.select.thresholds import DECISIVE
from edge_ident.model.model import AxisModel


def adequate_data(data: AxisData, known: AxisModel, tolerance: float) -> AxisData:
    """The data of an axis, at another shift where the base model is adequate at that one alone, or
    where nothing told the first.

    Parameters
    ----------
    data : AxisData
    known : AxisModel
        The axis with what it is known to have.
    tolerance : float
        Smallest share of the rms effort that is worth naming.
    """
    if data.late or delayed(known):
        return data
    if not all(map(untold, data.segments)) and _adequate(data, known, tolerance):
        return data
    moved = _moved(data, at_best_fit)
    return moved if moved is not data and _adequate(moved, known, tolerance) else data


def data_beside_causes(selected: Selected) -> AxisData | None:
    """The data of an axis with its effort in step beside its causes, or beside the first of them.

    What it is known to have comes first, with external vibrations; then a few causes: the others
    may be what the shift was taken for.

    Parameters
    ----------
    selected : Selected

    Returns
    -------
    AxisData or None
        None where no other shift explains decidedly more than the selected model.
    """
    search, start, data = selected.search, selected.start, selected.search.data
    if data.late or delayed(selected.supported.model.axis):
        return None
    best, found = search.criterion.value(selected.supported.model) - DECISIVE.value, None
    for beside in causes_in_turn(selected, none=len(start.template.terms) > 1):
        moved, model = _moved_beside(data, start, beside)
        value = replace(search.criterion, data=moved).value(model)
        if moved is not data and value < best:
            best, found = value, moved
    return found


def in_step_beside(data: AxisData, axis: AxisModel) -> AxisData:
    """The data of an axis with every effort in step beside the terms of a known model."""
    if data.late or delayed(axis):
        return data
    for _ in range(MOST_MOVES):
        moved = _moved(data, partial(moved_beside, axis=axis))
        if moved is data:
            break
        data = moved
    return data


def _adequate(data: AxisData, known: AxisModel, tolerance: float) -> bool:
    """Whether the base model leaves nothing but noise and what is not worth naming."""
    base = fitted_base(data, known)
    floor, scale = noise_floor(data, base), nonzero_rms(data.effort[data.valid])
    left = float(np.sqrt(base.error / np.count_nonzero(data.valid)))
    return not structure_left(left, floor.rms, floor.uncertainty, 0.0, tolerance * scale, scale)


def _moved(data: AxisData, move: Callable[[Segment], Segment]) -> AxisData:
    """The data with every recording moved in time; itself where none moves."""
    segments = tuple(map(move, data.segments))
    return data if all(map(is_, segments, data.segments)) else data.with_efforts_of(segments)


def _moved_beside(
    data: AxisData, start: FittedModel, beside: tuple[FittedTerm, ...]
) -> tuple[AxisData, FittedModel]:
    """The data with every effort in step beside some causes, and the model of these."""
    model = fit(data, start.template, start.base, beside)
    for _ in range(MOST_MOVES):
        moved = _moved(data, partial(moved_beside, axis=model.axis))
        if moved is data:
            break
        data, model = moved, fit(moved, start.template, model.base, beside)
    return data, model
