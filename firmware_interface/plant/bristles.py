"""Another simulator: two masses on a spring, with friction of bristles, and nothing else.

It shares neither the moving parts nor the integrator with `mechanism`: friction is not set-valued
but has a state of its own, and the classical Runge-Kutta scheme of fourth order steps all of it.
What holds on one simulator alone does not hold here.

The bristles bend by z: z' = v - |v|·z/bend(v), and rub with level·z/reach + damping·z'. With a bend
that falls from rest to speed this is the model of LuGre (Canudas de Wit, Olsson, Åström and
Lischinsky 1995); with a constant one, and no damping, that of Dahl (1968).
"""

import math
from dataclasses import dataclass
from typing import Final, Literal, Self

import numpy as np

from firmware_interface.plant.drives import SAMPLE_S, Array, Chain, Drives, exp, log_uniform
from firmware_interface.plant.plant import DELAY, Plant

BristleFriction = Literal["lugre", "dahl"]
CHAIN_HZ: Final = 60.0
"""At which motor and table swing against each other."""
_DAMPING_RATIO: Final = 0.05
_STEPS_PER_SAMPLE: Final = 10
_State = tuple[float, float, float, float, float]


@dataclass(frozen=True)
class Bristles:
    """What rubs at the table of every axis, (A,) arrays.

    Attributes
    ----------
    reach_rad : array
        Bend of the bristles that bears the Coulomb friction.
    rise : array
        Static friction over Coulomb friction, less one; 0 for Dahl.
    speed_rad_s : array
        At which the rise has fallen to a third.
    damping_ratio : array
        Of the inertia on its bristles; 0 for Dahl.
    """

    reach_rad: Array
    rise: Array
    speed_rad_s: Array
    damping_ratio: Array

    @classmethod
    def drawn(cls, friction: BristleFriction, axes: int, seed: int) -> Self:
        """Reaches of 1 to 16 encoder counts, as of rolling guides."""
        rng = np.random.default_rng([seed, 32])
        whole = np.full(axes, float(friction == "lugre"))
        return cls(
            log_uniform(rng, 1e-3, 12e-3, (axes,)),
            whole * rng.uniform(0.02, 0.15, axes),
            rng.uniform(0.02, 0.1, axes),
            whole * rng.uniform(0.2, 0.6, axes),
        )


class BristlePlant(Plant):
    """A drive that stands at zero; what its chain has beside inertia and friction is left out."""

    def __init__(
        self, drive: Drives, bristles: Bristles, sample_s: float = SAMPLE_S, delay: float = DELAY
    ) -> None:
        super().__init__(drive, (), sample_s, delay)
        step_s = sample_s / _STEPS_PER_SAMPLE
        axes = range(drive.shape[1])
        self._axes = [BristleAxis(drive.chain, bristles, axis, step_s) for axis in axes]
        self._sound = False


class BristleAxis:
    """One axis; its motor takes the place of the first mass, and its table of the others."""

    def __init__(self, chain: Chain, bristles: Bristles, axis: int, step_s: float) -> None:
        inertia, viscous = chain.inertia[:, 0, axis].tolist(), chain.viscous[:, 0, axis].tolist()
        self._motor, self._table = inertia[0], sum(inertia[1:])
        self._drag = viscous[0], sum(viscous[1:])
        pair = self._motor * self._table / (self._motor + self._table)
        self._spring = (2 * np.pi * CHAIN_HZ) ** 2 * pair
        self._damper = 2 * _DAMPING_RATIO * (self._spring * pair) ** 0.5
        self._level = float(chain.coulomb[:, 0, axis].sum())
        self._offset = float(chain.offset[0, axis])
        self._reach, self._rise = float(bristles.reach_rad[axis]), float(bristles.rise[axis])
        self._speed = float(bristles.speed_rad_s[axis])
        stiffness = self._level / self._reach
        self._damping = 2 * float(bristles.damping_ratio[axis]) * (stiffness * self._table) ** 0.5
        self._step_s = step_s
        self._state: _State = (0.0, 0.0, 0.0, 0.0, 0.0)
        self.other_velocity = self.other_acceleration = self.acceleration = 0.0

    @property
    def angle(self) -> tuple[float, float, float]:
        """Of motor, table and table."""
        motor, table, *_ = self._state
        return motor, table, table

    @property
    def velocity(self) -> tuple[float, float, float]:
        """Of motor, table and table."""
        _, _, motor, table, _ = self._state
        return motor, table, table

    def at(self, time_s: float) -> None:
        """Nothing depends on time."""

    def advance(self, torque: float) -> None:
        """One step under a motor torque."""
        step, begin = self._step_s, self._state
        first = self._change(begin, torque)
        second = self._change(_moved(begin, first, step / 2), torque)
        third = self._change(_moved(begin, second, step / 2), torque)
        last = self._change(_moved(begin, third, step), torque)
        mean = [
            (a + 2 * (b + c) + d) / 6 for a, b, c, d in zip(first, second, third, last, strict=True)
        ]
        self._state = _moved(begin, mean, step)

    def advance_sound(self, torque: float, steps: int) -> None:
        """As many steps."""
        for _ in range(steps):
            self.advance(torque)

    def jam(self) -> None:
        """Block the motor: so heavy that nothing moves it."""
        motor, table, _, table_speed, bend = self._state
        self._motor, self._state = math.inf, (motor, table, 0.0, table_speed, bend)

    def break_coupling(self) -> None:
        """Part motor and table."""
        self._spring = self._damper = 0.0

    def _change(self, state: _State, torque: float) -> _State:
        motor, table, motor_speed, table_speed, bend = state
        joint = self._spring * (motor - table) + self._damper * (motor_speed - table_speed)
        slow = exp(-((table_speed / self._speed) ** 2))
        most = self._reach * (1.0 + self._rise * slow)
        bending = table_speed - abs(table_speed) * bend / most
        rubbing = self._level * bend / self._reach + self._damping * slow * bending
        on_motor = torque - joint - self._drag[0] * motor_speed
        on_table = joint - rubbing - self._offset - self._drag[1] * table_speed
        return (
            motor_speed,
            table_speed,
            on_motor / self._motor,
            on_table / self._table,
            bending,
        )


def _moved(state: _State, change: "_State | list[float]", step_s: float) -> _State:
    a, b, c, d, e = change
    v, w, x, y, z = state
    return v + step_s * a, w + step_s * b, x + step_s * c, y + step_s * d, z + step_s * e
