"""Machines that have been used: many small departures at once, none of them a fault.

No machine in a lab is the textbook's. Every part is a little off, and each by a law of its own:
here rational functions and roots where the catalogue of `edge_ident` has exponentials, powers and
plain waves. A departure has a size that is drawn for wear 1, and grows with the wear: 0 is a clean
machine, 1 a used one, 2 a worn one. At wear 1 a rigid body with viscous and Coulomb friction leaves
1 to 5 % of the effort of the default motion (tests/plant/test_used.py).
"""

from dataclasses import dataclass, field, replace
from typing import ClassVar, Final, Self

import numpy as np

from firmware_interface.plant.drives import (
    COUNT_RAD,
    SAMPLE_S,
    Array,
    Chain,
    Drives,
    Value,
    log_uniform,
    paper,
    sign,
    sin,
)
from firmware_interface.plant.effect import Effect, Scales, State

MOST_WEAR: Final = 3.0
"""Beyond it a machine is broken, not worn."""
_COURSE: Final = 60_000  # samples of what is random in time


@dataclass(frozen=True)
class Departure(Effect):
    """Something that is a little off; an effect that no catalogue knows by name.

    `span` is the range of its size at wear 1, on its `measure`.
    """

    measure: ClassVar[str] = "of the rms effort"
    unit: ClassVar[str] = "N*m"
    in_catalogue: ClassVar[bool] = False

    def __init_subclass__(cls) -> None:
        """Stay out of the effects that can be hidden by name."""


def departures(drives: Drives, seed: int, wear: float) -> tuple[tuple[Departure, Array], ...]:
    """All that is off in a drive, each with its strength (B, A) on its measure.

    Parameters
    ----------
    drives : Drives
    seed : int
        Draws sizes, places and phases, whatever the wear.
    wear : float
        0 to `MOST_WEAR`.
    """
    rng = np.random.default_rng([seed, 31])
    scales = Scales.of(drives, paper())
    off = []
    for kind in KINDS:
        size = log_uniform(rng, *kind.span, drives.shape)
        turned = rng.choice([-1.0, 1.0], drives.shape) if kind.signed else 1.0
        strength = wear * turned * size
        off.append((kind.draw(strength, rng, scales), strength))
    return tuple(off)


def _bent(value: Value) -> Value:
    """As the value where that is small, ±1 where it is large."""
    return value / (1.0 + value * value) ** 0.5


def _now(course: Array, time_s: float) -> Value:
    """Row of a course in time; after its end it comes again."""
    return course[round(time_s / SAMPLE_S) % len(course)]


@dataclass(frozen=True)
class UnevenGuide(Departure):
    """Dry friction has three tight or loose places along the stroke, others by direction."""

    name: ClassVar[str] = "uneven_guide"
    span: ClassVar[tuple[float, float]] = (0.03, 0.1)

    place: Array  # (3, B, A), of the travel
    per_width: Array
    forward: Array
    backward: Array
    travel: Array

    @classmethod
    def draw(cls, strength: Array, rng: np.random.Generator, scales: Scales) -> Self:
        """A tenth to a half of the travel wide."""
        shape = (3, *strength.shape)
        forward = rng.uniform(-1, 1, shape)
        return cls(
            strength * scales.effort_rms,
            rng.uniform(-1, 1, shape),
            1 / rng.uniform(0.1, 0.5, shape),
            forward,
            forward + rng.uniform(-0.5, 0.5, shape),
            scales.travel,
        )

    def table_friction(self, state: State, direction: Value) -> Value:
        """Lorentz's bell at every place."""
        along, ahead = state.angle[2] / self.travel, 0.5 * (1.0 + direction)
        level = 0.0
        for n in range(3):
            height = self.backward[n] + ahead * (self.forward[n] - self.backward[n])
            level += height / (1.0 + ((along - self.place[n]) * self.per_width[n]) ** 2)
        return self.size * level


@dataclass(frozen=True)
class Slowness(Departure):
    """Dry friction that is higher at rest, and differs by direction, but only while it is slow."""

    name: ClassVar[str] = "slow_grip"
    measure: ClassVar[str] = "of the Coulomb friction, at rest"
    span: ClassVar[tuple[float, float]] = (0.04, 0.2)

    speed: Array
    by_direction: Array

    @classmethod
    def draw(cls, strength: Array, rng: np.random.Generator, scales: Scales) -> Self:
        """Half of it is gone at 2 to 10 % of the peak speed."""
        shape = strength.shape
        speed = scales.peak_speed * log_uniform(rng, 0.02, 0.1, shape)
        return cls(strength * scales.rigid[..., 2], speed, rng.uniform(-0.5, 0.5, shape))

    def table_friction(self, state: State, direction: Value) -> Value:
        """Falls as one over the square of speed."""
        level = self.size * (1.0 + self.by_direction * direction)
        return level / (1.0 + (state.velocity[2] / self.speed) ** 2)


@dataclass(frozen=True)
class BentDrag(Departure):
    """Viscous friction bends: steep at first and then flatter, or the other way round."""

    name: ClassVar[str] = "bent_drag"
    span: ClassVar[tuple[float, float]] = (0.04, 0.15)
    signed: ClassVar[bool] = True

    knee: Array
    line: Array
    by_direction: Array

    @classmethod
    def draw(cls, strength: Array, rng: np.random.Generator, scales: Scales) -> Self:
        """The knee is at 15 to 60 % of the peak speed; the line there keeps that of the drive."""
        shape = strength.shape
        knee = scales.peak_speed * rng.uniform(0.15, 0.6, shape)
        line = _bent(scales.peak_speed / knee) / scales.peak_speed
        return cls(strength * scales.effort_rms, knee, line, rng.uniform(-0.5, 0.5, shape))

    def table_friction(self, state: State, direction: Value) -> Value:
        """As a level that speed sets."""
        speed = abs(state.velocity[2])
        level = _bent(speed / self.knee) - self.line * speed
        return self.size * (1.0 + self.by_direction * direction) * level


@dataclass(frozen=True)
class Warming(Departure):
    """Friction sinks as the machine warms, and never quite ends to."""

    name: ClassVar[str] = "warming"
    measure: ClassVar[str] = "of the friction, when cold"
    unit: ClassVar[str] = "1"
    span: ClassVar[tuple[float, float]] = (0.01, 0.06)

    viscous: Array
    coulomb: Array
    half_s: Array

    @classmethod
    def draw(cls, strength: Array, rng: np.random.Generator, scales: Scales) -> Self:
        """Half of it is gone after 10 to 100 s."""
        half_s = log_uniform(rng, 10.0, 100.0, strength.shape)
        return cls(strength, scales.rigid[..., 1], scales.rigid[..., 2], half_s)

    def table_friction(self, state: State, direction: Value) -> Value:
        """One over time."""
        cold = self.size / (1.0 + max(state.time_s, 0.0) / self.half_s)
        return cold * (self.coulomb + self.viscous * abs(state.velocity[2]))


@dataclass(frozen=True)
class UnevenMesh(Departure):
    """Ripples of the motor's angle, two orders, drawn out and pressed together once a turn."""

    name: ClassVar[str] = "uneven_mesh"
    span: ClassVar[tuple[float, float]] = (0.008, 0.03)

    per_turn: Array  # (2, B, A)
    phase_rad: Array
    swing_rad: Array

    @classmethod
    def draw(cls, strength: Array, rng: np.random.Generator, scales: Scales) -> Self:
        """3 to 30 a turn, not whole numbers."""
        shape = (2, *strength.shape)
        return cls(
            strength * scales.effort_rms,
            log_uniform(rng, 3.0, 30.0, shape),
            rng.uniform(0, 2 * np.pi, shape),
            rng.uniform(0.5, 2.0, strength.shape),
        )

    def motor_torque(self, state: State) -> Value:
        """Both orders wander in phase together."""
        angle = state.angle[0]
        late = self.swing_rad * sin(angle + self.phase_rad[0])
        first = sin(self.per_turn[0] * angle + self.phase_rad[1] + late)
        return self.size * (first + 0.6 * sin(self.per_turn[1] * angle + late))


@dataclass(frozen=True)
class Cable(Departure):
    """A cable that is dragged along: a spring that stiffens to one end, and rubs within itself."""

    name: ClassVar[str] = "cable"
    span: ClassVar[tuple[float, float]] = (0.02, 0.08)
    signed: ClassVar[bool] = True

    place: Array
    travel: Array
    reach_rad: Array
    rubbing: Array
    memory: list[float] = field(default_factory=lambda: [0.0, 0.0])  # angle, and what rubs

    @classmethod
    def draw(cls, strength: Array, rng: np.random.Generator, scales: Scales) -> Self:
        """A quarter to all of it rubs, after 0.05 to 0.5 rad."""
        shape = strength.shape
        return cls(
            strength * scales.effort_rms,
            rng.uniform(-0.5, 0.5, shape),
            scales.travel,
            log_uniform(rng, 0.05, 0.5, shape),
            np.sign(strength) * rng.uniform(0.25, 1.0, shape),
        )

    def of_axis(self, drive: int, axis: int) -> Self:
        """With a memory of its own, of one axis: a batch has none."""
        return replace(super().of_axis(drive, axis), memory=[0.0, 0.0])

    def table_torque(self, state: State) -> Value:
        """Called once a step."""
        angle, (before, rubs) = state.angle[2], self.memory
        gone = angle - before
        left = max(1.0 - rubs * sign(gone), 0.0)
        rubs += gone / self.reach_rad * left**1.5
        self.memory[:] = angle, rubs
        return self.size * (_bent(2.0 * (angle / self.travel - self.place)) + self.rubbing * rubs)


@dataclass(frozen=True)
class SoftChain(Departure):
    """The screw gives way: the table on it swings at 30 to 70 Hz."""

    name: ClassVar[str] = "soft_chain"
    measure: ClassVar[str] = "of the compliance that lets the table swing at 30 Hz"
    unit: ClassVar[str] = "rad/(N*m)"
    span: ClassVar[tuple[float, float]] = (0.18, 1.0)

    @classmethod
    def draw(cls, strength: Array, rng: np.random.Generator, scales: Scales) -> Self:
        """By the table's inertia."""
        return cls(strength / ((2 * np.pi * 30.0) ** 2 * scales.drives.chain.inertia[2]))

    def chain(self, chain: Chain) -> Chain:
        """A softer second joint, its damper made for the mass that swings."""
        stiffness, damping = chain.stiffness.copy(), chain.damping_ratio.copy()
        stiffness[1] = 1 / (1 / stiffness[1] + self.size)
        screw, table = chain.inertia[1:]
        damping[1] = np.where(self.hit, damping[1] * np.sqrt(1 + table / screw), damping[1])
        return replace(chain, stiffness=stiffness, damping_ratio=damping)


@dataclass(frozen=True)
class Gap(Departure):
    """A few encoder counts of play between motor and screw."""

    name: ClassVar[str] = "gap"
    measure: ClassVar[str] = "encoder counts"
    unit: ClassVar[str] = "rad"
    span: ClassVar[tuple[float, float]] = (1.0, 4.0)

    @classmethod
    def draw(cls, strength: Array, rng: np.random.Generator, scales: Scales) -> Self:
        """Counts of the encoder."""
        return cls(strength * COUNT_RAD)

    def chain(self, chain: Chain) -> Chain:
        """A joint with a gap."""
        return replace(chain, play_rad=chain.play_rad + self.size)


@dataclass(frozen=True)
class Sag(Departure):
    """The torque constant sags with the effort: a motor near its iron's limit."""

    name: ClassVar[str] = "sag"
    measure: ClassVar[str] = "of twice the peak effort"
    unit: ClassVar[str] = "1"
    span: ClassVar[tuple[float, float]] = (0.01, 0.05)

    peak: Array

    @classmethod
    def draw(cls, strength: Array, rng: np.random.Generator, scales: Scales) -> Self:
        """Half of it is there at the peak of the rigid body."""
        return cls(2.0 * strength, scales.effort_peak)

    def applied(self, command: Value, time_s: float) -> Value:
        """The more is asked, the less of it comes."""
        square = (command / self.peak) ** 2
        return command * (1.0 - self.size * square / (1.0 + square))


@dataclass(frozen=True)
class SlowDisturbance(Departure):
    """A load that comes and goes by itself: six slow waves in time."""

    name: ClassVar[str] = "slow_disturbance"
    span: ClassVar[tuple[float, float]] = (0.005, 0.02)

    course: Array = field(repr=False)

    @classmethod
    def draw(cls, strength: Array, rng: np.random.Generator, scales: Scales) -> Self:
        """0.02 to 1 Hz; the size is the rms of all six."""
        rate = 2 * np.pi * log_uniform(rng, 0.02, 1.0, (6, *strength.shape))
        phase = rng.uniform(0, 2 * np.pi, rate.shape)
        time_s = SAMPLE_S * np.arange(_COURSE)[:, None, None]
        course = sum(np.sin(rate[n] * time_s + phase[n]) for n in range(6)) / 3**0.5
        return cls(strength * scales.effort_rms, np.asarray(course))

    def table_torque(self, state: State) -> Value:
        """Torque against the table."""
        return self.size * _now(self.course, state.time_s)


@dataclass(frozen=True)
class Grain(Departure):
    """Noise of the torque: the current's, at every sample."""

    name: ClassVar[str] = "grain"
    span: ClassVar[tuple[float, float]] = (0.002, 0.008)

    course: Array = field(repr=False)

    @classmethod
    def draw(cls, strength: Array, rng: np.random.Generator, scales: Scales) -> Self:
        """White."""
        return cls(strength * scales.effort_rms, rng.standard_normal((_COURSE, *strength.shape)))

    def applied(self, command: Value, time_s: float) -> Value:
        """Torque of a command."""
        return command + self.size * _now(self.course, time_s)


@dataclass(frozen=True)
class Neighbour(Departure):
    """The other axis drags at this one, by its direction."""

    name: ClassVar[str] = "neighbour"
    span: ClassVar[tuple[float, float]] = (0.001, 0.006)
    signed: ClassVar[bool] = True

    speed: Array

    @classmethod
    def draw(cls, strength: Array, rng: np.random.Generator, scales: Scales) -> Self:
        """All of it is there above a third of the peak speed."""
        return cls(strength * scales.effort_rms, 0.2 * scales.peak_speed)

    def table_torque(self, state: State) -> Value:
        """Torque against the table."""
        return self.size * _bent(state.other_velocity / self.speed)


@dataclass(frozen=True)
class Graduation(Departure):
    """The encoder's lines are not even: some of twice a turn, more on one side."""

    name: ClassVar[str] = "graduation"
    measure: ClassVar[str] = "encoder counts"
    unit: ClassVar[str] = "rad"
    span: ClassVar[tuple[float, float]] = (0.2, 1.0)

    phase_rad: Array  # (2, B, A)

    @classmethod
    def draw(cls, strength: Array, rng: np.random.Generator, scales: Scales) -> Self:
        """Counts of the encoder."""
        return cls(strength * COUNT_RAD, rng.uniform(0, 2 * np.pi, (2, *strength.shape)))

    def encoder(self, angle: Value) -> Value:
        """Angle that it shows."""
        side = 1.0 + 0.5 * sin(angle + self.phase_rad[1])
        return angle + self.size * side * sin(2.0 * angle + self.phase_rad[0])


KINDS: Final[tuple[type[Departure], ...]] = (
    UnevenGuide,
    Slowness,
    BentDrag,
    Warming,
    UnevenMesh,
    Cable,
    SoftChain,
    Gap,
    Sag,
    SlowDisturbance,
    Grain,
    Neighbour,
    Graduation,
)
