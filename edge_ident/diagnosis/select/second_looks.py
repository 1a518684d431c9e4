"""Second looks beside the causes that were found: a delay, another shift, friction of its own."""

from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import partial
from operator import is_
from typing import Final

import numpy as np

from edge_ident.diagnosis.fit.candidates import own_parameters
from edge_ident.diagnosis.fit.external_vibrations import VIBRATION
from edge_ident.diagnosis.fit.fitting import FittedModel, FittedTerm, delayed, fit
from edge_ident.diagnosis.fit.noise_floor import noise_floor
from edge_ident.diagnosis.fit.refinement import delay, fit_late
from edge_ident.diagnosis.fit.summary import base_space, nonzero_rms, own_shares
from edge_ident.diagnosis.measures import TOLERANCE
from edge_ident.diagnosis.prepare.axis_data import AxisData, Segment
from edge_ident.diagnosis.prepare.timing import (
    MOST_MOVES,
    SHARE_OF_DELAY,
    at_best_fit,
    far_shift_s,
    moved_beside,
    out_of_step,
    untold,
)
from edge_ident.diagnosis.select.acceptance import structure_left
from edge_ident.diagnosis.select.physics import FRICTION
from edge_ident.diagnosis.select.selection import Selected, fitted_base
from edge_ident.diagnosis.select.thresholds import ADDED_TERM, DECISIVE
from edge_ident.model.effects import named
from edge_ident.model.model import AxisModel
from edge_ident.model.motion import LARGEST_SHIFT
from edge_ident.signals.metrics import rms
from edge_ident.signals.timing import STEPS_PER_PERIOD, within_limits

# A delay that larger causes hide.
#
# An effort is late where the delay is most of what the base model leaves (`prepare.timing`). Beside
# a ripple, say, it is little of that, and only timing up to its limit is in the model. What timing
# lacks then looks like a dead band or like friction that follows the load, and a delay of many
# samples like a compliance. So a delay is fitted beside the causes that were found.
#
# Along one sinusoid the base model takes a delay's phase for inertia and friction, and play has
# what it leaves. So a delay is fitted there alone as well, from the shift that leaves least. Where
# the encoder hides by a little when the axis turns, play fits even better: it is doubtful then.


def delayed_data(selected: Selected) -> AxisData | None:
    """The data of an axis as it was recorded, where its causes hid that the effort is late.

    A few causes are asked first: the others may be what the delay was taken for.

    Returns
    -------
    AxisData or None
        None where the effort is in time, or was late before.
    """
    search, start, data = selected.search, selected.start, selected.search.data
    if data.late or delayed(start.template):
        return None
    from_s = along_one_sinusoid(selected)
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


def causes_in_turn(selected: Selected, *, none: bool = False) -> Iterator[tuple[FittedTerm, ...]]:
    """External vibrations alone; then with one cause after the other, the strongest first, last
    those that are like a delay.

    Parameters
    ----------
    none : bool
        Whether nothing comes first where there are no vibrations.
    """
    data, model = selected.search.data, selected.supported.model
    like_delays = delay().search.alternatives
    shares = own_shares(data, model, base_space(data, selected.start))

    def rank(pair: tuple[float, FittedTerm]) -> tuple[bool, bool, float]:
        share, term = pair
        return term.candidate != VIBRATION, term.candidate.effect in like_delays, -share

    terms = tuple(term for _, term in sorted(zip(shares, model.terms, strict=True), key=rank))
    vibrations = sum(term.candidate == VIBRATION for term in terms)
    for count in range(vibrations or (0 if none else 1), len(terms) + 1):
        yield terms[:count]


def along_one_sinusoid(selected: Selected) -> float:
    """The shift in s at which the base model leaves least along one sinusoid, if it leaves more
    than noise; up to a quarter of a turn, beyond which the effort changes its sign."""
    search = selected.search
    if search.data.several_speeds or search.room <= ADDED_TERM:
        return 0.0
    data, reach_s = search.data, search.excitation.quarter_turn_s
    return data.once(far_shift_s, lambda: far_shift_s(data.segments, shift_step_s(data), reach_s))


def shift_step_s(data: AxisData) -> float:
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


# A second look at the shift of an effort, where the first one was wrong.
#
# The first look asks how the effort's slow part is shifted, since noise that the controller answers
# imitates a shift of the rest. It is wrong in two ways:
#
# - A motion of short moves has no slow part that tells. Then the shift at which the base model
#   leaves least is tried, and taken where the model is adequate at it. It is tried as well where a
#   shift of zero is adequate, just: the rest would go to a play or a compliance.
# - No cause is known yet. A dead band, say, asks for a shift of its own, and what it lacks is then
#   in the model to first order only: the rest looks like a spring with much damping. So an effort
#   is moved again beside what was added to the base model, before any of it is exchanged.


def adequate_data(data: AxisData, known: AxisModel, tolerance: float) -> AxisData:
    """The data of an axis, at another shift where the base model is adequate at that one alone, or
    where nothing told the first."""
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

    Returns
    -------
    AxisData or None
        None where no other shift explains decidedly more than the selected model.
    """
    search, start, data = selected.search, selected.start, selected.search.data
    model = selected.supported.model
    best, found = search.value(model) - DECISIVE, None
    if delayed(model.axis):
        return None
    for beside in causes_in_turn(selected, none=len(start.template.terms) > 1):

        def fitted(to: AxisData, beside: tuple[FittedTerm, ...] = beside) -> FittedModel:
            return fit(to, start.template, start.base, beside)

        moved = in_step_beside(data, fitted(data).axis, lambda to: fitted(to).axis)
        value = replace(search, data=moved).value(fitted(moved))
        if moved is not data and value < best:
            best, found = value, moved
    return found


def in_step_beside(
    data: AxisData, axis: AxisModel, anew: Callable[[AxisData], AxisModel] | None = None
) -> AxisData:
    """The data of an axis with every effort in step beside the terms of a model.

    Parameters
    ----------
    anew : callable, optional
        The model of data that were moved; else it stays as it is.
    """
    for _ in range(0 if data.late or delayed(axis) else MOST_MOVES):
        moved = _moved(data, partial(moved_beside, axis=axis))
        if moved is data:
            break
        data, axis = moved, anew(moved) if anew else axis
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


# Whether each of several recordings has friction of its own.
#
# Friction changes with the temperature, by some percent from day to day. A model with one friction
# would have to explain the difference: by a payload that changes, for example.

OWN: Final = ("offset", *FRICTION)


def own_friction_data(selected: Selected) -> AxisData | None:
    """The data of an axis with friction of their own for its recordings.

    Returns
    -------
    AxisData or None
        None where that, with a part of the causes, explains no more than the selected model, or
        a friction is negative that is no share of one.
    """
    selected = without_massless_payloads(selected)
    search, start, data = selected.search, selected.start, selected.search.data
    _, *others = data.segments
    if not others:
        return None
    moved = replace(data, own=OWN)
    criterion = replace(search, data=moved, start=fitted_base(moved, start.template))
    least = search.value(selected.supported.model) - DECISIVE
    for beside in causes_in_turn(selected, none=True):
        model = fit(moved, start.template, start.base, beside)
        if criterion.value(model) < least:
            each = own_parameters(moved, model.base, model.own)
            shared = any(named(t.candidate.effect).search.shares_friction for t in beside)
            physical = all(np.all(each[name] >= 0.0) for name in FRICTION)
            return moved if physical or shared else None
    return None


def without_massless_payloads(selected: Selected) -> Selected:
    """What was selected without payloads whose mass is not worth naming: they are friction."""
    search, model = selected.search, selected.supported.model
    valid = search.data.valid
    least = TOLERANCE * rms(search.data.effort[valid])
    kept = []
    for place, t in enumerate(model.terms):
        mass = t.linear.get("inertia") if named(t.candidate.effect).changes_base else None
        columns = model.jacobian[valid, model.columns_of(place)]
        if mass is None or abs(mass) * rms(columns[:, [*t.linear].index("inertia")]) > least:
            kept.append(place)
    if len(kept) == len(model.terms):
        return selected
    fitted = search.fit(model.base, tuple(model.terms[place] for place in kept))
    return replace(selected, supported=selected.supported.of(fitted, kept))
