"""One axis of a recording on an even grid, and the smooth motions on it."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Final, Self

import numpy as np
from numpy.typing import NDArray

from edge_ident.model.motion import Motion
from edge_ident.signals.conditioning import position_noise
from edge_ident.signals.filters import differentiate
from edge_ident.signals.recording import Recording
from edge_ident.signals.time_stamps import EvenGrid

Array = NDArray[np.float64]


_REPLICA_SEED: Final = 1


@dataclass(frozen=True)
class Sampled:
    """One axis of a recording on an even grid of M samples."""

    name: str
    time_s: Array
    period_s: float
    positions: Mapping[str, Array]
    effort: Array
    unknown: NDArray[np.bool_]
    begin_s: float
    clock: int

    @classmethod
    def of(cls, recording: Recording, name: str, clock: int) -> "Sampled":
        """Resample a recording."""
        grid = EvenGrid.of(recording.time_s)
        positions = {other: grid.resampled(each) for other, each in recording.positions.items()}
        effort = grid.resampled(recording.axes[name].effort)
        unknown = grid.unknown(recording.axes[name].effort)
        return cls(
            name, grid.time_s, grid.period_s, positions, effort, unknown, recording.begin_s, clock
        )

    @property
    def position(self) -> Array:
        """Position of the axis itself, (M,)."""
        return self.positions[self.name]

    @cached_property
    def noises(self) -> Mapping[str, float]:
        """Standard deviation of the noise of every axis's position."""
        return {other: position_noise(position) for other, position in self.positions.items()}

    def motion(self, position: Array, cutoff_hz: float, stride: int) -> Motion:
        """Smooth motion, every stride-th sample; its time goes on from the recordings before."""
        smooth = differentiate(position, cutoff_hz, self.period_s)
        position, velocity, acceleration = (signal[::stride] for signal in smooth)
        time_s = self.time_s[::stride] - self.time_s[0] + self.begin_s
        return Motion.known(time_s, position, velocity, acceleration, clock=self.clock)

    def motions(self, cutoff_hz: float, stride: int) -> tuple[dict[str, Motion], dict[str, Motion]]:
        """Motions of all axes, and the same with the encoder noise added a second time."""
        motions = {
            other: self.motion(position, cutoff_hz, stride)
            for other, position in self.positions.items()
        }
        rng = np.random.default_rng(_REPLICA_SEED)
        replicas = {
            other: self.motion(
                position + self.noises[other] * rng.standard_normal(len(position)),
                cutoff_hz,
                stride,
            )
            for other, position in self.positions.items()
        }
        return motions, replicas


# A low-pass filter that is computed at a few samples of a long record.


_TOGETHER: Final = 12
"""Wanted samples of a frame. Of more, the matrix holds many zeros; of fewer, it is narrow."""
_CACHED: Final = 65536
"""Numbers that are filtered at once, in a processor's cache."""


@dataclass(frozen=True)
class SampledFilter:
    """Weights a record of N samples, and filters it at n of them.

    The record is cut into frames. What each frame adds to the samples in it and in those before it
    is one product of matrices, the same for all frames.

    Attributes
    ----------
    weight : (N,) array
        What the record is multiplied by before.
    reach : int
        Of the impulse response to either side; the record is reflected at its ends.
    begin : int
        First sample that is needed; below zero where it is a reflected one.
    frames : int
        Into which the record is cut.
    matrix : (frame, parts, together) array
        The filter at the samples of a frame, by what this frame and those after it hold.
    places : (n,) array of int
        Of the wanted samples among those of all frames.
    """

    weight: Array
    reach: int
    begin: int
    frames: int
    matrix: Array
    places: NDArray[np.intp]

    @classmethod
    def of(cls, response: Array, sample_index: NDArray[np.intp], weight: Array) -> Self:
        """A filter by its impulse response.

        Parameters
        ----------
        response : (2·reach + 1,) array
            Symmetric; the record is reflected at its ends.
        sample_index : (n,) array of int
            Samples that are wanted, in their order; it is quick where they are evenly spaced, but
            for gaps.
        weight : (N,) array
            What the record is multiplied by before.
        """
        step = max(int(np.gcd.reduce(np.diff(sample_index))), 1)
        first = int(np.min(sample_index, initial=len(weight) - 1))
        places = (sample_index - first) // step
        frame, reach = _TOGETHER * step, len(response) // 2
        parts = -(-(len(response) + frame - step) // frame)
        stacked = np.zeros((parts * frame, _TOGETHER))
        for k, column in enumerate(stacked.T):
            column[k * step : k * step + len(response)] = response
        begin = first - reach
        needed = len(weight) + reach - begin
        frames = max(-(-needed // frame), int(np.max(places, initial=0)) // _TOGETHER + parts)
        matrix = stacked.reshape(parts, frame, -1).swapaxes(0, 1).copy()
        return cls(weight, reach, begin, frames, matrix, places)

    def __call__(self, signals: Array) -> Array:
        """Signals (..., N), weighted and filtered, at the samples (..., n)."""
        flat = signals.reshape(-1, signals.shape[-1])
        found = np.empty((len(flat), len(self.places)))
        count = max(1, _CACHED // flat.shape[1])
        for first in range(0, len(flat), count):
            found[first : first + count] = self._of_few(flat[first : first + count])
        return found.reshape(*signals.shape[:-1], -1)

    def _of_few(self, signals: Array) -> Array:
        """The same of signals (D, N) that a cache holds."""
        frame, parts, together = self.matrix.shape
        reflected, unneeded = max(-self.begin, 0), max(self.begin, 0)
        last = reflected + len(self.weight) - unneeded
        record = np.empty((len(signals), self.frames * frame))
        weighted = record[:, reflected:last]
        np.multiply(signals[:, unneeded:], self.weight[unneeded:], out=weighted)
        record[:, :reflected] = weighted[:, reflected:0:-1]
        record[:, last : last + self.reach] = weighted[:, -2 : -self.reach - 2 : -1]
        record[:, last + self.reach :] = 0.0
        added = record.reshape(-1, frame) @ self.matrix.reshape(frame, -1)
        added = added.reshape(len(signals), -1, parts, together)
        count = self.frames - parts + 1
        found = added[:, :count, 0].copy()
        for k in range(1, parts):
            found += added[:, k : k + count, k]
        return np.asarray(found.reshape(len(signals), -1)[:, self.places])
