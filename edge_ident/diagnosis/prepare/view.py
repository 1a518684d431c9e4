"""One axis as the diagnosis sees it: smooth motions, and the samples that are judged."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Final

import numpy as np
import scipy.sparse
from numpy.typing import NDArray

from edge_ident.diagnosis.prepare.bandwidth import Band
from edge_ident.model.effect import Motion
from edge_ident.model.effects import named
from edge_ident.model.inverse import along_motion, inverse_effort, obeyed
from edge_ident.model.model import AxisModel
from edge_ident.model.search import Excitation
from edge_ident.signals.filters import lowpass

Array = NDArray[np.float64]

_STICKS_OUT: Final = 5.0
"""Standard deviations of a residual."""
_WHOLE_BAND: Final = 0.4
"""Of the sampling rate; a shift by a fraction of a sample leaves alone what lies below."""


@dataclass(frozen=True)
class Stretch:
    """One axis of one recording, filtered.

    Attributes
    ----------
    motion : Motion
        Smooth, (N,), time from the first sample; its bandwidth is wider than what is judged.
    others : mapping of axis name to Motion
    shaken : tuple of Motion and mapping
        The same with the noise of the encoders once more.
    raw_effort : (M,) array
        As recorded, every raw_period_s; its means lie shift_s later.
    turns : array of int
        Last samples before the motion, as smooth as what is judged, changes its direction.
    sliding : (M,) array
        From 0, where nobody knows whereto the axis slides, to 1. Effort and columns are
        multiplied by it before they are filtered, so that nothing unknown is left to be smeared.
    effort : (N,) array
        Filtered, in step with the motion: every stride-th sample.
    picks : (n,) array
        Samples that are used: decimated, mostly of sliding, away from the ends.
    clear : (n,) array of bool
        Those where the encoder's counts do not beat with the sampling.
    far : (n,) array of bool
        Those of them that no reversal or standstill can have reached.
    beat : float
        Largest acceleration that a beat of the encoder's counts with the sampling looks like.
    position_noise, acceleration_noise, effort_noise : float
        Standard deviations of white noise in the position, and in the acceleration and effort
        when cut off sharply at the cut-off.
    """

    motion: Motion
    others: Mapping[str, Motion]
    shaken: tuple[Motion, Mapping[str, Motion]]
    raw_effort: Array
    raw_period_s: float
    shift_s: float
    stride: int
    turns: NDArray[np.intp]
    sliding: Array
    effort: Array
    picks: NDArray[np.intp]
    clear: NDArray[np.bool_]
    far: NDArray[np.bool_]
    band: Band
    period_s: float
    filter: scipy.sparse.csr_array
    beat: float
    position_noise: float
    acceleration_noise: float
    effort_noise: float
    kept: dict[object, Array] = field(default_factory=dict, compare=False)
    """Efforts along the motion that were integrated before."""

    @property
    def cutoff_hz(self) -> float:
        """Upper end of what is judged."""
        return self.band.cutoff_hz

    def predicted(self, axis: AxisModel) -> Array:
        """Effort column that a model expects at the picks, (n,) or (D, n)."""
        effort = inverse_effort(obeyed(axis), self.motion, self.others, self.kept)
        picked = np.asarray((self.filter @ np.atleast_2d(effort).T).T)
        for term in axis.terms:
            effect = named(term.effect)
            if effect.overrides("withheld"):
                picked = picked + self._picked(effect.withheld(self.raw_effort, along_motion(term)))
        return picked if picked.shape[0] > 1 or effort.ndim > 1 else picked[0]

    def _picked(self, raw: Array) -> Array:
        """A raw effort (..., M) as the filtered effort has it, at the picks."""
        filtered = judged(raw, self.sliding, self.band, self.raw_period_s, self.shift_s)
        return filtered[..., :: self.stride][..., self.picks]


def judged(raw: Array, sliding: Array, band: Band, period_s: float, shift_s: float) -> Array:
    """A raw effort (..., M) in step with the motion, where it slides, filtered."""
    in_step = lowpass(raw, _WHOLE_BAND / period_s, period_s, delay_s=shift_s)
    return band.lowpass(sliding * in_step, period_s)


@dataclass(frozen=True)
class View:
    """One axis over all its recordings; samples stand one recording after the other.

    Attributes
    ----------
    stretches : tuple of Stretch
    effort : (n,) array
        Measured, filtered.
    clear : (n,) array of bool
    block : (n,) array of int
        Number of the stretch of time, for holding out and for resampling.
    """

    stretches: tuple[Stretch, ...]
    effort: Array
    clear: NDArray[np.bool_]
    block: NDArray[np.intp]
    kept: dict[object, Array] = field(default_factory=dict, compare=False)
    """Columns that were made before."""

    @property
    def reverses(self) -> bool:
        """Whether the axis turns in any recording."""
        return any(len(s.turns) for s in self.stretches)

    @property
    def shaken(self) -> "View":
        """The same samples with the noise of the encoders once more in the motion."""
        stretches = tuple(
            replace(s, motion=s.shaken[0], others=s.shaken[1], kept={}) for s in self.stretches
        )
        return replace(self, stretches=stretches, kept={})

    @property
    def samples(self) -> int:
        """At the rate of the columns, all recordings together."""
        return sum(len(s.effort) for s in self.stretches)

    @property
    def other_axes(self) -> tuple[str, ...]:
        """Axes whose motion every recording shows as well."""
        shared = set.intersection(*(set(s.others) for s in self.stretches))
        return tuple(sorted(name for name in shared if self._moves(name)))

    @property
    def since_reversal(self) -> Array:
        """Distance travelled since the last reversal, (n,)."""
        parts = []
        for s in self.stretches:
            travelled = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(s.motion.position)))])
            starts = np.concatenate([[0], s.turns + 1])
            last = starts[np.searchsorted(starts, s.picks, side="right") - 1]
            parts.append(travelled[s.picks] - travelled[last])
        return np.concatenate(parts)

    def of_motion(self, name: str) -> Array:
        """Time, position, velocity or acceleration of the motion, (n,)."""
        return np.concatenate([getattr(s.motion, name)[s.picks] for s in self.stretches])

    def beyond_beats(self, residual: Array, inertia: float) -> NDArray[np.bool_]:
        """Samples (n,) that are not clear, and where a residual (n,) is more than what beats of the
        encoder's counts with the sampling can make of an inertia, and far more than elsewhere."""
        beat = np.concatenate([np.full(len(s.picks), s.beat) for s in self.stretches])
        elsewhere = float(np.sqrt(np.mean(residual[self.clear] ** 2)))
        most = np.maximum(inertia * beat, _STICKS_OUT * elsewhere)
        return np.asarray(~self.clear & (np.abs(residual) > most))

    def cleared(self, samples: NDArray[np.bool_]) -> "View":
        """The same with more samples (n,) clear."""
        ends = np.cumsum([len(s.picks) for s in self.stretches])[:-1]
        stretches = tuple(
            replace(s, clear=s.clear | part)
            for s, part in zip(self.stretches, np.split(samples, ends), strict=True)
        )
        return replace(self, stretches=stretches, clear=self.clear | samples, kept={})

    def excitation(self, base: Array) -> Excitation:
        """What the recordings reach, together; `base` are the base parameters (4,)."""
        position, velocity, acceleration = (
            self.of_motion(name) for name in ("position", "velocity", "acceleration")
        )
        return Excitation(
            travel=float(np.ptp(position)),
            speed=float(np.max(np.abs(velocity))),
            typical_speed=float(np.sqrt(np.mean(velocity**2))),
            acceleration=float(np.sqrt(np.mean(acceleration**2))),
            effort=max(float(np.max(np.abs(s.raw_effort))) for s in self.stretches),
            resolution=max(s.position_noise for s in self.stretches) * np.sqrt(12.0),
            duration_s=max(float(s.motion.time_s[-1]) for s in self.stretches),
            cutoff_hz=max(s.cutoff_hz for s in self.stretches),
            base=base,
        )

    def _moves(self, other: str) -> bool:
        return any(np.ptp(s.others[other].position) > 0 for s in self.stretches)

    def predicted(self, axis: AxisModel) -> Array:
        """Effort that a model expects, (n,) or (D, n)."""
        return np.concatenate([s.predicted(axis) for s in self.stretches], axis=-1)
