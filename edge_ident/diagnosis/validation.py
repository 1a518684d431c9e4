"""What a model found in one recording is worth on another.

Base and extended model are scored like for like: inside the same physical bounds, on the same
samples of the other recording. Its effort is in step beside the extended model. The offset and the
rest of the timing are fitted anew for each, because they differ from one day to the next. Terms
that are tied to the time of their recording are left out; what they change in the base parameters
(a warm-up: viscous friction) is fitted anew, too.

Each cause is judged by leaving it out: the rest is fitted again to the first recording, and both
models predict the other one. A cause carries over if the residual there is certainly smaller with
it; or if it is smaller, and certainly so once the base parameters are fitted to that recording:
what they got wrong must not hide the cause. The 95 % interval is that of sums over blocks of time,
because the residual is coloured. What does not carry over leaves the model, the worst first, until
the rest does and together beats the base model. So does a cause that has no certain size any more
beside what carries over.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from edge_ident.diagnosis.budget.agreement import curves_beside, fitted_beside
from edge_ident.diagnosis.elsewhere import (
    fitted_anew,
    leaves_structure,
    residual_elsewhere,
    structure_elsewhere,
)
from edge_ident.diagnosis.error_budget import AgreeingCurve
from edge_ident.diagnosis.fit.candidates import base_regressor, cached_effort, own_columns
from edge_ident.diagnosis.fit.fitting import FittedModel, fit
from edge_ident.diagnosis.fit.held_out import Gain, gain_of, standard_deviations
from edge_ident.diagnosis.fit.linear import orthonormal
from edge_ident.diagnosis.fit.noise_floor import NoiseFloor
from edge_ident.diagnosis.fit.summary import base_space, nonzero_rms, own_shares
from edge_ident.diagnosis.judge.causes import causes, strongest_first
from edge_ident.diagnosis.measures import CarriedCause, Validation, Verdict
from edge_ident.diagnosis.prepare.axis_data import AxisData
from edge_ident.diagnosis.result import Cause
from edge_ident.diagnosis.select.backward_elimination import SupportedModel
from edge_ident.diagnosis.select.cross_validation import unsized
from edge_ident.diagnosis.select.physics import FRICTION
from edge_ident.diagnosis.select.second_looks import in_step_beside
from edge_ident.model.effects import named
from edge_ident.model.model import PARAMETERS
from edge_ident.signals.metrics import rms
from edge_ident.signals.recording import Recording

Array = NDArray[np.float64]


_UNSIZED: Final = "beside what carries over, its size is as uncertain as it is large"


@dataclass(frozen=True)
class Judged:
    """A model after another recording has judged it, or none has.

    Attributes
    ----------
    supported : SupportedModel
        With what carries over, and the terms that are tied to time.
    suspected : tuple of Cause
        What does not carry over; the decision says why.
    validation : Validation or None
    unexplained : bool
        Whether the other recording has structure left.
    """

    supported: SupportedModel
    suspected: tuple[Cause, ...] = ()
    validation: Validation | None = None
    unexplained: bool = False

    def verdict(self, verdict: Verdict) -> Verdict:
        """The verdict of both recordings, from that of the first one."""
        if self.unexplained:
            return Verdict.UNEXPLAINED
        nothing_named = all(support.minor for support in self.supported.support)
        if self.suspected and nothing_named and verdict is Verdict.EXPLAINED:
            return Verdict.ADEQUATE
        return verdict

    def carried(self, causes: tuple[Cause, ...]) -> tuple[Cause, ...]:
        """Causes for the model file: where another recording judges, none that is tied to time."""
        if self.validation is None:
            return causes
        return tuple(cause for cause in causes if not named(cause.term.effect).tied_to_time)


def judge(
    data: AxisData,
    other: AxisData,
    base: FittedModel,
    supported: SupportedModel,
    tolerance: float,
) -> Judged:
    """Let another recording judge a supported model; see `carry_over`.

    Parameters
    ----------
    tolerance : float
        Smallest share of the rms effort that is worth naming.
    """
    model = supported.model
    other = in_step_beside(other, model.axis)
    carried = carry_over(data, other, base, model)
    lost = [k for k in range(len(model.terms)) if k not in carried.kept]
    suspected: tuple[Cause, ...] = ()
    if lost:
        every = causes(
            supported,
            own_shares(data, model, base_space(data, base)),
            standard_deviations(data, model),
        )
        suspected = strongest_first(
            replace(every[k], decision=carried.validation.causes[k].reason) for k in lost
        )
    anew = fitted_anew(carried.model)
    left = residual_elsewhere(other, carried.model, anew)
    return Judged(
        supported.of(carried.model, carried.kept),
        suspected,
        carried.validation,
        structure_elsewhere(data, other, carried.model, left, anew, tolerance)
        or bool(lost and leaves_structure(data, base, carried.model, tolerance)),
    )


@dataclass(frozen=True)
class Carried:
    """What is left of a model after another recording has judged it.

    Attributes
    ----------
    model : FittedModel
        Fitted to the first recording, with the terms that carry over and those tied to time.
    kept : tuple of int
        Places of its terms in the model that was judged.
    validation : Validation
        Its causes are in the order of that model's terms.
    """

    model: FittedModel
    kept: tuple[int, ...]
    validation: Validation


def carry_over(data: AxisData, other: AxisData, base: FittedModel, model: FittedModel) -> Carried:
    """Let another recording judge the terms of a model.

    Parameters
    ----------
    data : AxisData
        That the models were fitted to.
    other : AxisData
        The same axis in another recording.
    base : FittedModel
        Fitted without any added term.
    model : FittedModel
        Without external vibrations.
    """
    kept = tuple(range(len(model.terms)))
    start, left = (residual_elsewhere(other, m, fitted_anew(model)) for m in (base, model))
    found, as_found = model, left
    judged = {k: _not_judged(t.candidate.effect) for k, t in enumerate(model.terms)}
    while weighed := _weighed(data, other, found, kept, left):
        judged |= {k: one.cause for k, one in weighed.items()}
        doubtful = weighed
        if rms(left) <= rms(start):
            doubtful = {k: one for k, one in weighed.items() if not one.cause.carries_over}
        if not doubtful and found is not model:
            doubtful = _unsized(data, found, kept, weighed)
        if not doubtful:
            break
        worst = min(doubtful, key=lambda k: weighed[k].gain.interval[0])
        judged[worst] = doubtful[worst].refused
        found, left = doubtful[worst].without, doubtful[worst].residual
        kept = tuple(k for k in kept if k != worst)
    scale = nonzero_rms(other.effort[other.valid])
    anew = sorted({*fitted_anew(found), *map(PARAMETERS.index, FRICTION)})
    of_base, of_found = (rms(residual_elsewhere(other, m, anew)) / scale for m in (base, found))
    validation = Validation(
        rms(start) / scale,
        rms(left) / scale,
        rms(as_found) / scale,
        (of_base, of_found),
        tuple(judged.values()),
    )
    return Carried(found, kept, validation)


@dataclass(frozen=True)
class _Weighed:
    """A term against the model fitted without it, and what that leaves of the other recording."""

    cause: CarriedCause
    gain: Gain
    without: FittedModel
    residual: Array

    @property
    def refused(self) -> CarriedCause:
        """The cause, not carried over."""
        if not self.cause.carries_over:
            return self.cause
        reason = "with it the model predicts the other recording worse than the base model does"
        return replace(self.cause, carries_over=False, reason=reason)


def _unsized(
    data: AxisData, model: FittedModel, places: tuple[int, ...], weighed: Mapping[int, _Weighed]
) -> dict[int, _Weighed]:
    """Terms that carry over, of which the first recording shows no certain size any more."""
    unknown = [k for k, doubtful in zip(places, unsized(data, model), strict=True) if doubtful]
    return {
        k: replace(one, cause=replace(one.cause, carries_over=False, reason=_UNSIZED))
        for k, one in weighed.items()
        if k in unknown
    }


def _weighed(
    data: AxisData, other: AxisData, model: FittedModel, places: tuple[int, ...], left: Array
) -> dict[int, _Weighed]:
    """Each term that is not tied to time, by its place in the model that is judged."""
    scale, block = nonzero_rms(other.effort[other.valid]), other.block[other.valid]
    columns = np.hstack([base_regressor(other), own_columns(other)])
    basis = orthonormal(columns[other.valid])
    found = {}
    for k, place in enumerate(places):
        effect = model.terms[k].candidate.effect
        if named(effect).tied_to_time:
            continue
        less = fit(data, model.template, model.base, model.without(k))
        without = residual_elsewhere(other, less, fitted_anew(model))
        gain = gain_of(block, without, left)
        refitted = gain_of(block, *(r - basis @ (basis.T @ r) for r in (without, left)))
        carries = gain.certain or (gain.value > 0.0 and refitted.certain)
        reason = _reason(gain, refitted if carries and not gain.certain else None)
        cause = CarriedCause(
            effect, rms(without) / scale, gain.value, gain.interval, carries, reason
        )
        found[place] = _Weighed(cause, gain, less, without)
    return found


def _reason(gain: Gain, refitted: Gain | None) -> str:
    """The reason in words; `refitted` where that is what decides."""
    low, high = gain.interval
    if refitted is not None:
        low, high = refitted.interval
        return (
            f"it reduces the residual of the other recording by {gain.value:.1%}, and by {low:.1%} "
            f"to {high:.1%} once the base parameters are fitted to that recording"
        )
    if gain.certain:
        return f"it reduces the residual of the other recording by {low:.1%} to {high:.1%}"
    if high < 0.0:
        return f"it raises the residual of the other recording by {-high:.1%} to {-low:.1%}"
    return (
        "it does not certainly reduce the residual of the other recording: by "
        f"{low:.1%} to {high:.1%}"
    )


def _not_judged(effect: str) -> CarriedCause:
    reason = "it is tied to the time of its recording, and another one says nothing about it"
    return CarriedCause(effect, None, None, None, None, reason)


# In which of several recordings each cause of the common model shows.


def with_sources(
    found: Sequence[Cause], data: AxisData, model: FittedModel, recordings: Sequence[Recording]
) -> list[Cause]:
    """Causes with the recordings in which each acts and certainly reduces the residual.

    Parameters
    ----------
    found : sequence of Cause
        In the order of the model's terms.
    data : AxisData
        Of all recordings together.
    model : FittedModel
        Fitted to them.
    recordings : sequence of Recording
    """
    sources = tuple(recording.source for recording in recordings)
    if len(sources) == 1:
        return [replace(cause, shown_in=sources) for cause in found]
    shown = []
    for k, cause in enumerate(found):
        less = fit(data, model.template, model.base, model.without(k))
        acting = cached_effort(data, model.axis) != cached_effort(data, model.axis_without([k]))
        shows = []
        for number, source in enumerate(sources):
            here = data.valid & (data.recording == number)
            if not np.any(acting[here]):
                continue  # what happens once moves the base parameters of all recordings
            before, after = ((data.effort - m.predicted)[here] for m in (less, model))
            if gain_of(data.block[here], before, after).certain:
                shows.append(source)
        shown.append(replace(cause, shown_in=tuple(shows)))
    return shown


# Curves beside the causes of a model: what agrees in all parts of the recordings, and in another.
#
# A law says more than a curve: it has few parameters, and holds beyond what was recorded. So curves
# take what the base model and the causes leave. Where another recording judges, a curve stays if it
# certainly makes the prediction of that one better.


def with_curves(
    data: AxisData, other: AxisData | None, judged: Judged, floor: NoiseFloor
) -> tuple[Judged, tuple[AgreeingCurve, ...]]:
    """A judged model with the curves that hold, and these.

    Parameters
    ----------
    data : AxisData
        That the model was fitted to.
    other : AxisData or None
        Another recording of the axis, in step beside the model.
    judged : Judged
    floor : NoiseFloor
    """
    model = judged.supported.model
    found = curves_beside(data, model, floor)
    if other is not None:
        found = _holding(data, other, model, found)
    if not found:
        return judged, ()
    extended = fitted_beside(data, model, found)
    judged = replace(judged, supported=replace(judged.supported, model=extended))
    if other is not None and judged.validation is not None:
        left = rms(residual_elsewhere(other, extended, fitted_anew(extended)))
        scale = nonzero_rms(other.effort[other.valid])
        judged = replace(judged, validation=replace(judged.validation, extended=left / scale))
    return judged, found


def _holding(
    data: AxisData, other: AxisData, model: FittedModel, curves: Sequence[AgreeingCurve]
) -> tuple[AgreeingCurve, ...]:
    """Curves without which the model certainly leaves more of another recording."""

    def left(some: Sequence[AgreeingCurve]) -> Array:
        extended = fitted_beside(data, model, some)
        return residual_elsewhere(other, extended, fitted_anew(extended))

    block, with_all = other.block[other.valid], left(curves)
    without = (left([one for one in curves if one is not curve]) for curve in curves)
    gains = (gain_of(block, residual, with_all) for residual in without)
    return tuple(curve for curve, gain in zip(curves, gains, strict=True) if gain.certain)
