"""The prepared data of one axis over all its recordings."""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from itertools import groupby
from typing import Any, Final, TypeVar

import numpy as np
import scipy.linalg
from numpy.typing import NDArray

from edge_ident.diagnosis.measures import OUTLIER
from edge_ident.diagnosis.prepare.bandwidth import Band
from edge_ident.diagnosis.prepare.sampled import SampledFilter
from edge_ident.model.effects import named
from edge_ident.model.inverse import along_motion, inverse_effort, obeyed
from edge_ident.model.model import AxisModel, SupportedRange, sources
from edge_ident.model.motion import LARGEST_SHIFT, Motion
from edge_ident.model.search import Excitation, Form, Link, Span
from edge_ident.signals.filters import lowpass
from edge_ident.signals.metrics import rms

Array = NDArray[np.float64]


# One axis of one recording, prepared: filtered signals, and the samples that are compared.

UNKNOWN: Final = 1e-6
"""Direction weight where the direction is unknown: zero, but for rounding."""
WHOLE_BAND: Final = 0.4
"""Of the sampling rate; below it a shift by a fraction of a sample is exact."""
REACH_PERIODS: Final = 4.0
"""Cut-off periods after which the filter's response is below a ten-thousandth."""
_WHITENING_REACH: Final = 2.0
"""The same in periods of the knee, for the whitening."""


T = TypeVar("T")


def once(kept: dict[object, Any], key: object, make: Callable[[], T]) -> T:
    """What is made once and kept under a key."""
    if key not in kept:
        kept[key] = make()
    found: T = kept[key]
    return found


@dataclass(frozen=True)
class Segment:
    """One axis of one recording, filtered.

    Attributes
    ----------
    motion : Motion
        Smooth, (N,), time from where the first recording begins; wider than the comparison.
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

        The effort is filtered as an identification filters it, which asks later whether another
        motion leaves this range.
        """
        part = slice(self.sample_index[0], self.sample_index[-1] + 1)
        effort = lowpass(self.raw_effort, self.timing_hz, self.raw_period_s)[:: self.stride]
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
    reach_s = max(REACH_PERIODS / band.cutoff_hz, _WHITENING_REACH / band.knee_hz)
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


_APART: Final = 0.3
"""Share of the variation of the squared speed that does not follow from the position, from which
the two are told apart. The correlation is then below 0.95."""


@dataclass(frozen=True)
class AxisData:
    """One axis over all its recordings; samples stand one recording after the other.

    Attributes
    ----------
    segments : tuple of Segment
        One for each recording.
    effort : (n,) array
        Measured, filtered.
    block : (n,) array of int
        Number of the block of time, for cross-validation and for the bootstrap.
    late_s : float
        By about how much one is late, where that is more than a controller's timing can be: then
        all stay as they are. Zero otherwise.
    turning : frozenset of str
        Axes whose positions are angles in every recording.
    own : tuple of str
        Base parameters of which each recording has a value of its own.
    cache : dict
        What was computed before; other data have their own.
    """

    segments: tuple[Segment, ...]
    effort: Array
    valid: NDArray[np.bool_]
    block: NDArray[np.intp]
    late_s: float
    turning: frozenset[str] = frozenset()
    own: tuple[str, ...] = ("offset",)
    cache: dict[object, Any] = field(default_factory=dict, compare=False, init=False)

    def once(self, key: object, make: Callable[[], T]) -> T:
        """What is computed once for these data."""
        return once(self.cache, key, make)

    @property
    def late(self) -> bool:
        """Whether an effort is late by more than a controller's timing can be."""
        return self.late_s != 0.0

    @property
    def reverses(self) -> bool:
        """Whether the axis reverses in any recording."""
        return any(len(s.turns) for s in self.segments)

    @property
    def several_speeds(self) -> bool:
        """Whether the axis passes the same places at different speeds.

        Along one sinusoid, the square of its speed is a parabola over the position.
        """
        position, velocity = (self.of_motion(name) for name in ("position", "velocity"))
        powers = np.vander((position - np.mean(position)) / np.std(position), 3)
        squared = velocity**2
        left = squared - powers @ np.linalg.lstsq(powers, squared, rcond=None)[0]
        return bool(rms(left) > _APART * np.std(squared))

    @property
    def noise_replica(self) -> "AxisData":
        """The same samples, with the encoder noise added to the motion a second time."""
        segments = tuple(
            replace(s, motion=s.noise_replica[0], others=s.noise_replica[1], cache={})
            for s in self.segments
        )
        return replace(self, segments=segments)

    def of_clock(self, clock: int) -> "AxisData":
        """The recordings on one clock alone."""
        on_clock = np.array([s.motion.clock == clock for s in self.segments])
        at = on_clock[self.recording]
        return replace(
            self,
            segments=tuple(s for s in self.segments if s.motion.clock == clock),
            effort=self.effort[at],
            valid=self.valid[at],
            block=self.block[at],
        )

    def joined(self, other: "AxisData") -> "AxisData":
        """These recordings and others."""
        return replace(
            self,
            segments=(*self.segments, *other.segments),
            effort=np.concatenate([self.effort, other.effort]),
            valid=np.concatenate([self.valid, other.valid]),
            block=np.concatenate([self.block, other.block]),
        )

    def from_zero(self, zero: float) -> "AxisData":
        """The same recordings, with positions from another zero."""
        segments = tuple(
            replace(s, motion=replace(s.motion, position=s.motion.position - zero), cache={})
            for s in self.segments
        )
        return replace(self, segments=segments)

    def with_efforts_of(self, segments: tuple[Segment, ...]) -> "AxisData":
        """The same motion with the efforts (n,) of recordings that were moved in time."""
        effort = np.concatenate([s.effort[s.sample_index] for s in segments])
        return replace(self, segments=segments, effort=effort)

    @property
    def recording(self) -> NDArray[np.intp]:
        """Number of the recording that each sample is of, (n,)."""
        lengths = [len(s.sample_index) for s in self.segments]
        return np.repeat(np.arange(len(lengths)), lengths)

    @property
    def timing_columns(self) -> Array:
        """What a further shift of each of the R recordings adds to the effort, per s, (n, R)."""
        columns = (s.timing_column[:, None] for s in self.segments)
        return np.asarray(scipy.linalg.block_diag(*columns))

    @property
    def timing_limits(self) -> tuple[Array, Array]:
        """Least and largest further shift of each recording in s, (R,) each."""
        largest = np.array([LARGEST_SHIFT * s.raw_period_s for s in self.segments])
        applied = np.array([s.applied_s for s in self.segments])
        return -largest - applied, largest - applied

    @property
    def samples(self) -> int:
        """Number of samples at the rate of the regressors, all recordings together."""
        return sum(len(s.effort) for s in self.segments)

    @property
    def other_axes(self) -> tuple[str, ...]:
        """Axes that are in every recording and move in one of them."""
        shared = set.intersection(*(set(s.others) for s in self.segments))
        moves = {n for n in shared for s in self.segments if np.ptp(s.others[n].position) > 0.0}
        return tuple(sorted(moves))

    @property
    def carriers(self) -> frozenset[str]:
        """Axes that a recording lists earlier and none later: joints are listed from the base
        outwards."""
        earlier, later = zip(*(s.listed for s in self.segments), strict=True)
        return frozenset().union(*earlier).difference(*later)

    def sources(self, form: Form) -> tuple[str | None, ...]:
        """Other axes that may take part in a form, alone or as a sum; None where it needs none."""
        if not form.coupled:
            return (None,)
        axes = self.other_axes
        if form.link is not None:
            axes = tuple(a for a in axes if (a in self.carriers) == (form.link is Link.OUTER))
        if form.turning:
            axes = tuple(a for a in axes if a in self.turning)
        return tuple(sources(axes, 2 if form.sums else 1)) if form.senses else axes

    @property
    def since_reversal(self) -> Array:
        """Distance travelled since the last reversal, (n,)."""
        parts = []
        for s in self.segments:
            travelled = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(s.motion.position)))])
            starts = np.concatenate([[0], s.turns + 1])
            last = starts[np.searchsorted(starts, s.sample_index, side="right") - 1]
            parts.append(travelled[s.sample_index] - travelled[last])
        return np.concatenate(parts)

    def of_motion(self, name: str) -> Array:
        """Time, position, velocity or acceleration of the motion, (n,)."""
        return np.concatenate([getattr(s.motion, name)[s.sample_index] for s in self.segments])

    @property
    def supported(self) -> SupportedRange:
        """What the recordings cover from the first to the last compared sample.

        Reversals in between count, although they are not compared: the axis was there.
        """
        covered = [s.covered for s in self.segments]
        return SupportedRange.of(
            *(np.concatenate(signals) for signals in zip(*covered, strict=True))
        )

    def by_segment(self, values: NDArray[Any]) -> list[NDArray[Any]]:
        """Values (n, ...) of all samples, cut into those of each recording."""
        ends = np.cumsum([len(s.sample_index) for s in self.segments])[:-1]
        return np.split(values, ends)

    def exceeds_aliasing(self, residual: Array, inertia: float) -> NDArray[np.bool_]:
        """Invalid samples (n,) whose residual aliased quantization cannot explain.

        Their residual exceeds what aliasing makes of the inertia and of the controller's answer,
        and five standard deviations of the residual at the valid samples.
        """
        aliased = np.concatenate(
            [
                np.full(
                    len(s.sample_index), max(inertia * s.aliased_acceleration, s.aliased_effort)
                )
                for s in self.segments
            ]
        )
        elsewhere = rms(residual[self.valid])
        most = np.maximum(aliased, OUTLIER * elsewhere)
        return np.asarray(~self.valid & (np.abs(residual) > most))

    def with_valid(self, samples: NDArray[np.bool_]) -> "AxisData":
        """The same with more samples (n,) valid."""
        return self._with_only(self.valid | samples)

    def without_ends(self, by_s: float) -> "AxisData":
        """The same where no sample is valid that a shift by some time joins with what was not
        recorded."""
        return self._with_only(self.valid & ~self.near_ends(by_s))

    def near_ends(self, by_s: float) -> NDArray[np.bool_]:
        """Such samples, (n,)."""
        return np.concatenate([s.near_ends(by_s) for s in self.segments])

    def _with_only(self, valid: NDArray[np.bool_]) -> "AxisData":
        """The same with these samples (n,) valid."""
        segments = tuple(
            replace(s, valid=part)
            for s, part in zip(self.segments, self.by_segment(valid), strict=True)
        )
        return replace(self, segments=segments, valid=valid)

    def from_start(self) -> "AxisData":
        """The same with the samples of the start among those that are compared, and not valid."""
        added = [len(s.start_index) for s in self.segments]
        if not any(added):
            return self
        segments = tuple(s.from_start() for s in self.segments)
        blocks = zip(self.by_segment(self.block), added, strict=True)
        return replace(
            self.with_efforts_of(segments),
            valid=np.concatenate([s.valid for s in segments]),
            block=np.concatenate([np.pad(block, (more, 0), "edge") for block, more in blocks]),
        )

    def excitation(self, base: Array) -> Excitation:
        """What the recordings excite, together; `base` are the base parameters (4,)."""
        position, velocity, acceleration = (
            self.of_motion(name) for name in ("position", "velocity", "acceleration")
        )
        return Excitation(
            lowest=float(np.min(position)),
            travel=float(np.ptp(position)),
            speed=float(np.max(np.abs(velocity))),
            typical_speed=rms(velocity),
            acceleration=rms(acceleration),
            effort=max(float(np.max(np.abs(s.raw_effort))) for s in self.segments),
            resolution=max(s.position_noise for s in self.segments) * np.sqrt(12.0),
            duration_s=max(float(s.motion.time_s[-1]) for s in self.segments),
            cutoff_hz=max(s.cutoff_hz for s in self.segments),
            sampling_s=max(s.raw_period_s for s in self.segments),
            base=base,
            spans=tuple(self._spans()),
        )

    def _spans(self) -> Iterator[Span]:
        """The time that the recordings on each clock cover."""
        for clock, of_clock in groupby(self.segments, key=lambda s: s.motion.clock):
            first, *others = of_clock
            last = others[-1] if others else first
            yield Span(clock, float(first.motion.time_s[0]), float(last.motion.time_s[-1]))

    def predicted(self, axis: AxisModel) -> Array:
        """Filtered effort that a model predicts, (n,) or (D, n)."""
        return np.concatenate([s.predicted(axis) for s in self.segments], axis=-1)
