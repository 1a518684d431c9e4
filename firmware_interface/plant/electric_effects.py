"""Amplifier, recorder and encoder: what was commanded is not what acted or what is shown."""

from dataclasses import dataclass, replace
from typing import ClassVar, Final, Self

import numpy as np

from firmware_interface.plant.drives import COUNT_RAD, SAMPLE_S, Array, Value, expm1, sin, tanh
from firmware_interface.plant.effect import Effect, Scales

_WINDING: Final = (0.4, 8.0)  # share of a motor's warming; the record over its time constant
_KNEE: Final = 8  # power that rounds the knee of a saturation
_READINGS: Final = (0.7, 1.3)  # ages of the two that a late recorder averages, over their mean
_TILT: Final = 0.05  # error twice a turn over that once a turn


@dataclass(frozen=True)
class GainDrift(Effect):
    """The amplifier's gain falls (or rises) to 1 − `size` (no unit) by the recording's end.

    Two parts warm, a winding soon and the iron about it late. The truth has the mean of what has to
    be commanded. Source: Boglietti et al., IEEE Trans. Industrial Electronics 56 (2009) 871, for
    thermal networks of motors.
    """

    name: ClassVar[str] = "gain_drift"
    measure: ClassVar[str] = "of the gain"
    unit: ClassVar[str] = "1"
    number: ClassVar[int] = 11
    span: ClassVar[tuple[float, float]] = (0.005, 0.4)
    signed: ClassVar[bool] = True

    bend: Array  # of the late part; 0: a straight line in time; larger: most of it early
    duration_s: float

    @classmethod
    def draw(cls, strength: Array, rng: np.random.Generator, scales: Scales) -> Self:
        """Size is the strength itself."""
        return cls(strength, rng.uniform(0.01, 4.0, strength.shape), scales.duration_s)

    def gain(self, time_s: float) -> Value:
        """Torque per commanded torque."""
        part = min(max(time_s / self.duration_s, 0.0), 1.0)
        share, rate = _WINDING
        winding = expm1(-rate * part) / expm1(-rate)
        iron = expm1(-self.bend * part) / expm1(-self.bend)
        return 1 - self.size * (share * winding + (1.0 - share) * iron)

    def applied(self, command: Value, time_s: float) -> Value:
        """Torque of a warm amplifier."""
        return command * self.gain(time_s)

    def truth(self, rigid: Array, scales: Scales) -> Array:
        """Everything over the gain, on average."""
        times = np.linspace(0, self.duration_s, 201)
        return np.asarray(rigid * np.mean([1 / self.gain(t) for t in times], axis=0)[..., None])


@dataclass(frozen=True)
class RecordDelay(Effect):
    """Effort stands in the record `size` (s) after it acted; before it, where negative.

    It is the mean of two readings, of which one is older. The faintest is 1.5 samples. Less is what
    any board does.
    """

    name: ClassVar[str] = "time_delay"
    measure: ClassVar[str] = "s"
    unit: ClassVar[str] = "s"
    number: ClassVar[int] = 13
    span: ClassVar[tuple[float, float]] = (1.5 * SAMPLE_S, 12.0 * SAMPLE_S)
    signed: ClassVar[bool] = True

    @classmethod
    def draw(cls, strength: Array, rng: np.random.Generator, scales: Scales) -> Self:
        """Size is the strength itself, in s."""
        return cls(strength)

    def beyond(self, effort_shift_s: float | Array) -> Self:
        """The same, counted from a record that is in step, on a board with this shift."""
        return replace(self, size=np.where(self.hit, self.size + effort_shift_s, 0.0))

    def recorded(self, command: Array, time_s: Array) -> Array:
        """Mean of both readings."""
        late = self.size / SAMPLE_S
        new, old = (self._reading(command, age * late) for age in _READINGS)
        return np.asarray((new + old) / 2)

    @staticmethod
    def _reading(command: Array, late: Array) -> Array:
        """Mean torque over one period, so many periods ago: exact, as it is held in between."""
        whole = np.floor(late).astype(int)
        row = np.arange(len(command))[:, None, None]
        newer = np.take_along_axis(command, np.clip(row - whole, 0, len(command) - 1), axis=0)
        older = np.take_along_axis(command, np.clip(row - whole - 1, 0, len(command) - 1), axis=0)
        return np.asarray(newer + (late - whole) * (older - newer))


@dataclass(frozen=True)
class Deadband(Effect):
    """Of every command, the first `size` (N·m) makes no torque; the band has no sharp edge."""

    name: ClassVar[str] = "actuator_deadband"
    measure: ClassVar[str] = "of the rms effort"
    unit: ClassVar[str] = "N*m"
    number: ClassVar[int] = 16
    span: ClassVar[tuple[float, float]] = (0.01, 0.5)

    @classmethod
    def draw(cls, strength: Array, rng: np.random.Generator, scales: Scales) -> Self:
        """Size in shares of the effort's rms."""
        return cls(strength * scales.effort_rms)

    def applied(self, command: Value, time_s: float) -> Value:
        """What gets through."""
        none = self.size == 0.0
        return command - self.size * tanh(command / (self.size + none))


@dataclass(frozen=True)
class Saturation(Effect):
    """Torque stops `size` (N·m) short of the peak that is commanded; the record does not.

    Iron saturates: the last of it comes slowly. The drive falls behind there, and the controller
    commands more and more.
    """

    name: ClassVar[str] = "actuator_saturation"
    measure: ClassVar[str] = "of the peak effort above the median"
    unit: ClassVar[str] = "N*m"
    number: ClassVar[int] = 17
    span: ClassVar[tuple[float, float]] = (0.05, 0.6)

    peak: Array

    @classmethod
    def draw(cls, strength: Array, rng: np.random.Generator, scales: Scales) -> Self:
        """Size in shares of what the peak has above the median: the drive must still get there."""
        control = scales.drives.control
        # one encoder count more or less shows in the command by so much
        jitter = control.velocity_gain * COUNT_RAD / (SAMPLE_S + control.filter_s)
        peak = scales.effort_peak + jitter
        return cls(strength * (peak - scales.effort_median), peak)

    @property
    def limit(self) -> Value:
        """Largest torque; infinite on a sound axis."""
        return np.where(self.hit, self.peak - self.size, np.inf)

    def applied(self, command: Value, time_s: float) -> Value:
        """What the limit leaves."""
        return command / (1.0 + abs(command / self.limit) ** _KNEE) ** (1.0 / _KNEE)


@dataclass(frozen=True)
class Eccentricity(Effect):
    """The encoder's disc runs out: the shown angle is off by `size` (rad) once per turn.

    It is a little tilted, too, which errs twice per turn.
    """

    name: ClassVar[str] = "encoder_eccentricity"
    measure: ClassVar[str] = "rad"
    unit: ClassVar[str] = "rad"
    number: ClassVar[int] = 18
    span: ClassVar[tuple[float, float]] = (5e-4, 0.1)

    phase_rad: Array

    @classmethod
    def draw(cls, strength: Array, rng: np.random.Generator, scales: Scales) -> Self:
        """Size is the strength itself, in rad."""
        return cls(strength, rng.uniform(0, 2 * np.pi, strength.shape))

    def encoder(self, angle: Value) -> Value:
        """Angle with the disc's errors."""
        tilt = _TILT * sin(2.0 * angle)
        return angle + self.size * (sin(angle + self.phase_rad) + tilt)
