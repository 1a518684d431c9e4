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

from collections.abc import Iterable, Mapping, Sequence
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
from edge_ident.diagnosis.judge.judgement import Judgement
from edge_ident.diagnosis.measures import CarriedCause, Validation, Verdict
from edge_ident.diagnosis.nuisances import Difference, difference
from edge_ident.diagnosis.prepare.axis_data import AxisData
from edge_ident.diagnosis.result import Cause
from edge_ident.diagnosis.select.cross_validation import unsized
from edge_ident.diagnosis.select.physics import FRICTION
from edge_ident.diagnosis.select.second_looks import in_step_beside
from edge_ident.diagnosis.select.selection import SupportedModel
from edge_ident.model.effects import named
from edge_ident.model.model import PARAMETERS
from edge_ident.signals.metrics import rms
from edge_ident.signals.recording import Recording

Array = NDArray[np.float64]


_UNSIZED: Final = "beside what carries over, its size is as uncertain as it is large"
_WORSE: Final = "with it the model predicts the other recording worse than the base model does"
_NOT_JUDGED: Final = (
    "it is tied to the time of its recording, and another one says nothing about it"
)


def judge(
    data: AxisData, other: AxisData, base: FittedModel, judged: Judgement, tolerance: float
) -> tuple[Judgement, Difference | None]:
    """Let another recording judge a supported model (see `carry_over`); with what is not as in that
    recording, where the model leaves something there."""
    supported, model = judged.supported, judged.supported.model
    in_step = in_step_beside(other, model.axis)
    found, kept, validation = carry_over(data, in_step, base, model)
    lost = [k for k in range(len(model.terms)) if k not in kept]
    suspected: list[Cause] = []
    if lost:
        shares = own_shares(data, model, base_space(data, base))
        every = causes(supported, shares, standard_deviations(data, model))
        suspected = [replace(every[k], decision=validation.causes[k].reason) for k in lost]
    unexplained = structure_elsewhere(data, in_step, found, tolerance)
    unexplained |= bool(lost) and leaves_structure(data, base, found, tolerance)
    holds = supported.of(found, kept)
    carried = replace(
        judged,
        verdict=verdict_of_both(judged.verdict, holds, lost, unexplained),
        supported=holds,
        suspected=strongest_first((*judged.suspected, *suspected)),
        validation=validation,
    )
    doubtful = unexplained or lost
    return carried, difference(data, other, model, tolerance) if doubtful else None


def verdict_of_both(
    verdict: Verdict, kept: SupportedModel, lost: Sequence[int], unexplained: bool
) -> Verdict:
    """The verdict of both recordings, from that of the first one and what carries over."""
    if unexplained:
        return Verdict.UNEXPLAINED
    nothing_named = all(support.minor for support in kept.support)
    if lost and nothing_named and verdict is Verdict.EXPLAINED:
        return Verdict.ADEQUATE
    return verdict


def carry_over(
    data: AxisData, other: AxisData, base: FittedModel, model: FittedModel
) -> tuple[FittedModel, list[int], Validation]:
    """Let another recording judge the terms of a model.

    Parameters
    ----------
    data : AxisData
        That the models were fitted to.
    other : AxisData
        The same axis in another recording.
    base : FittedModel
        Fitted without any added term.

    Returns
    -------
    FittedModel
        With the terms that carry over, and those tied to time.
    list of int
        Their places in the model that was judged.
    Validation
        Its causes are in the order of that model's terms.
    """
    anew, scale = fitted_anew(model), nonzero_rms(other.effort[other.valid])
    start, as_found = (residual_elsewhere(other, m, anew) for m in (base, model))
    found, left, kept = model, as_found, list(range(len(model.terms)))
    effects = [t.candidate.effect for t in model.terms]
    judged = [CarriedCause(name, None, None, None, None, _NOT_JUDGED) for name in effects]
    while True:
        lasting = [i for i, k in enumerate(kept) if not named(effects[k]).tied_to_time]
        less = {i: fit(data, found.template, found.base, found.without(i)) for i in lasting}
        parts = _parts_elsewhere(other, left, anew, less)
        for i, part in parts.items():
            without, gain = rms(part.residual) / scale, part.gain
            judged[kept[i]] = CarriedCause(
                effects[kept[i]], without, gain.value, gain.interval, part.agrees, part.reason
            )
        doubtful = {i: part.reason for i, part in parts.items() if not part.agrees}
        if rms(left) > rms(start):
            doubtful = dict.fromkeys(parts, _WORSE) | doubtful
        elif not doubtful and found is not model:
            unknown = enumerate(unsized(data, found))
            doubtful = {i: _UNSIZED for i, doubt in unknown if doubt and i in parts}
        if not doubtful:
            break
        worst = min(doubtful, key=lambda i: parts[i].gain.interval[0])
        refused = replace(judged[kept[worst]], carries_over=False, reason=doubtful[worst])
        judged[kept.pop(worst)] = refused
        found, left = less[worst], parts[worst].residual
    anew = _and_friction(fitted_anew(found))
    anew_left = _share_left(other, base, anew), _share_left(other, found, anew)
    base_left, left_in_all, found_left = (rms(r) / scale for r in (start, left, as_found))
    return found, kept, Validation(base_left, left_in_all, found_left, anew_left, tuple(judged))


def _and_friction(anew: Iterable[int]) -> list[int]:
    """Places of base parameters that are fitted to another recording, friction among them."""
    return sorted({*anew, *map(PARAMETERS.index, FRICTION)})


def _share_left(other: AxisData, model: FittedModel, anew: list[int]) -> float:
    """What a model leaves of the effort of another recording, these parameters fitted to that."""
    return rms(residual_elsewhere(other, model, anew)) / nonzero_rms(other.effort[other.valid])


# What another recording says of the parts of a model: causes, and curves.


@dataclass(frozen=True)
class _Part:
    """What a model without a part leaves of another recording, and by how much the part reduces
    that: as it predicts it, and once the base parameters are fitted to it."""

    residual: Array
    gain: Gain
    refitted: Gain

    @property
    def agrees(self) -> bool:
        """Whether the part certainly makes the prediction better."""
        return self.gain.certain or (self.gain.value > 0.0 and self.refitted.certain)

    @property
    def reason(self) -> str:
        """Why it does, or does not."""
        low, high = self.gain.interval
        if self.agrees and not self.gain.certain:
            low, high = self.refitted.interval
            return (
                f"it reduces the residual of the other recording by {self.gain.value:.1%}, and by "
                f"{low:.1%} to {high:.1%} once the base parameters are fitted to that recording"
            )
        if self.gain.certain:
            return f"it reduces the residual of the other recording by {low:.1%} to {high:.1%}"
        if high < 0.0:
            return f"it raises the residual of the other recording by {-high:.1%} to {-low:.1%}"
        return (
            "it does not certainly reduce the residual of the other recording: by "
            f"{low:.1%} to {high:.1%}"
        )


def _parts_elsewhere(
    other: AxisData, left: Array, anew: list[int], without: Mapping[int, FittedModel]
) -> dict[int, _Part]:
    """Each part of a model that leaves so much of another recording, from the model without it."""
    columns = np.hstack([base_regressor(other), own_columns(other)])
    basis, block = orthonormal(columns[other.valid]), other.block[other.valid]
    found = {}
    for key, model in without.items():
        residual = residual_elsewhere(other, model, anew)
        refitted = (r - basis @ (basis.T @ r) for r in (residual, left))
        found[key] = _Part(residual, gain_of(block, residual, left), gain_of(block, *refitted))
    return found


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
    data: AxisData, other: AxisData | None, judged: Judgement, floor: NoiseFloor
) -> tuple[Judgement, tuple[AgreeingCurve, ...]]:
    """A judged model with the curves that hold, and these.

    Parameters
    ----------
    data : AxisData
        That the model was fitted to.
    other : AxisData or None
        Another recording of the axis, in step beside the model.
    """
    model = judged.supported.model
    found = curves_beside(data, model, floor)
    if other is not None and found:
        anew = fitted_anew(model)
        left = residual_elsewhere(other, fitted_beside(data, model, found), anew)
        less = {
            k: fitted_beside(data, model, [one for one in found if one is not curve])
            for k, curve in enumerate(found)
        }
        parts = _parts_elsewhere(other, left, anew, less)
        found = tuple(curve for k, curve in enumerate(found) if parts[k].gain.certain)
    if not found:
        return judged, ()
    extended = fitted_beside(data, model, found)
    judged = replace(judged, supported=replace(judged.supported, model=extended))
    if other is not None and judged.validation is not None:
        anew, of_base = fitted_anew(extended), judged.validation.friction_anew[0]
        validation = replace(
            judged.validation,
            extended=_share_left(other, extended, anew),
            friction_anew=(of_base, _share_left(other, extended, _and_friction(anew))),
        )
        judged = replace(judged, validation=validation)
    return judged, found
