"""Disturbances that no catalogue holds: orders, bumps and sweeps, within the band and above it.

What is above the band stands in the recorded effort alone: a position loop of a few hertz does not
answer a fast torque, and an encoder does not show what it moves.
"""

from dataclasses import dataclass, field
from typing import ClassVar, Self

import numpy as np

from firmware_interface.plant.drives import LEAD, SAMPLE_S, Array, Value, log_uniform, sin
from firmware_interface.plant.effect import Effect, Scales, State
from firmware_interface.plant.timed_effects import TimedTorque, lagged, row_at, sinusoid


@dataclass(frozen=True)
class Chirp(TimedTorque):
    """Unknown: a sinusoid in time whose frequency sweeps from 0.7 to 3 up to 5 Hz."""

    name: ClassVar[str] = "chirp"
    number: ClassVar[int] = 4
    in_catalogue: ClassVar[bool] = False

    @staticmethod
    def shape(time_s: Array, rng: np.random.Generator, shape: tuple[int, ...]) -> Array:
        """The phase is a parabola of time."""
        return _sweep(time_s, rng, log_uniform(rng, 0.7, 3.0, shape), 5.0)


@dataclass(frozen=True)
class Bumps(TimedTorque):
    """Unknown: bumps of either sign and random size, 50 to 300 ms long, 0.5 to 2 a second."""

    name: ClassVar[str] = "random_bumps"
    number: ClassVar[int] = 5
    in_catalogue: ClassVar[bool] = False
    span: ClassVar[tuple[float, float]] = (0.02, 1.0)

    @staticmethod
    def shape(time_s: Array, rng: np.random.Generator, shape: tuple[int, ...]) -> Array:
        """Half sines; the largest is near one."""
        course = np.zeros((len(time_s), *shape))
        clock = time_s[:, 0, 0]
        for place in np.ndindex(*shape):
            count = rng.poisson(rng.uniform(0.5, 2.0) * (clock[-1] - clock[0])) + 5
            for begins in rng.uniform(clock[0], clock[-1], count):
                part = (clock - begins) / rng.uniform(0.05, 0.3)
                bump = np.where((part > 0) & (part < 1), np.sin(np.pi * part), 0.0)
                course[(slice(None), *place)] += rng.uniform(-1.0, 1.0) * bump
        return course


@dataclass(frozen=True)
class _Order(Effect):
    """`size` (N·m) times a sinusoid of the table's angle, 2 to 12 periods a turn."""

    measure: ClassVar[str] = "of the rms effort"
    unit: ClassVar[str] = "N*m"
    in_catalogue: ClassVar[bool] = False
    span: ClassVar[tuple[float, float]] = (0.01, 0.5)

    per_turn: Array
    phase_rad: Array
    course: Array = field(repr=False)  # random, (LEAD + N + TAIL, B, A)

    @classmethod
    def draw(cls, strength: Array, rng: np.random.Generator, scales: Scales) -> Self:
        """Size in shares of the effort's rms."""
        shape = strength.shape
        return cls(
            strength * scales.effort_rms,
            log_uniform(rng, 2.0, 12.0, shape),
            rng.uniform(0, 2 * np.pi, shape),
            cls.wandering(rng.standard_normal((len(scales.motion.position), *shape))),
        )

    @staticmethod
    def wandering(noise: Array) -> Array:
        """What becomes of white noise of variance one."""
        raise NotImplementedError

    def _now(self, state: State) -> Value:
        return self.course[row_at(state.time_s, len(self.course))]

    def _turned(self, state: State) -> Value:
        return self.per_turn * state.angle[2] + self.phase_rad


@dataclass(frozen=True)
class FadingOrder(_Order):
    """Unknown: an order that comes and goes, as of a ball that is loose now and then."""

    name: ClassVar[str] = "fading_order"
    number: ClassVar[int] = 6

    @staticmethod
    def wandering(noise: Array) -> Array:
        """Amplitude of rms one, of either sign, that lasts for 0.4 s."""
        keep = np.full(noise.shape[1:], np.exp(-SAMPLE_S / 0.4))
        course = lagged(noise, keep)
        return np.asarray(course / course[LEAD:].std(axis=0))

    def table_torque(self, state: State) -> Value:
        """As large at every speed."""
        return self.size * self._now(state) * sin(self._turned(state))


@dataclass(frozen=True)
class SlippingOrder(_Order):
    """Unknown: an order whose phase wanders by 1 rad in 1 s, as of a cage of balls that slips."""

    name: ClassVar[str] = "slipping_order"
    number: ClassVar[int] = 7

    @staticmethod
    def wandering(noise: Array) -> Array:
        """Phase, rad."""
        return np.asarray(np.cumsum(noise, axis=0) * np.sqrt(SAMPLE_S))

    def table_torque(self, state: State) -> Value:
        """As large at every speed."""
        return self.size * sin(self._turned(state) + self._now(state))


@dataclass(frozen=True)
class Hum(TimedTorque):
    """Unknown: a line of 15 to 90 Hz in the measured effort, as of a fan or the mains."""

    name: ClassVar[str] = "fast_vibration"
    number: ClassVar[int] = 8
    in_catalogue: ClassVar[bool] = False

    def table_torque(self, state: State) -> Value:
        """None: it is no torque."""
        return 0.0 * self.size

    def recorded(self, command: Array, time_s: Array) -> Array:
        """Command with the line on it."""
        rows = [self.row(stamp) for stamp in time_s.tolist()]
        return np.asarray(command + self.size * self.course[rows])

    @staticmethod
    def shape(time_s: Array, rng: np.random.Generator, shape: tuple[int, ...]) -> Array:
        """A sinusoid in time."""
        return sinusoid(time_s, rng, 15.0, 90.0, shape)


@dataclass(frozen=True)
class FastChirp(Hum):
    """Unknown: a line in the measured effort that sweeps from 15 to 30 up to 90 Hz."""

    name: ClassVar[str] = "fast_chirp"
    number: ClassVar[int] = 9

    @staticmethod
    def shape(time_s: Array, rng: np.random.Generator, shape: tuple[int, ...]) -> Array:
        """The phase is a parabola of time."""
        return _sweep(time_s, rng, log_uniform(rng, 15.0, 30.0, shape), 90.0)


def _sweep(time_s: Array, rng: np.random.Generator, low_hz: Array, high_hz: float) -> Array:
    part = np.maximum(time_s, 0.0)
    rate = (high_hz - low_hz) / float(time_s.max())
    cycles = low_hz * time_s + rate * np.square(part) / 2
    return np.asarray(np.sin(2 * np.pi * cycles + rng.uniform(0, 2 * np.pi, low_hz.shape)))
