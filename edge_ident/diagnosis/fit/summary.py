"""What a fitted model comes to: residuals, metric, parameters, contributions and traces.

Every figure is taken over the valid samples, and relative to the measured effort there.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from edge_ident.diagnosis.fit.fitting import (
    FittedModel,
    contributions,
    delayed,
    jacobian_of,
    reduced_axis,
    term_effort,
)
from edge_ident.diagnosis.fit.held_out import held_out_residuals
from edge_ident.diagnosis.fit.linear import orthonormal
from edge_ident.diagnosis.measures import ModelFit, Traces
from edge_ident.diagnosis.prepare.axis_data import AxisData, Segment
from edge_ident.diagnosis.prepare.timing import whole_shift
from edge_ident.model.effects import named
from edge_ident.model.inverse import along_motion
from edge_ident.model.model import PARAMETERS, AxisModel, Estimate, regressor_rows
from edge_ident.model.motion import NO_SHIFT, Timing
from edge_ident.signals.filters import lowpass
from edge_ident.signals.metrics import compare, rms

Array = NDArray[np.float64]


_TINY: Final = float(np.finfo(float).tiny)


def model_fit(data: AxisData, fitted: FittedModel, deviations: Array) -> ModelFit:
    """Summarize a fitted model; `deviations` (P,) begins with those of its base parameters."""
    valid = data.valid
    scale = nonzero_rms(data.effort[valid])
    return ModelFit(
        estimate=Estimate(fitted.base, deviations[:4]),
        fitted=rms((data.effort - fitted.predicted)[valid]) / scale,
        held_out=rms(held_out_residuals(data, fitted)[valid]) / scale,
        metric=compare(data.effort[valid], fitted.predicted[valid]),
    )


def timing(data: AxisData, fitted: FittedModel) -> Timing:
    """Shift between effort and position beside all terms of a model, the mean of all recordings.

    A delay in the model leaves nothing to the timing.
    """
    if delayed(fitted.axis):
        return NO_SHIFT
    found = [whole_shift(segment, fitted.axis) for segment in data.segments]
    shift, std = np.array([(s.shift_s, max(s.std_s, _TINY)) for s in found]).T
    period = np.array([s.raw_period_s for s in data.segments])
    weight = std**-2.0 / np.sum(std**-2.0)
    deviation = float(np.sum(std**-2.0) ** -0.5)
    return Timing(
        shift_s=float(weight @ shift),
        shift_samples=float(weight @ (shift / period)),
        std_samples=deviation / float(weight @ period),
    )


def traces(
    data: AxisData, start: FittedModel, model: FittedModel, parts: Sequence[Array]
) -> Traces:
    """Signals and predictions over time; `parts` are the contributions of the model's terms."""
    return Traces(
        time_s=data.of_motion("time_s"),
        position=data.of_motion("position"),
        velocity=data.of_motion("velocity"),
        acceleration=data.of_motion("acceleration"),
        effort=data.effort,
        base_effort=start.predicted,
        extended_effort=model.predicted,
        contributions=_by_effect(model, parts),
        since_reversal=data.since_reversal,
        valid=data.valid,
        file=data.recording,
        recording=data.recording,
    )


def _by_effect(model: FittedModel, parts: Sequence[Array]) -> Mapping[str, Array]:
    """Contributions added up by effect: several orders of a ripple are one effect."""
    added: dict[str, Array] = {}
    for t, part in zip(model.terms, parts, strict=True):
        effect = t.candidate.effect
        added[effect] = added.get(effect, 0.0) + part
    return added


def nonzero_rms(values: Array) -> float:
    """Root mean square, and the smallest number instead of zero: a denominator."""
    return max(rms(values), _TINY)


# A cause's own effort: the part of its contribution that the base model cannot express.
#
# Friction that bends, for example, mostly takes the place of viscous friction. Only what is
# orthogonal to the base model's columns is new. Shares, ranks and comparisons of causes use it.


def base_space(data: AxisData, start: FittedModel) -> Array:
    """Orthonormal basis (n, K) of the columns of the base parameters, and of each recording's own
    offset, at the valid samples.

    Timing is none of them: it is a property of the record, known to a part of a sample.
    """
    timing = len(PARAMETERS) + np.arange(len(data.segments))
    columns = jacobian_of(data, start)[data.valid, start.base_columns]
    return orthonormal(np.delete(columns, timing, axis=1))


def own_efforts(data: AxisData, model: FittedModel, space: Array) -> Array:
    """Own effort (T, n) of each added term at the valid samples.

    Parameters
    ----------
    space : (n, R) array
        Of the base model's columns (`base_space`).
    """
    parts = contributions(data, model)
    efforts = np.array(parts).reshape(len(parts), len(data.effort))[:, data.valid]
    return np.asarray(efforts - (efforts @ space) @ space.T)


def own_shares(data: AxisData, model: FittedModel, space: Array) -> list[float]:
    """Rms of each term's own effort over the rms of the measured effort."""
    scale = nonzero_rms(data.effort[data.valid])
    return [rms(effort) / scale for effort in own_efforts(data, model, space)]


# The size of a cause: by how much it reduces the effort as it was recorded.
#
# The comparison attenuates from the knee on, and fades out around reversals, where play, presliding
# and impacts act most of all. So whether a cause is worth naming is judged on the effort as it is,
# up to the cut-off of the comparison and wherever the encoder resolves the direction. Above the
# cut-off the cause's formula was not compared with anything.
#
# The size is what the cause reduces the residual by, and no extrapolation. An effort s beside a
# residual r takes off ‖r + s‖² - ‖r‖² = 2·s·(r + s) - ‖s‖². So an s that is not in the record
# counts against the cause, and so does the noise that it has from the encoder.


def recorded_sizes(data: AxisData, model: FittedModel) -> list[float]:
    """By how much each added term, with the others of its law, reduces the recorded effort.

    Returns
    -------
    list of float
        One for each term: root of the mean square that the residual has more without it, after
        projection on the base model's columns, over the rms of the effort. Negative where the
        residual has less without it.
    """
    together = [model.of_law(model.terms[place]) for place in range(len(model.terms))]
    seen = [s.direction_known for s in data.segments]
    places = list(zip(data.segments, seen, strict=True))
    effort = np.concatenate([_compared(s, measured(s), at) for s, at in places])
    motions = [
        _compared(s, regressor_rows(s.motion.velocity, s.motion.acceleration), at).T
        for s, at in places
    ]
    basis = orthonormal(np.vstack(motions))

    def left(axis: AxisModel) -> float:
        """Mean square of the residual of a model."""
        made = [_compared(s, along(s, axis), at) for s, at in places]
        residual = effort - np.concatenate(made)
        residual = residual - basis @ (basis.T @ residual)
        return float(residual @ residual) / len(residual)

    whole, scale = left(model.axis), nonzero_rms(effort)
    sizes = {}
    for terms in set(together):
        more = left(reduced_axis(data, model, terms)) - whole
        sizes[terms] = float(np.sign(more) * np.sqrt(np.abs(more))) / scale
    return [sizes[terms] for terms in together]


def _compared(segment: Segment, signals: Array, known: NDArray[np.bool_]) -> Array:
    """Signals (..., N) up to the cut-off, at the samples whose direction is known."""
    return lowpass(known * signals, segment.cutoff_hz, segment.period_s)[..., known]


def measured(segment: Segment) -> Array:
    """The recorded effort (N,) in step with the motion, and as wide."""
    return _as_motion(segment, segment.raw_effort)


def _as_motion(segment: Segment, raw: Array) -> Array:
    """A raw effort (M,) at the samples and the bandwidth of the motion."""
    period_s, delay_s = segment.raw_period_s, segment.shift_s
    smooth = lowpass(raw, segment.motion_hz, period_s, delay_s=delay_s)
    return np.asarray(smooth[:: segment.stride])


def along(segment: Segment, axis: AxisModel) -> Array:
    """Effort (N,) of a model along the motion, unfiltered."""
    effort = segment.obeyed_effort(axis)
    for term in axis.terms:
        effect = named(term.effect)
        if effect.overrides("withheld"):
            withheld = effect.withheld(segment.raw_effort, along_motion(term))
            effort = effort + _as_motion(segment, withheld)
    return np.asarray(effort)


# Laws that act where a speed or an effort is larger than at any other time.
#
# Such a law shows once, and a disturbance in time may describe it. Whether it does so any better
# than a law is a question of fit: a law bends from some value on, or jumps there.


_BENDS: Final = (1.0, 0.9, 0.8, 0.7)
"""Parts of the range at all other times from which on a law may act."""
_JUMPS: Final = (0.0, 0.25, 0.5, 0.75)
"""Parts of what lies beyond it at which a law may jump."""


@dataclass(frozen=True)
class Extremes:
    """Where S signals (S, N) lie beyond their ranges at the quiet samples (N,), all at once."""

    signals: Array
    quiet: NDArray[np.bool_]

    def excess(self, part: float = 1.0) -> Array:
        """How far (N,) the signals lie beyond a part of these ranges; the least of them counts."""
        known = part * self.signals[:, self.quiet]
        low, high = (f(known, axis=1, keepdims=True) for f in (np.min, np.max))
        beyond = np.maximum(low - self.signals, self.signals - high)
        return np.asarray(np.maximum(np.min(beyond, axis=0), 0.0))

    @property
    def laws(self) -> Array:
        """Efforts (L, N) that add up to any law that bends or jumps there."""
        bends = [self.excess(part) for part in _BENDS]
        excess = bends[0]
        jumps = [1.0 * (excess > part * np.max(excess)) for part in _JUMPS]
        return np.array([excess**2, *bends, *jumps])


def error_with(data: AxisData, model: FittedModel, places: list[int], laws: Array) -> float:
    """Sum of squares that a model leaves with laws in the place of some of its terms.

    Parameters
    ----------
    places : list of int
        Of the terms.
    laws : (L, N) array
        Efforts along all motions, one after the other.
    """
    ends = np.cumsum([len(s.effort) for s in data.segments])[:-1]
    parts = zip(data.segments, np.split(laws, ends, axis=1), strict=True)
    seen = np.concatenate([s.filter(part) for s, part in parts], axis=1)
    of_terms = sum(term_effort(data, model, place) for place in places)
    effort = (data.effort - model.predicted + of_terms)[data.valid]
    own = np.r_[tuple(model.columns_of(place) for place in places)]
    others = np.delete(model.derivatives, own, axis=1)
    basis = orthonormal(np.hstack([others, seen.T])[data.valid])
    left = effort - basis @ (basis.T @ effort)
    return float(left @ left)
