"""What the motor drives: play, a soft coupling, ripple, loads that come, go or couple axes."""

from dataclasses import dataclass, replace
from typing import ClassVar, Self

import numpy as np

from firmware_interface.plant.drives import Array, Chain, Value, log_uniform, sign, sin
from firmware_interface.plant.effect import Effect, Scales, State


@dataclass(frozen=True)
class Backlash(Effect):
    """Play of `size` (rad) between motor and screw, closed by impact on the stiff joint."""

    name: ClassVar[str] = "backlash"
    measure: ClassVar[str] = "rad"
    unit: ClassVar[str] = "rad"
    number: ClassVar[int] = 4
    span: ClassVar[tuple[float, float]] = (5e-4, 0.15)

    @classmethod
    def draw(cls, strength: Array, rng: np.random.Generator, scales: Scales) -> Self:
        """Size is the strength itself, in rad."""
        return cls(strength)

    def chain(self, chain: Chain) -> Chain:
        """A joint with a gap."""
        return replace(chain, play_rad=self.size)


@dataclass(frozen=True)
class Compliance(Effect):
    """A worn coupling gives way by `size` (rad/(N·m)) more between motor and screw."""

    name: ClassVar[str] = "coupling_compliance"
    measure: ClassVar[str] = "of the compliance that lets the load swing at 4 Hz"
    unit: ClassVar[str] = "rad/(N*m)"
    number: ClassVar[int] = 14
    span: ClassVar[tuple[float, float]] = (0.005, 1.0)

    damping_ratio: Array

    @classmethod
    def draw(cls, strength: Array, rng: np.random.Generator, scales: Scales) -> Self:
        """Size so that the load against a held motor swings at 60 (faintest) to 4 Hz."""
        softest = 1 / ((2 * np.pi * 4.0) ** 2 * scales.drives.chain.inertia[1:].sum(axis=0))
        return cls(strength * softest, log_uniform(rng, 0.02, 0.1, strength.shape))

    def chain(self, chain: Chain) -> Chain:
        """A softer first joint."""
        stiffness, damping = chain.stiffness.copy(), chain.damping_ratio.copy()
        stiffness[0] = 1 / (1 / stiffness[0] + self.size)
        # the damper is made for the mass that swings on it: the whole load, not the screw alone
        load = chain.inertia[1:].sum(axis=0)
        alone = 1 / (1 / chain.inertia[0] + 1 / chain.inertia[1])
        whole = 1 / (1 / chain.inertia[0] + 1 / load)
        damping[0] = np.where(self.hit, self.damping_ratio * np.sqrt(whole / alone), damping[0])
        return replace(chain, stiffness=stiffness, damping_ratio=damping)


@dataclass(frozen=True)
class Ripple(Effect):
    """Gear mesh and cogging: sinusoids of the motor's angle, the largest of `size` (N·m)."""

    name: ClassVar[str] = "torque_ripple"
    measure: ClassVar[str] = "of the rms effort"
    unit: ClassVar[str] = "N*m"
    number: ClassVar[int] = 5
    span: ClassVar[tuple[float, float]] = (0.005, 0.4)

    per_turn: Array  # of the largest
    phase_rad: Array
    second: Array  # share of a second order, at `second_per_turn`
    second_per_turn: Array

    @classmethod
    def draw(cls, strength: Array, rng: np.random.Generator, scales: Scales) -> Self:
        """Size in shares of the effort's rms; 1.5 to 20 periods a turn, not whole numbers."""
        shape = strength.shape
        per_turn = log_uniform(rng, 1.5, 20.0, shape)
        return cls(
            strength * scales.effort_rms,
            per_turn,
            rng.uniform(0, 2 * np.pi, shape),
            rng.uniform(0, 0.6, shape),
            per_turn * rng.choice([0.5, 2.0, 3.0], shape),
        )

    def motor_torque(self, state: State) -> Value:
        """Ripple at the gearbox."""
        angle = state.angle[0]
        first = sin(self.per_turn * angle + self.phase_rad)
        return self.size * (first + self.second * sin(self.second_per_turn * angle))


@dataclass(frozen=True)
class PositionLoad(Effect):
    """Torque that depends on the table's place, `size` (N·m) at the ends of the stroke.

    A spring or a cable chain that is pulled along, or a pendulum's weight (a sine of the angle).
    """

    name: ClassVar[str] = "position_dependent_load"
    measure: ClassVar[str] = "of the rms effort, at the ends of the stroke"
    unit: ClassVar[str] = "N*m"
    number: ClassVar[int] = 7
    span: ClassVar[tuple[float, float]] = (0.02, 0.7)
    signed: ClassVar[bool] = True

    centre: Array
    travel: Array
    spring: Array  # 1: spring, 0: pendulum
    per_travel: Array  # pendulum's radians from the centre to the end of the stroke

    @classmethod
    def draw(cls, strength: Array, rng: np.random.Generator, scales: Scales) -> Self:
        """Size in shares of the effort's rms; at most half as stiff as the controller."""
        shape = strength.shape
        spring = (rng.random(shape) < 0.5).astype(float)
        radians = rng.uniform(1.5, 6.0, shape)
        steepest = 0.5 * scales.drives.control.position_gain * scales.travel
        steepest /= np.where(spring, 1.0, radians) * cls.span[1]
        size = strength * np.minimum(scales.effort_rms, steepest)
        return cls(size, scales.centre, scales.travel, spring, radians)

    def table_torque(self, state: State) -> Value:
        """Torque against the table, positive or negative."""
        along = (state.angle[2] - self.centre) / self.travel
        pendulum = sin(self.per_travel * along)
        return self.size * (self.spring * along + (1 - self.spring) * pendulum)


@dataclass(frozen=True)
class CrossCoupling(Effect):
    """The other axis's motion pulls at this one: `size` (N·m) at that motion's peak.

    Proportional to the other's acceleration, velocity or direction of motion. One way only.
    """

    name: ClassVar[str] = "cross_axis_coupling"
    measure: ClassVar[str] = "of the rms effort"
    unit: ClassVar[str] = "N*m"
    number: ClassVar[int] = 15
    span: ClassVar[tuple[float, float]] = (0.01, 0.4)
    signed: ClassVar[bool] = True
    one_way: ClassVar[bool] = True

    acceleration: Array  # per other axis's unit; one of the three is not zero
    velocity: Array
    direction: Array

    @classmethod
    def draw(cls, strength: Array, rng: np.random.Generator, scales: Scales) -> Self:
        """Size in shares of the effort's rms; coupled inertia at most half of the axis's own."""
        kind = rng.integers(0, 3, strength.shape)
        inertia = 0.5 * scales.rigid[..., 0] * scales.peak_acceleration[..., ::-1]
        most = np.where(kind == 0, inertia / cls.span[1], np.inf)
        return cls(
            strength * np.minimum(scales.effort_rms, most),
            (kind == 0) / scales.peak_acceleration[..., ::-1],
            (kind == 1) / scales.peak_speed[..., ::-1],
            (kind == 2).astype(float),
        )

    def table_torque(self, state: State) -> Value:
        """Torque against the table."""
        speed = state.other_velocity
        pull = self.acceleration * state.other_acceleration + self.velocity * speed
        return self.size * (pull + self.direction * sign(speed))


@dataclass(frozen=True)
class Payload(Effect):
    """A payload of `size` times the table's inertia, with its friction, is dropped or taken up.

    The truth has means over the recording.
    """

    name: ClassVar[str] = "payload_change"
    measure: ClassVar[str] = "of the table's inertia"
    unit: ClassVar[str] = "1"
    number: ClassVar[int] = 19
    span: ClassVar[tuple[float, float]] = (0.03, 3.0)

    inertia: Array  # of the table alone
    coulomb: Array  # friction of a payload of size 1
    changes_s: Array
    taken_up: Array  # 1: carried from then on, 0: until then

    @classmethod
    def draw(cls, strength: Array, rng: np.random.Generator, scales: Scales) -> Self:
        """Size is the strength itself; the change comes in the middle 60 % of the recording."""
        shape, table = strength.shape, scales.drives.chain
        return cls(
            strength,
            table.inertia[2],
            table.coulomb[2] * rng.uniform(0.1, 0.4, shape),
            scales.duration_s * rng.uniform(0.2, 0.8, shape),
            (rng.random(shape) < 0.5).astype(float),
        )

    def _carried(self, time_s: float) -> Value:
        return self.size * ((time_s >= self.changes_s) == self.taken_up)

    def table_inertia(self, time_s: float) -> Value:
        """Inertia of what is carried."""
        return self.inertia * self._carried(time_s)

    def table_friction(self, state: State, direction: Value) -> Value:
        """Friction under its weight."""
        return self.coulomb * self._carried(state.time_s)

    def truth(self, rigid: Array, scales: Scales) -> Array:
        """Mean inertia and Coulomb friction."""
        before = self.changes_s / scales.duration_s
        carried = self.size * np.where(self.taken_up, 1 - before, before)
        changed = rigid.copy()
        changed[..., 0] += self.inertia * carried
        changed[..., 2] += self.coulomb * carried
        return changed
