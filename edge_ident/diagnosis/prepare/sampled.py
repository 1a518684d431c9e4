"""One axis of a recording on an even grid, and the smooth motions on it."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Final

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
