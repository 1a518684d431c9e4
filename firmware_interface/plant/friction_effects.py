"""Friction that is not viscous plus Coulomb, at the guide of the table."""

from dataclasses import dataclass, replace
from typing import ClassVar, Final, Self

import numpy as np

from firmware_interface.plant.drives import Array, Chain, Value, asinh, exp, log_uniform, sin
from firmware_interface.plant.effect import Effect, Scales, State

_BEND: Final = 0.5  # of friction by direction: of its slope at rest, a third is gone at peak speed
_PEAKED: Final = 0.3  # a tight spot is shorter than the way between two; 0: a sinusoid
_ONSET: Final = 0.5  # of the peak speed, about which oil begins to churn
_POLYMER: Final = 0.75  # power of the load with which a nut of plastic rubs: from 2/3 to 1
_THINS: Final = 2.0  # fall of a lubricant's viscosity from cold to warm, as its logarithm


@dataclass(frozen=True)
class Stribeck(Effect):
    """Dry friction is higher by `size` (N·m) at rest and falls to its level with speed.

    Source: Hess and Soom, J. Tribology 112 (1990) 147.
    """

    name: ClassVar[str] = "stribeck_friction"
    measure: ClassVar[str] = "of the Coulomb friction, at rest"
    unit: ClassVar[str] = "N*m"
    number: ClassVar[int] = 1
    span: ClassVar[tuple[float, float]] = (0.01, 1.0)

    speed: Array

    @classmethod
    def draw(cls, strength: Array, rng: np.random.Generator, scales: Scales) -> Self:
        """Size in shares of Coulomb friction, half of it gone at 3 to 30 % of the peak speed."""
        share = log_uniform(rng, 0.03, 0.3, strength.shape)
        return cls(strength * scales.rigid[..., 2], scales.peak_speed * share)

    def table_friction(self, state: State, direction: Value) -> Value:
        """Level above Coulomb friction."""
        # index 2 is the table, the last of the three masses of the chain
        return self.size / (1.0 + (state.velocity[2] / self.speed) ** 2)


@dataclass(frozen=True)
class Asymmetry(Effect):
    """Viscous friction is `size` (N·m·s/rad) more forwards, less backwards; so is Coulomb's.

    A wiper that lifts with speed: the viscous difference is steep at first, and `size` at the peak.
    """

    name: ClassVar[str] = "asymmetric_friction"
    measure: ClassVar[str] = "of the viscous friction"
    unit: ClassVar[str] = "N*m*s/rad"
    number: ClassVar[int] = 2
    span: ClassVar[tuple[float, float]] = (0.01, 0.8)
    signed: ClassVar[bool] = True

    coulomb_per_viscous: Array
    peak: Array

    @classmethod
    def draw(cls, strength: Array, rng: np.random.Generator, scales: Scales) -> Self:
        """Size in shares of viscous friction; Coulomb's by up to half of the table's."""
        viscous = scales.rigid[..., 1]
        limit = 0.5 * scales.drives.chain.coulomb[2] / viscous
        share = rng.uniform(-1, 1, strength.shape)
        return cls(strength * viscous, share * limit, scales.peak_speed)

    def table_torque(self, state: State) -> Value:
        """The viscous part."""
        speed = abs(state.velocity[2])
        return self.size * speed * (1.0 + _BEND) / (1.0 + _BEND * speed / self.peak)

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
    """Dry friction is up to `size` (N·m) higher at tight spots, and a little lower between them.

    The spots are bells, one beside the other: Poisson's kernel. The truth keeps the mean over the
    stroke.
    """

    name: ClassVar[str] = "position_dependent_friction"
    measure: ClassVar[str] = "of the table's Coulomb friction"
    unit: ClassVar[str] = "N*m"
    number: ClassVar[int] = 6
    span: ClassVar[tuple[float, float]] = (0.02, 0.9)

    waves: Array  # spots along the stroke
    centre: Array
    travel: Array

    @classmethod
    def draw(cls, strength: Array, rng: np.random.Generator, scales: Scales) -> Self:
        """Size in shares of the table's Coulomb friction; one to three spots along the stroke."""
        level = scales.drives.chain.coulomb[2]
        count = rng.integers(1, 4, strength.shape).astype(np.float64)
        waves = count * rng.choice([-1.0, 1.0], strength.shape)
        return cls(strength * level, waves, scales.centre, scales.travel)

    def table_friction(self, state: State, direction: Value) -> Value:
        """Level above its mean."""
        along = (state.angle[2] - self.centre) / self.travel
        # 0.7 rad: a spot is neither at an end of the stroke nor in its middle
        wave = sin(np.pi * self.waves * along + 0.7)
        bell = (wave - _PEAKED) / (1.0 - 2.0 * _PEAKED * wave + _PEAKED**2)
        return self.size * (1.0 - _PEAKED) * bell


@dataclass(frozen=True)
class NonlinearViscous(Effect):
    """Friction that bends with speed; `size` (N·m) at the speed `peak`.

    Grease that thins as it is sheared (Eyring, J. Chemical Physics 4 (1936) 283), or oil that
    begins to churn and then costs the square of speed.
    """

    name: ClassVar[str] = "nonlinear_viscous"
    measure: ClassVar[str] = "of the viscous torque at peak speed"
    unit: ClassVar[str] = "N*m"
    number: ClassVar[int] = 8
    span: ClassVar[tuple[float, float]] = (0.02, 1.0)

    grease: Array  # 1: grease, 0: oil
    knee: Array  # speed above which grease thins, in shares of the peak
    peak: Array

    @classmethod
    def draw(cls, strength: Array, rng: np.random.Generator, scales: Scales) -> Self:
        """Size in shares of viscous torque at peak speed; grease thins from 3 to 20 % of it on."""
        knee = rng.uniform(0.03, 0.2, strength.shape)
        grease = (rng.random(strength.shape) >= 0.5).astype(float)
        size = strength * scales.rigid[..., 1] * scales.peak_speed
        return cls(size, grease, knee, scales.peak_speed)

    def table_friction(self, state: State, direction: Value) -> Value:
        """All of it, as a level that speed sets."""
        speed = abs(state.velocity[2]) / self.peak
        thinned = asinh(speed / self.knee) / asinh(1.0 / self.knee)
        churned = speed**3 * ((1.0 + _ONSET**2) / (speed**2 + _ONSET**2)) ** 0.5
        return self.size * (self.grease * thinned + (1.0 - self.grease) * churned)


@dataclass(frozen=True)
class LoadFriction(Effect):
    """Dry friction of the nut: at the rms effort, `size` (no unit) times the torque transmitted.

    Plastic rubs with less than the first power of the load. Source: Bowden and Tabor, The Friction
    and Lubrication of Solids, part II (1964).
    """

    name: ClassVar[str] = "load_dependent_friction"
    measure: ClassVar[str] = "coefficient of friction"
    unit: ClassVar[str] = "1"
    number: ClassVar[int] = 9
    span: ClassVar[tuple[float, float]] = (0.01, 0.5)

    rms: Array

    @classmethod
    def draw(cls, strength: Array, rng: np.random.Generator, scales: Scales) -> Self:
        """Size is the strength itself, a coefficient of friction."""
        return cls(strength, scales.effort_rms)

    def table_friction(self, state: State, direction: Value) -> Value:
        """Level on top of the load's own friction."""
        return self.size * self.rms * abs(state.load / self.rms) ** _POLYMER


@dataclass(frozen=True)
class WarmUp(Effect):
    """Cold grease: viscous friction is more by `size` (N·m·s/rad) and loses it with time.

    Its temperature approaches an end, and its viscosity falls exponentially with that. The truth
    has the mean over the recording. Source: Bittencourt and Gunnarsson, J. Dynamic Systems,
    Measurement, and Control 134 (2012) 051013.
    """

    name: ClassVar[str] = "warm_up"
    measure: ClassVar[str] = "of the viscous friction"
    unit: ClassVar[str] = "N*m*s/rad"
    number: ClassVar[int] = 10
    span: ClassVar[tuple[float, float]] = (0.02, 1.5)

    warms_in_s: Array

    @classmethod
    def draw(cls, strength: Array, rng: np.random.Generator, scales: Scales) -> Self:
        """Size in shares of viscous friction; warm within 15 to 80 % of the recording."""
        share = rng.uniform(0.15, 0.8, strength.shape)
        return cls(strength * scales.rigid[..., 1], share * scales.duration_s)

    def _added(self, time_s: float) -> Value:
        warmth = 1.0 - exp(-max(time_s, 0.0) / self.warms_in_s)
        return self.size * (exp(-_THINS * warmth) - exp(-_THINS)) / (1.0 - exp(-_THINS))

    def table_torque(self, state: State) -> Value:
        """Torque of the cold grease."""
        return self._added(state.time_s) * state.velocity[2]

    def truth(self, rigid: Array, scales: Scales) -> Array:
        """Mean viscous friction."""
        times = np.linspace(0, scales.duration_s, 201)
        return _plus(rigid, 1, np.mean([self._added(t) for t in times], axis=0))


def _plus(rigid: Array, column: int, added: Array) -> Array:
    changed = rigid.copy()
    changed[..., column] += added
    return changed
