"""The prepared data of one axis over all its recordings."""

from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from itertools import groupby
from typing import Any, Final

import numpy as np
import scipy.linalg
from numpy.typing import NDArray

from edge_ident.diagnosis.prepare.segment import Segment
from edge_ident.diagnosis.tolerance import OUTLIER
from edge_ident.model.model import AxisModel, SupportedRange, sources
from edge_ident.model.motion import LARGEST_SHIFT
from edge_ident.model.search import Excitation, Form, Link, Span
from edge_ident.signals.metrics import rms

Array = NDArray[np.float64]

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
    valid : (n,) array of bool
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
        Regressors that were computed before.
    results : dict
        What was computed from this effort at these samples; data with another have their own.
    """

    segments: tuple[Segment, ...]
    effort: Array
    valid: NDArray[np.bool_]
    block: NDArray[np.intp]
    late_s: float
    turning: frozenset[str] = frozenset()
    own: tuple[str, ...] = ("offset",)
    cache: dict[object, Array] = field(default_factory=dict, compare=False)
    results: dict[object, Any] = field(default_factory=dict, compare=False, init=False)

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
        return replace(self, segments=segments, cache={})

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
            cache={},
        )

    def joined(self, other: "AxisData") -> "AxisData":
        """These recordings and others."""
        return replace(
            self,
            segments=(*self.segments, *other.segments),
            effort=np.concatenate([self.effort, other.effort]),
            valid=np.concatenate([self.valid, other.valid]),
            block=np.concatenate([self.block, other.block]),
            cache={},
        )

    def from_zero(self, zero: float) -> "AxisData":
        """The same recordings, with positions from another zero."""
        segments = tuple(
            replace(s, motion=replace(s.motion, position=s.motion.position - zero), cache={})
            for s in self.segments
        )
        return replace(self, segments=segments, cache={})

    def with_efforts_of(self, segments: tuple[Segment, ...]) -> "AxisData":
        """The same motion with the efforts (n,) of recordings that were moved in time."""
        effort = np.concatenate([s.effort[s.sample_index] for s in segments])
        return replace(self, segments=segments, effort=effort, cache={})

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
        return replace(self, segments=segments, valid=valid, cache={})

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
