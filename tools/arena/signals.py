"""A recording in halves, and the same signals of it for every contestant."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from edge_ident.baselines.problem import pose
from edge_ident.signals.conditioning import decimated
from edge_ident.signals.filters import differentiate
from edge_ident.signals.recording import Recording
from tools.real_machines.pairs import halves

Array = NDArray[np.float64]

RUN_IN: Final = 10
"""Samples at the start that are not scored: models with lags begin there."""


@dataclass(frozen=True)
class Grid:
    """Signals (N,) of every recorded sample, filtered alike."""

    position: Array
    velocity: Array
    effort: Array


@dataclass(frozen=True)
class Half:
    """One axis of one half, filtered and decimated.

    Attributes
    ----------
    recording : Recording
    axis : str
    time_s, position, velocity, acceleration, direction, effort : (n,) arrays
        Filtered alike; the direction is the sign of the velocity.
    scored : (n,) array of bool
        Samples on which models are scored, and to which static ones are fitted.
    index : (n,) array of int
        Of the samples in the recording on its even grid.
    period_s : float
        Of that grid.
    cutoff_hz : float
        Of the filter.
    """

    recording: Recording
    axis: str
    time_s: Array
    position: Array
    velocity: Array
    acceleration: Array
    direction: Array
    effort: Array
    scored: NDArray[np.bool_]
    index: NDArray[np.intp]
    period_s: float
    cutoff_hz: float

    @classmethod
    def of(cls, recording: Recording, axis: str) -> "Half":
        """Filter and decimate as `edge-ident compare` does."""
        problem = pose(recording, axis)
        signals = problem.signals
        raw, period_s, cutoff_hz = problem.axis, signals.period_s, signals.cutoff_hz
        index = decimated(len(raw.position), cutoff_hz, period_s)
        acceleration, velocity, direction = signals.regressor[index, :3].T
        return cls(
            recording=recording,
            axis=axis,
            time_s=problem.time_s[index],
            position=differentiate(raw.position, cutoff_hz, period_s)[0][index],
            velocity=velocity,
            acceleration=acceleration,
            direction=direction,
            effort=signals.effort[index],
            scored=signals.moving[index] & (np.arange(len(index)) >= RUN_IN),
            index=index,
            period_s=period_s,
            cutoff_hz=cutoff_hz,
        )

    @property
    def columns(self) -> Array:
        """Position, velocity, acceleration and direction, (n, 4)."""
        return np.column_stack([self.position, self.velocity, self.acceleration, self.direction])

    @property
    def grid(self) -> Grid:
        """From the first of the samples to the last, without decimation."""
        signals = pose(self.recording, self.axis)
        raw, effort = signals.axis, signals.signals.effort
        position, velocity, _ = differentiate(raw.position, self.cutoff_hz, self.period_s)
        rows = slice(int(self.index[0]), int(self.index[-1]) + 1)
        return Grid(position[rows], velocity[rows], effort[rows])

    def left(self, predicted: Array) -> float:
        """Relative residual of a predicted effort (n,)."""
        missed = (self.effort - predicted)[self.scored]
        return float(np.linalg.norm(missed) / np.linalg.norm(self.effort[self.scored]))


Model = Callable[[Half], Array]
"""The effort (n,) that a fitted model predicts for a half."""
Fit = Callable[[Half], Model]
"""Fits a model to a half."""


def both_ways(recording: Recording, axis: str) -> Iterator[tuple[Half, Half]]:
    """The half to fit and the half to score on, twice."""
    pair = halves(recording, "recording")
    first, second = (Half.of(part, axis) for part in (pair.first, pair.second))
    yield first, second
    yield second, first
