"""One axis of one recording, prepared: filtered signals, and the samples that are compared."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from edge_ident.diagnosis.prepare.bandwidth import Band
from edge_ident.diagnosis.prepare.sampled_filter import SampledFilter
from edge_ident.model.effects import named
from edge_ident.model.inverse import along_motion, inverse_effort, obeyed
from edge_ident.model.model import AxisModel
from edge_ident.model.motion import Motion
from edge_ident.signals.filters import lowpass

Array = NDArray[np.float64]

UNKNOWN: Final = 1e-6
"""Direction weight where the direction is unknown: zero, but for rounding."""
WHOLE_BAND: Final = 0.4
"""Of the sampling rate; below it a shift by a fraction of a sample is exact."""
_REACH_PERIODS: Final = 4.0
"""Cut-off periods after which the filter's response is below a ten-thousandth."""
_WHITENING_REACH: Final = 2.0
"""The same in periods of the knee, for the whitening."""


@dataclass(frozen=True)
class Segment:
    """One axis of one recording, filtered.

    Attributes
    ----------
    motion : Motion
        Smooth, (N,), time from where the first recording begins; wider than the comparison.
    others : mapping of axis name to Motion
    listed : pair of frozenset of str
        Axes with a drive that the recording lists before this one, and after it.
    noise_replica : tuple of Motion and mapping
        The same two with the encoder noise added a second time.
    motion_hz : float
        Bandwidth of the motion.
    raw_effort : (M,) array
        As recorded, every raw_period_s; it is in step with the motion shift_s later.
    timing_hz : float
        Bandwidth of what shows the shift between effort and motion.
    applied_s : float
        Part of this shift that `shift_s` takes out already.
    timing_column : (n,) array
        What a further shift adds to the effort of the base model at the compared samples, per s.
    turns : array of int
        Last samples before the motion, filtered as the comparison, changes its direction.
    direction_weight : (M,) array
        From 0, where the direction of motion is unknown, to 1. Effort and regressors are
        multiplied by it before they are filtered, so that the filter spreads nothing unknown.
    reversing : (M,) array of bool
        Where the direction is unknown, short rests without a reversal aside.
    effort : (N,) array
        Filtered, in step with the motion: every stride-th sample.
    start_index : array of int
        Samples at the start that are not compared: decimated, of known direction.
    sample_index : (n,) array of int
        Samples that are compared: those after the start.
    valid : (n,) array of bool
        Those at which encoder quantization does not alias into the band.
    far : (n,) array of bool
        The valid ones that no reversal or standstill can have reached through the filter.
    aliased_acceleration : float
        Largest acceleration that aliased encoder quantization can imitate.
    aliased_effort : float
        Largest effort that a controller's aliased answer to it can be.
    position_noise, acceleration_noise, effort_noise : float
        Standard deviations of white noise; the last two when cut off sharply at the cut-off.
    cache : dict
        Efforts along the motion that were integrated before, and what else follows from the motion
        alone. A segment whose effort was moved shares it.
    """

    motion: Motion
    others: Mapping[str, Motion]
    listed: tuple[frozenset[str], frozenset[str]]
    noise_replica: tuple[Motion, Mapping[str, Motion]]
    motion_hz: float
    raw_effort: Array
    raw_period_s: float
    shift_s: float
    timing_hz: float
    stride: int
    turns: NDArray[np.intp]
    direction_weight: Array
    reversing: NDArray[np.bool_]
    effort: Array
    start_index: NDArray[np.intp]
    sample_index: NDArray[np.intp]
    valid: NDArray[np.bool_]
    far: NDArray[np.bool_]
    band: Band
    period_s: float
    filter: SampledFilter
    aliased_acceleration: float
    aliased_effort: float
    position_noise: float
    acceleration_noise: float
    effort_noise: float
    applied_s: float = 0.0
    timing_column: Array = field(default_factory=lambda: np.zeros(0))
    cache: dict[object, Any] = field(default_factory=dict, compare=False)

    @property
    def cutoff_hz(self) -> float:
        """Bandwidth of the comparison."""
        return self.band.cutoff_hz

    @property
    def effort_density(self) -> float:
        """Power of the white noise of the effort, per Hz."""
        return self.effort_noise**2 / self.cutoff_hz

    def in_step(self, applied_s: float) -> "Segment":
        """The same with a part of the shift taken out of the effort."""
        shift_s = self.shift_s + self.applied_s - applied_s
        effort = filtered_effort(
            self.raw_effort, self.direction_weight, self.band, self.raw_period_s, shift_s
        )
        return replace(self, shift_s=shift_s, applied_s=applied_s, effort=effort[:: self.stride])

    def from_start(self) -> "Segment":
        """The same with the samples of the start among those that are compared, and not valid."""
        added = len(self.start_index)
        sample_index = np.concatenate([self.start_index, self.sample_index])
        weight = self.direction_weight[:: self.stride]
        return replace(
            self,
            start_index=self.start_index[:0],
            sample_index=sample_index,
            valid=np.pad(self.valid, (added, 0)),
            far=np.pad(self.far, (added, 0)),
            filter=filter_at(sample_index, weight, self.band, self.period_s),
            timing_column=np.pad(self.timing_column, (added, 0)),
            cache={},
        )

    def near_ends(self, by_s: float) -> NDArray[np.bool_]:
        """Samples (n,) that a shift by some time, or the filter, joins with what was not recorded
        before the start or after the end."""
        time_s = self.period_s * self.sample_index
        end_s = self.raw_period_s * (len(self.raw_effort) - 1)
        to_end_s = np.minimum(time_s, end_s - time_s)
        return np.asarray(to_end_s < abs(by_s) + 1.0 / self.cutoff_hz)

    @property
    def direction_known(self) -> NDArray[np.bool_]:
        """Samples (N,), from the first to the last compared, whose direction is not unknown."""
        known = self.direction_weight[:: self.stride] > UNKNOWN
        known[: self.sample_index[0]] = known[self.sample_index[-1] + 1 :] = False
        return np.asarray(known)

    @property
    def covered(self) -> tuple[Array, Array, Array, Array]:
        """Position, velocity, acceleration and effort from the first to the last sample compared.

        The effort is filtered as the comparison, and not weighted.
        """
        part = slice(self.sample_index[0], self.sample_index[-1] + 1)
        effort = self.band.lowpass(self.raw_effort, self.raw_period_s)[:: self.stride]
        m = self.motion
        return m.position[part], m.velocity[part], m.acceleration[part], effort[part]

    def obeyed_effort(self, axis: AxisModel) -> Array:
        """Effort of a model along the motion, (N,) or (D, N), unfiltered, without what its actuator
        withholds."""
        return inverse_effort(obeyed(axis), self.motion, self.others, self.cache)

    def predicted(self, axis: AxisModel) -> Array:
        """Filtered effort that a model predicts at the compared samples, (n,) or (D, n)."""
        effort = self.obeyed_effort(axis)
        sampled = self.filter(np.atleast_2d(effort))
        for term in axis.terms:
            effect = named(term.effect)
            if effect.overrides("withheld"):
                withheld = effect.withheld(self.raw_effort, along_motion(term))
                sampled = sampled + self.sampled(withheld)
        return sampled if sampled.shape[0] > 1 or effort.ndim > 1 else sampled[0]

    def sampled(self, raw: Array) -> Array:
        """A raw effort (..., M), filtered, at the compared samples (..., n)."""
        filtered = filtered_effort(
            raw, self.direction_weight, self.band, self.raw_period_s, self.shift_s
        )
        return filtered[..., :: self.stride][..., self.sample_index]


def filter_at(
    sample_index: NDArray[np.intp], weight: Array, band: Band, period_s: float
) -> SampledFilter:
    """The filter of the comparison, weighted by (N,), at a few samples."""
    samples = len(weight)
    reach_s = max(_REACH_PERIODS / band.cutoff_hz, _WHITENING_REACH / band.knee_hz)
    reach = min(int(reach_s / period_s), samples - 1)
    impulse = np.zeros(2 * reach + 1)
    impulse[reach] = 1.0
    kernel = band.lowpass(impulse, period_s)
    return SampledFilter.of(kernel, sample_index, weight)


def filtered_effort(
    raw: Array, direction_weight: Array, band: Band, period_s: float, shift_s: float
) -> Array:
    """Filter a raw effort (..., M): in step with the motion, weighted, low-pass."""
    in_step = lowpass(raw, WHOLE_BAND / period_s, period_s, delay_s=shift_s)
    return band.lowpass(direction_weight * in_step, period_s)
