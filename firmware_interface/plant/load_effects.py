"""What the motor drives: play, a soft coupling, ripple, loads that come, go or couple axes."""

from dataclasses import dataclass, replace
from typing import ClassVar, Final, Self

import numpy as np
from numpy.typing import NDArray

from firmware_interface.plant.drives import Array, Chain, Value, clip, log_uniform, sign, sin, tanh
from firmware_interface.plant.effect import Effect, Scales, State

_PLACE: Final = 0.3  # of a coupling of axes, more at an end of the stroke
_GRASP_S: Final = 0.2  # in which a payload is taken up or put down
_FLANK_LOSS: Final = 1.5  # of its torque, s/rad: flanks that meet at 0.2 rad/s part at 0.16


@dataclass(frozen=True)
class Backlash(Effect):
    """Play of `size` (rad) between motor and screw, closed by impact on the stiff joint.

    The deeper the flanks touch the more they damp: see `Chain.loss_s_per_rad`.
    """

    name: ClassVar[str] = "backlash"
    measure: ClassVar[str] = "rad"
    unit: ClassVar[str] = "rad"
    number: ClassVar[int] = 4
    span: ClassVar[tuple[float, float]] = (5e-4, 0.15)

    loss: Array  # s/rad

    @classmethod
    def draw(cls, strength: Array, rng: np.random.Generator, scales: Scales) -> Self:
        """Size is the strength itself, in rad."""
        return cls(strength, np.full(strength.shape, _FLANK_LOSS))

    def chain(self, chain: Chain) -> Chain:
        """A joint with a gap."""
        return replace(_lossy(chain, self.hit, self.loss), play_rad=self.size)


@dataclass(frozen=True)
class Compliance(Effect):
    """A worn coupling gives way by `size` (rad/(N·m)) more between motor and screw.

    Its rubber damps the more the tighter it is wound up: see `Chain.loss_s_per_rad`.
    """

    name: ClassVar[str] = "coupling_compliance"
    measure: ClassVar[str] = "of the compliance that lets the load swing at 4 Hz"
    unit: ClassVar[str] = "rad/(N*m)"
    number: ClassVar[int] = 14
    span: ClassVar[tuple[float, float]] = (0.005, 1.0)

    loss: Array  # s/rad

    @classmethod
    def draw(cls, strength: Array, rng: np.random.Generator, scales: Scales) -> Self:
        """Size so that the load against a held motor swings at 60 (faintest) to 4 Hz."""
        load = scales.drives.chain.inertia[1:].sum(axis=0)
        softest = 1 / ((2 * np.pi * 4.0) ** 2 * load)
        # under the rms effort it damps as much as a damper of this ratio
        ratio = log_uniform(rng, 0.02, 0.1, strength.shape)
        with np.errstate(divide="ignore"):
            damper = 2 * ratio * np.sqrt(load / (strength * softest))
        return cls(strength * softest, damper / scales.effort_rms)

    def chain(self, chain: Chain) -> Chain:
        """A softer first joint."""
        stiffness = chain.stiffness.copy()
        stiffness[0] = 1 / (1 / stiffness[0] + self.size)
        return replace(_lossy(chain, self.hit, self.loss), stiffness=stiffness)


@dataclass(frozen=True)
class Ripple(Effect):
    """Gear mesh and cogging: sinusoids of the motor's angle, the largest of `size` (N·m).

    A wheel that runs out meshes more deeply on one side. Source: Randall, J. Mechanical Design 104
    (1982) 259.
    """

    name: ClassVar[str] = "torque_ripple"
    measure: ClassVar[str] = "of the rms effort"
    unit: ClassVar[str] = "N*m"
    number: ClassVar[int] = 5
    span: ClassVar[tuple[float, float]] = (0.005, 0.4)

    per_turn: Array  # of the largest
    phase_rad: Array
    second: Array  # share of a second order, at `second_per_turn`
    second_per_turn: Array
    runout: Array  # more of both once a turn, as a share

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
            np.full(shape, 0.15),
        )

    def motor_torque(self, state: State) -> Value:
        """Ripple at the gearbox."""
        angle = state.angle[0]
        first = sin(self.per_turn * angle + self.phase_rad)
        depth = self.size * (1.0 + self.runout * sin(angle))
        return depth * (first + self.second * sin(self.second_per_turn * angle))


@dataclass(frozen=True)
class PositionLoad(Effect):
    """Torque that depends on the table's place, `size` (N·m) at the ends of the stroke.

    A hose that is pulled along and is taut only off the centre, or the weight on a crank, whose rod
    adds to the sine of its angle.
    """

    name: ClassVar[str] = "position_dependent_load"
    measure: ClassVar[str] = "of the rms effort, at the ends of the stroke"
    unit: ClassVar[str] = "N*m"
    number: ClassVar[int] = 7
    span: ClassVar[tuple[float, float]] = (0.02, 0.7)
    signed: ClassVar[bool] = True

    centre: Array
    travel: Array
    hose: Array  # 1: hose, 0: crank
    slack: Array  # of the hose, in shares of the way to an end of the stroke; 0: a spring
    per_travel: Array  # crank's radians from the centre to the end of the stroke
    crank: Array  # over its rod

    @classmethod
    def draw(cls, strength: Array, rng: np.random.Generator, scales: Scales) -> Self:
        """Size in shares of the effort's rms; at most half as stiff as the controller."""
        shape = strength.shape
        hose = (rng.random(shape) < 0.5).astype(float)
        radians = rng.uniform(1.5, 6.0, shape)
        slack, crank = np.full(shape, 0.2), np.full(shape, 0.4)
        steepest = 0.5 * scales.drives.control.position_gain * scales.travel
        steepest /= np.where(hose, 1 / (1 - slack), radians * (1 + crank)) * cls.span[1]
        size = strength * np.minimum(scales.effort_rms, steepest)
        return cls(size, scales.centre, scales.travel, hose, slack, radians, crank)

    def table_torque(self, state: State) -> Value:
        """Torque against the table, positive or negative."""
        along = (state.angle[2] - self.centre) / self.travel
        loose = self.slack * tanh(along / (1.5 * self.slack + (self.slack == 0.0)))
        taut = (along - loose) / (1.0 - self.slack)
        sine, cosine = sin(self.per_travel * along), sin(self.per_travel * along + np.pi / 2)
        rod = (1.0 - (self.crank * sine) ** 2) ** 0.5
        lifted = sine * (1.0 + self.crank * cosine / rod)
        return self.size * (self.hose * taut + (1.0 - self.hose) * lifted)


@dataclass(frozen=True)
class CrossCoupling(Effect):
    """The other axis's motion pulls at this one: `size` (N·m) at that motion's peak.

    Proportional to the other's acceleration, velocity or direction of motion, and more at one end
    of the own stroke than at the other. One way only. Source: Teo et al., Mechatronics 17 (2007)
    361, for gantries.
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
    centre: Array
    travel: Array

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
            scales.centre,
            scales.travel,
        )

    def table_torque(self, state: State) -> Value:
        """Torque against the table."""
        speed = state.other_velocity
        pull = self.acceleration * state.other_acceleration + self.velocity * speed
        along = (state.angle[2] - self.centre) / self.travel
        return self.size * (1.0 + _PLACE * along) * (pull + self.direction * sign(speed))


@dataclass(frozen=True)
class Payload(Effect):
    """A payload of `size` times the table's inertia, with its friction, is put down or taken up.

    That takes a moment. The truth has means over the recording.
    """

    name: ClassVar[str] = "payload_change"
    measure: ClassVar[str] = "of the table's inertia"
    unit: ClassVar[str] = "1"
    number: ClassVar[int] = 19
    span: ClassVar[tuple[float, float]] = (0.03, 3.0)

    inertia: Array  # of the table alone
    coulomb: Array  # friction of a payload of size 1
    changes_s: Array  # half of it
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
        changed = 0.5 + clip((time_s - self.changes_s) / _GRASP_S, 0.5)
        return self.size * (1.0 - self.taken_up + (2.0 * self.taken_up - 1.0) * changed)

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


def _lossy(chain: Chain, hit: NDArray[np.bool_], loss: Array) -> Chain:
    """The first joint damps by its load where it is hit, and no longer by its damper."""
    damping = chain.damping_ratio.copy()
    damping[0] = np.where(hit, 0.0, damping[0])
    return replace(
        chain, damping_ratio=damping, loss_s_per_rad=np.where(hit, loss, chain.loss_s_per_rad)
    )
