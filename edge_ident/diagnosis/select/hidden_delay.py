"""A delay that larger causes hide.

An effort is late where the delay is most of what the base model leaves (`prepare.timing`). Beside a
ripple, say, it is little of that, and only timing up to its limit is in the model. What timing
lacks then looks like a dead band or like friction that follows the load, and a delay of many
samples like a compliance. So a delay is fitted beside the causes that were found.

Along one sinusoid the base model takes a delay's phase for inertia and friction, and play has what
it leaves. So a delay is fitted there alone as well, from the shift that leaves least. Where the
encoder hides by a little when the axis turns, play fits even better: it is doubtful then.
"""

import math
from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import scipy.optimize

from edge_ident.diagnosis.fit.external_vibrations import VIBRATION
from edge_ident.diagnosis.fit.fitting import FittedModel, FittedTerm, delayed
from edge_ident.diagnosis.fit.late import delay, fit_late
from edge_ident.diagnosis.fit.own_effort import base_space, own_shares
from edge_ident.diagnosis.fit.summary import nonzero_rms
from edge_ident.diagnosis.prepare.axis_data import AxisData
from edge_ident.diagnosis.prepare.timing import (
    SHARE_OF_DELAY,
    far_shift_s,
    out_of_step,
)
from edge_ident.diagnosis.select.selection import Selected, fitted_base
from edge_ident.diagnosis.select.thresholds import DECISIVE
from edge_ident.model.motion import LARGEST_SHIFT
from edge_ident.signals.timing import STEPS_PER_PERIOD, within_limits


def delayed_data(selected: Selected) -> AxisData | None:
    """The data of an axis as it was recorded, where its causes hid that the effort is late.

    A few causes are asked first: the others may be what the delay was taken for.

    Parameters
    ----------
    selected : Selected

    Returns
    -------
    AxisData or None
        None where the effort is in time, or was late before.
    """
    search, start, data = selected.search, selected.start, selected.search.data
    if data.late or delayed(start.template):
        return None
    from_s = _along_one_sinusoid(selected)
    recorded = _out_of_step(data, 0.0)
    if from_s:
        recorded = recorded.without_ends(from_s)
    for beside in causes_in_turn(selected, none=from_s != 0.0):
        without = search.fit(start.base, beside)
        model = fit_late(recorded, start.template, without.base, without.terms, from_s)
        late_s = next(iter(model.terms[-1].linear.values()))
        beyond = all(abs(late_s) > LARGEST_SHIFT * s.raw_period_s for s in data.segments)
        if beyond and _mean(model, recorded) < (1.0 - SHARE_OF_DELAY) * _mean(without, data):
            return _out_of_step(data, late_s).without_ends(late_s)
    return None


def shift_instead(selected: Selected) -> tuple[float, float] | None:
    """A shift of the effort that explains, alone, about as much as causes along one sinusoid.

    Parameters
    ----------
    selected : Selected
        Without a delay.

    Returns
    -------
    tuple of 2 floats, or None
        By how many s the effort is late then, and what the base model leaves, rms, over the
        effort's. None where the causes explain decidedly more.
    """
    search, model, data = selected.search, selected.supported.model, selected.search.data
    from_s = 0.0 if selected.late or not model.terms else _along_one_sinusoid(selected)
    if not from_s:
        return None

    step_s = _step_s(data)
    around, inner = (from_s - step_s, from_s + step_s), data.without_ends(abs(from_s) + step_s)

    def moved(late_s: float) -> FittedModel:
        segments = tuple(s.in_step(float(late_s)) for s in inner.segments)
        return fitted_base(inner.with_efforts_of(segments), selected.start.template)

    best = scipy.optimize.minimize_scalar(lambda s: _mean(moved(s), inner), bounds=around)
    criterion, samples = search.criterion, np.count_nonzero(data.valid)
    shift = math.log(criterion.samples)
    if criterion.misfit(samples * best.fun) + shift > criterion.value(model) + DECISIVE.value:
        return None
    return float(best.x), math.sqrt(best.fun) / nonzero_rms(data.effort[data.valid])


def causes_in_turn(selected: Selected, *, none: bool = False) -> Iterator[tuple[FittedTerm, ...]]:
    """External vibrations alone; then with one cause after the other, the strongest first, last
    those that are like a delay.

    Parameters
    ----------
    selected : Selected
    none : bool
        Whether nothing comes first where there are no vibrations.
    """
    data, model = selected.search.data, selected.supported.model
    like_delays = delay().search.alternatives
    shares = own_shares(data, model, base_space(data, selected.start))
    pairs = list(zip(shares, model.terms, strict=True))
    ranked = sorted(pairs, key=lambda pair: (pair[1].candidate.effect in like_delays, -pair[0]))
    terms = [term for _, term in ranked]
    vibrations = [term for term in terms if term.candidate == VIBRATION]
    causes = [term for term in terms if term.candidate != VIBRATION]
    for count in range(0 if vibrations or none else 1, len(causes) + 1):
        yield (*vibrations, *causes[:count])


def _along_one_sinusoid(selected: Selected) -> float:
    """The shift in s at which the base model leaves least along one sinusoid, if it leaves more
    than noise; up to a quarter of a turn, beyond which the effort changes its sign."""
    search, kept = selected.search, selected.search.data.results
    room = search.criterion.room(selected.start, search.noise)
    if search.data.several_speeds or room <= search.added.value:
        return 0.0
    if far_shift_s not in kept:
        reach_s = search.excitation.quarter_turn_s
        kept[far_shift_s] = far_shift_s(search.data.segments, _step_s(search.data), reach_s)
    return float(kept[far_shift_s])


def _step_s(data: AxisData) -> float:
    """Between shifts that are tried."""
    return 1.0 / (STEPS_PER_PERIOD * max(s.cutoff_hz for s in data.segments))


def _mean(model: FittedModel, data: AxisData) -> float:
    """Mean of the squared residuals: a shift leaves fewer samples to compare."""
    return model.error / np.count_nonzero(data.valid)


def _out_of_step(data: AxisData, late_s: float) -> AxisData:
    """The same data, with every effort where it was recorded."""
    shifts = [within_limits(late_s, 0.0, s.raw_period_s) for s in data.segments]
    segments = tuple(map(out_of_step, data.segments, shifts))
    return replace(data.with_efforts_of(segments), late_s=late_s)
