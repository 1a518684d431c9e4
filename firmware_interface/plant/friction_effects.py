"""Friction that is not viscous plus Coulomb, at the guide of the table."""

from dataclasses import dataclass, replace
from typing import ClassVar, Self

import numpy as np

from firmware_interface.plant.drives import Array, Chain, Value, exp, log_uniform, sin
from firmware_interface.plant.effect import Effect, Scales, State


@dataclass(frozen=True)
class Stribeck(Effect):
    """Dry friction is higher by `size` (N·m) at rest and falls to its level with speed."""

    name: ClassVar[str] = "stribeck_friction"
    measure: ClassVar[str] = "of the Coulomb friction, at rest"
    unit: ClassVar[str] = "N*m"
    number: ClassVar[int] = 1
    span: ClassVar[tuple[float, float]] = (0.01, 1.0)

    speed: Array

    @classmethod
    def draw(cls, strength: Array, rng: np.random.Generator, scales: Scales) -> Self:
        """Size in shares of Coulomb friction, fallen off at 4 to 40 % of the peak speed."""
        share = log_uniform(rng, 0.04, 0.4, strength.shape)
        return cls(strength * scales.rigid[..., 2], scales.peak_speed * share)

    def table_friction(self, state: State, direction: Value) -> Value:
        """Level above Coulomb friction."""
        # index 2 is the table, the last of the three masses of the chain
        return self.size * exp(-((state.velocity[2] / self.speed) ** 2))


@dataclass(frozen=True)
class Asymmetry(Effect):
    """Viscous friction is `size` (N·m·s/rad) more forwards, less backwards; so is Coulomb's."""

    name: ClassVar[str] = "asymmetric_friction"
    measure: ClassVar[str] = "of the viscous friction"
    unit: ClassVar[str] = "N*m*s/rad"
    number: ClassVar[int] = 2
    span: ClassVar[tuple[float, float]] = (0.01, 0.8)
    signed: ClassVar[bool] = True

    coulomb_per_viscous: Array

    @classmethod
    def draw(cls, strength: Array, rng: np.random.Generator, scales: Scales) -> Self:
        """Size in shares of viscous friction; Coulomb's by up to half of the table's."""
        viscous = scales.rigid[..., 1]
        limit = 0.5 * scales.drives.chain.coulomb[2] / viscous
        return cls(strength * viscous, rng.uniform(-1, 1, strength.shape) * limit)

    def table_torque(self, state: State) -> Value:
        """The viscous part."""
        return self.size * abs(state.velocity[2])

    def table_friction(self, state: State, direction: Value) -> Value:
        """The Coulomb part."""
        # the level has the sign of the direction: times the direction it is an offset, see `truth`
        return self.size * self.coulomb_per_viscous * direction

    def truth(self, rigid: Array, scales: Scales) -> Array:
        """Coulomb friction by direction is an offset."""
        return _plus(rigid, 3, self.size * self.coulomb_per_viscous)


@dataclass(frozen=True)
class Presliding(Effect):
    """The table's Coulomb friction builds up over `size` (rad) of travel, in Maxwell bristles."""

    name: ClassVar[str] = "presliding_hysteresis"
    measure: ClassVar[str] = "rad"
    unit: ClassVar[str] = "rad"
    number: ClassVar[int] = 3
    span: ClassVar[tuple[float, float]] = (5e-4, 0.15)

    @classmethod
    def draw(cls, strength: Array, rng: np.random.Generator, scales: Scales) -> Self:
        """Size is the strength itself, in rad."""
        return cls(strength)

    def chain(self, chain: Chain) -> Chain:
        """Bristles in place of a rigid contact."""
        return replace(chain, bristle_reach_rad=self.size)


@dataclass(frozen=True)
class PositionFriction(Effect):
    """Dry friction varies by up to `size` (N·m) along the stroke: a tight spot, a worn one.

    The truth keeps the mean over the stroke.
    """

    name: ClassVar[str] = "position_dependent_friction"
    measure: ClassVar[str] = "of the table's Coulomb friction"
    unit: ClassVar[str] = "N*m"
    number: ClassVar[int] = 6
    span: ClassVar[tuple[float, float]] = (0.02, 0.9)

    waves: Array  # whole waves along the stroke
    centre: Array
    travel: Array

    @classmethod
    def draw(cls, strength: Array, rng: np.random.Generator, scales: Scales) -> Self:
        """Size in shares of the table's Coulomb friction; one to three waves along the stroke."""
        level = scales.drives.chain.coulomb[2]
        count = rng.integers(1, 4, strength.shape).astype(np.float64)
        waves = count * rng.choice([-1.0, 1.0], strength.shape)
        return cls(strength * level, waves, scales.centre, scales.travel)

    def table_friction(self, state: State, direction: Value) -> Value:
        """Level above its mean."""
        along = (state.angle[2] - self.centre) / self.travel
        # 0.7 rad: neither end of the stroke nor its middle is a node
        return self.size * sin(np.pi * self.waves * along + 0.7)


@dataclass(frozen=True)
class NonlinearViscous(Effect):
    """Friction that grows with a power of speed; `size` (N·m) at the speed `peak`."""

    name: ClassVar[str] = "nonlinear_viscous"
    measure: ClassVar[str] = "of the viscous torque at peak speed"
    unit: ClassVar[str] = "N*m"
    number: ClassVar[int] = 8
    span: ClassVar[tuple[float, float]] = (0.02, 1.0)

    power: Array
    peak: Array

    @classmethod
    def draw(cls, strength: Array, rng: np.random.Generator, scales: Scales) -> Self:
        """Size in shares of viscous torque at peak speed; v² (churning) or a root (grease)."""
        root = rng.uniform(0.3, 0.7, strength.shape)
        power = np.where(rng.random(strength.shape) < 0.5, 2.0, root)
        return cls(strength * scales.rigid[..., 1] * scales.peak_speed, power, scales.peak_speed)

    def table_friction(self, state: State, direction: Value) -> Value:
        """All of it, as a level that speed sets."""
        return self.size * (abs(state.velocity[2]) / self.peak) ** self.power


@dataclass(frozen=True)
class LoadFriction(Effect):
    """Dry friction of the nut: `size` (no unit) times the torque that it transmits."""

    name: ClassVar[str] = "load_dependent_friction"
    measure: ClassVar[str] = "coefficient of friction"
    unit: ClassVar[str] = "1"
    number: ClassVar[int] = 9
    span: ClassVar[tuple[float, float]] = (0.01, 0.5)

    @classmethod
    def draw(cls, strength: Array, rng: np.random.Generator, scales: Scales) -> Self:
        """Size is the strength itself, a coefficient of friction."""
        return cls(strength)

    def table_friction(self, state: State, direction: Value) -> Value:
        """Level on top of the load's own friction."""
        return self.size * abs(state.load)


@dataclass(frozen=True)
class WarmUp(Effect):
    """Cold grease: viscous friction is more by `size` (N·m·s/rad) and loses it with time.

    The truth has the mean over the recording.
    """

    name: ClassVar[str] = "warm_up"
    measure: ClassVar[str] = "of the viscous friction"
    unit: ClassVar[str] = "N*m*s/rad"
    number: ClassVar[int] = 10
    span: ClassVar[tuple[float, float]] = (0.02, 1.5)

    fades_in_s: Array

    @classmethod
    def draw(cls, strength: Array, rng: np.random.Generator, scales: Scales) -> Self:
        """Size in shares of viscous friction; gone within 15 to 80 % of the recording."""
        share = rng.uniform(0.15, 0.8, strength.shape)
        return cls(strength * scales.rigid[..., 1], share * scales.duration_s)

    def _added(self, time_s: float) -> Value:
        return self.size * exp(-max(time_s, 0.0) / self.fades_in_s)

    def table_torque(self, state: State) -> Value:
        """Torque of the cold grease."""
        return self._added(state.time_s) * state.velocity[2]

    def truth(self, rigid: Array, scales: Scales) -> Array:
        """Mean viscous friction."""
        # the mean of exp(-t/T) over the recording is (1 - exp(-d/T))·T/d
        whole = scales.duration_s / self.fades_in_s
        return _plus(rigid, 1, self.size * -np.expm1(-whole) / whole)


def _plus(rigid: Array, column: int, added: Array) -> Array:
    changed = rigid.copy()
    changed[..., column] += added
    return changed
