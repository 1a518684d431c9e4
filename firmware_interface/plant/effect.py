"""What an effect may do to a drive, and the scales that its size is drawn on."""

from dataclasses import dataclass, fields, replace
from typing import ClassVar, Protocol, Self

import numpy as np
from numpy.typing import NDArray

from firmware_interface.plant.drives import Array, Chain, Drives, Motion, Value


class State(Protocol):
    """What an effect may look at while the drive moves.

    Of a batch, `angle` and `velocity` are (masses, B, A) and the others (B, A); of one axis, they
    are a tuple and numbers.
    """

    time_s: float
    angle: Value
    velocity: Value
    load: Value  # torque from the screw to the table

    @property
    def other_velocity(self) -> Value:
        """Velocity of the other axis's table."""

    @property
    def other_acceleration(self) -> Value:
        """Acceleration of the other axis's table."""


@dataclass(frozen=True)
class Scales:
    """What a drive needs for a motion: the measure of every effect; (B, A) arrays.

    They follow from the reference and the rigid body. Those of effort are of its amount; `travel`
    is half of it, about `centre`, and includes the lead-in.
    """

    drives: Drives
    motion: Motion
    rigid: Array
    effort_rms: Array
    effort_median: Array
    effort_peak: Array
    peak_speed: Array
    peak_acceleration: Array
    travel: Array
    centre: Array
    duration_s: float

    @classmethod
    def of(cls, drives: Drives, motion: Motion) -> Self:
        """Scales of drives on a motion."""
        part = motion.recorded
        velocity, acceleration = motion.velocity[part], motion.acceleration[part]
        rigid = drives.chain.rigid_body
        inertia, viscous, coulomb, offset = np.moveaxis(rigid, -1, 0)
        effort = inertia * acceleration + viscous * velocity + coulomb * np.sign(velocity) + offset
        high, low = motion.position.max(axis=0), motion.position.min(axis=0)
        whole = np.ones(drives.shape)
        return cls(
            drives,
            motion,
            rigid,
            effort_rms=np.sqrt((effort**2).mean(axis=0)),
            effort_median=np.median(abs(effort), axis=0),
            effort_peak=abs(effort).max(axis=0),
            peak_speed=abs(velocity).max(axis=0) * whole,
            peak_acceleration=abs(acceleration).max(axis=0) * whole,
            travel=(high - low) / 2 * whole,
            centre=(high + low) / 2 * whole,
            duration_s=float(motion.clock_s[part][-1]),
        )


@dataclass(frozen=True)
class Effect:
    """Something wrong with some axes of some drives.

    Attributes
    ----------
    size : (B, A) array
        Its magnitude in the unit that each effect names; 0 leaves an axis sound. May be negative
        where both signs are physical.

    Class attributes: `name`; `measure`, what a strength of 1 is; `unit`, that of `size`; `span`,
    the faintest and the strongest strength; `signed`, whether both signs are drawn; `one_way`,
    whether it can hit one axis only; `in_catalogue`, whether the library knows it too; `number`,
    its place among the others, on which the drives of a seed depend. A new effect comes last, or
    takes the next number.

    A subclass that has a name is known to `firmware_interface.plant.hiding`.
    """

    kinds: ClassVar[dict[str, type["Effect"]]] = {}
    name: ClassVar[str]
    measure: ClassVar[str]
    unit: ClassVar[str]
    number: ClassVar[int] = 1000
    in_catalogue: ClassVar[bool] = True
    span: ClassVar[tuple[float, float]]
    signed: ClassVar[bool] = False
    one_way: ClassVar[bool] = False

    size: Array

    def __init_subclass__(cls) -> None:
        super().__init_subclass__()
        if "name" in vars(cls):
            Effect.kinds[cls.name] = cls

    @classmethod
    def draw(cls, strength: Array, rng: np.random.Generator, scales: Scales) -> Self:
        """Make the effect from its strength, (B, A), relative to the drive and motion."""
        raise NotImplementedError

    def scaled(self, factor: float) -> Self:
        """The same fault, larger or smaller."""
        return replace(self, size=factor * self.size)

    def of_axis(self, drive: int, axis: int) -> Self:
        """The same for one axis, in plain numbers; it acts by the same formulas."""
        single = {
            item.name: value[..., drive, axis].tolist()
            for item in fields(self)
            if isinstance(value := getattr(self, item.name), np.ndarray)
        }
        return replace(self, **single)

    @property
    def hit(self) -> NDArray[np.bool_]:
        """Which axes have it, (B, A)."""
        return np.asarray(self.size != 0)

    # How it acts; a drive without the effect does what is written here. What returns a Value is
    # called for a batch and for one axis (`of_axis`).
    def chain(self, chain: Chain) -> Chain:
        """Change the mechanics."""
        return chain

    def motor_torque(self, state: State) -> Value:
        """Torque against the motor."""
        raise NotImplementedError

    def table_torque(self, state: State) -> Value:
        """Torque against the table."""
        raise NotImplementedError

    def table_friction(self, state: State, direction: Value) -> Value:
        """Added level of dry friction at the table; `direction` is ±1 or 0."""
        raise NotImplementedError

    def table_inertia(self, time_s: float) -> Value:
        """Added inertia of the table."""
        raise NotImplementedError

    def applied(self, command: Value, time_s: float) -> Value:
        """Torque that the motor makes of a command."""
        raise NotImplementedError

    def encoder(self, angle: Value) -> Value:
        """Angle that the encoder shows."""
        raise NotImplementedError

    def recorded(self, command: Array, time_s: Array) -> Array:
        """Effort that is recorded of the commands (T, B, A) at the stamps (T,)."""
        raise NotImplementedError

    def truth(self, rigid: Array, scales: Scales) -> Array:
        """Rigid-body parameters that a perfect base model would have, (B, A, 4)."""
        return rigid
