"""Torques at the table that depend on nothing but time: a drift, a push, and unknown ones."""

from dataclasses import dataclass, field
from typing import ClassVar, Self

import numpy as np

from firmware_interface.plant.drives import LEAD, SAMPLE_S, Array, Value, log_uniform
from firmware_interface.plant.effect import Effect, Scales, State


@dataclass(frozen=True)
class TimedTorque(Effect):
    """`size` (N·m) times a course in time.

    Attributes
    ----------
    course : (LEAD + N + TAIL, B, A) array
        Held over each sample.
    """

    measure: ClassVar[str] = "of the rms effort"
    unit: ClassVar[str] = "N*m"
    span: ClassVar[tuple[float, float]] = (0.01, 0.5)

    course: Array = field(repr=False)

    @classmethod
    def draw(cls, strength: Array, rng: np.random.Generator, scales: Scales) -> Self:
        """Size in shares of the effort's rms."""
        course = cls.shape(scales.motion.clock_s[:, None, None], rng, strength.shape)
        return cls(strength * scales.effort_rms, course)

    @staticmethod
    def shape(time_s: Array, rng: np.random.Generator, shape: tuple[int, ...]) -> Array:
        """Course of unit size over the times (T, 1, 1)."""
        raise NotImplementedError

    def table_torque(self, state: State) -> Value:
        """Torque against the table."""
        return self.size * self.course[self.row(state.time_s)]

    def row(self, time_s: float) -> int:
        """Row of the course; after its end it comes again from the recording's start."""
        return row_at(time_s, len(self.course))


@dataclass(frozen=True)
class OffsetDrift(TimedTorque):
    """The offset creeps by `size` from beginning to end, with the logarithm of time.

    So creep springs, seals and load cells. The truth has the mean offset.
    """

    name: ClassVar[str] = "offset_drift"
    number: ClassVar[int] = 12
    signed: ClassVar[bool] = True

    def row(self, time_s: float) -> int:
        """Row of the course; what has crept stays."""
        return min(max(LEAD + round(time_s / SAMPLE_S), 0), len(self.course) - 1)

    @staticmethod
    def shape(time_s: Array, rng: np.random.Generator, shape: tuple[int, ...]) -> Array:
        """From 0 to 1, a tenth of it in 1 to 5 % of the time."""
        early = np.exp(rng.uniform(1.0, 4.0, shape))
        part = np.clip(time_s / _end(time_s), 0, 1)
        return np.log1p(early * part) / np.log1p(early)

    def truth(self, rigid: Array, scales: Scales) -> Array:
        """Mean offset."""
        changed = rigid.copy()
        changed[..., 3] += self.size * self.course[scales.motion.recorded].mean(axis=0)
        return changed


@dataclass(frozen=True)
class Push(TimedTorque):
    """One push or collision, half a sine of `size`, of 30 to 500 ms."""

    name: ClassVar[str] = "disturbance_event"
    number: ClassVar[int] = 20
    span: ClassVar[tuple[float, float]] = (0.05, 3.0)
    signed: ClassVar[bool] = True

    @staticmethod
    def shape(time_s: Array, rng: np.random.Generator, shape: tuple[int, ...]) -> Array:
        """A pulse in the middle 80 % of the recording."""
        lasts = log_uniform(rng, 0.03, 0.5, shape)
        part = (time_s - rng.uniform(0.1, 0.9, shape) * _end(time_s)) / lasts
        return np.where((part > 0) & (part < 1), np.sin(np.pi * part), 0.0)


@dataclass(frozen=True)
class Wander(TimedTorque):
    """Unknown: a slow random walk that always comes back, of rms `size`, mean zero."""

    name: ClassVar[str] = "slow_wander"
    number: ClassVar[int] = 1
    in_catalogue: ClassVar[bool] = False

    @staticmethod
    def shape(time_s: Array, rng: np.random.Generator, shape: tuple[int, ...]) -> Array:
        """Noise through two equal lags of 0.1 to 0.5 s."""
        keep = np.exp(-SAMPLE_S / rng.uniform(0.1, 0.5, shape))
        course = rng.standard_normal((len(time_s), *shape))
        for _ in range(2):
            course = lagged(course, keep)
        course -= course[LEAD:].mean(axis=0)
        return np.asarray(course / course[LEAD:].std(axis=0))


@dataclass(frozen=True)
class Vibration(TimedTorque):
    """Unknown: another machine shakes this one, periodic in time, 0.7 to 5 Hz."""

    name: ClassVar[str] = "timed_vibration"
    number: ClassVar[int] = 2
    in_catalogue: ClassVar[bool] = False

    @staticmethod
    def shape(time_s: Array, rng: np.random.Generator, shape: tuple[int, ...]) -> Array:
        """A sinusoid in time, heard from everywhere."""
        return sinusoid(time_s, rng, 0.7, 5.0, shape)


@dataclass(frozen=True)
class RandomSteps(TimedTorque):
    """Unknown: the load jumps to a new level at random times, mean zero."""

    name: ClassVar[str] = "random_steps"
    number: ClassVar[int] = 3
    in_catalogue: ClassVar[bool] = False

    @staticmethod
    def shape(time_s: Array, rng: np.random.Generator, shape: tuple[int, ...]) -> Array:
        """Levels from −1 to 1, each held for 1 s on average."""
        jumps = rng.random((len(time_s), *shape)) < SAMPLE_S
        row = np.where(jumps, np.arange(len(time_s))[:, None, None], 0)
        levels = rng.uniform(-1, 1, (len(time_s), *shape))
        course = np.take_along_axis(levels, np.maximum.accumulate(row, axis=0), axis=0)
        return np.asarray(course - course[LEAD:].mean(axis=0))


def row_at(time_s: float, rows: int) -> int:
    """Row of a course (LEAD + N + TAIL, ...) at a time; beyond its ends it repeats N + TAIL."""
    row = round(time_s / SAMPLE_S)
    return LEAD + (row if -LEAD <= row < rows - LEAD else row % (rows - LEAD))


def sinusoid(
    time_s: Array, rng: np.random.Generator, low_hz: float, high_hz: float, shape: tuple[int, ...]
) -> Array:
    """A sinusoid in time, of a frequency and phase of every axis's own."""
    rate = 2 * np.pi * log_uniform(rng, low_hz, high_hz, shape)
    return np.sin(rate * time_s + rng.uniform(0, 2 * np.pi, shape))


def lagged(course: Array, keep: Array) -> Array:
    """A first-order lag of white noise, (T, B, A), begun as if it had gone on for ever."""
    result = np.empty_like(course)
    value = course[0] * np.sqrt((1 - keep) / (1 + keep))
    for row, given in enumerate(course):
        value = keep * value + (1 - keep) * given
        result[row] = value
    return result


def _end(time_s: Array) -> float:
    return float(time_s.max())
