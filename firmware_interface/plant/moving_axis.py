"""One axis in motion, in plain numbers: the scheme of `mechanism`, for one drive at a time.

A board moves its drive sample by sample, and numpy is slow for single numbers. A test holds the two
against each other, with every effect.
"""

import math
from collections.abc import Sequence
from typing import Final

from firmware_interface.plant.drives import Chain
from firmware_interface.plant.effect import Effect
from firmware_interface.plant.functions import clip, sign
from firmware_interface.plant.mechanism import ELEMENTS, overriding

REST_BEFORE_COUPLING: Final = 0.04
"""Share of an axis's inertia and friction that turns on where the coupling behind it is broken."""


class MovingAxis:
    """An axis of one drive; a `State` that effects can look at.

    Parameters
    ----------
    chain : Chain
        Of the drive, with what its effects change in it.
    axis : int
    effects : sequence of Effect
        Of this axis alone.
    step_s : float

    Attributes
    ----------
    time_s : float
    angle, velocity : tuple of three floats
        Of the masses, rad and rad/s.
    load : float
        Torque from the screw to the table, N·m.
    other_velocity, other_acceleration : float
        Of the other axis's table, to be told before every step.
    sound : bool
        Whether nothing acts on it but what every drive has.
    """

    def __init__(self, chain: Chain, axis: int, effects: Sequence[Effect], step_s: float) -> None:
        self.time_s = self.load = self.acceleration = 0.0
        self.other_velocity = self.other_acceleration = 0.0
        self.angle = self.velocity = (0.0, 0.0, 0.0)
        self._step_s = step_s
        self._inertia: list[float] = chain.inertia[:, 0, axis].tolist()
        self._viscous: list[float] = chain.viscous[:, 0, axis].tolist()
        self._coulomb: list[float] = chain.coulomb[:, 0, axis].tolist()
        self._offset = float(chain.offset[0, axis])
        self._joints: tuple[float, ...] = (
            *chain.stiffness[:, 0, axis].tolist(),
            *chain.damping[:, 0, axis].tolist(),
        )
        self._slack = float(chain.play_rad[0, axis]) / 2
        self._motor_torque = [e.motor_torque for e in overriding(effects, "motor_torque")]
        self._table_torque = [e.table_torque for e in overriding(effects, "table_torque")]
        self._friction = [e.table_friction for e in overriding(effects, "table_friction")]
        self._added_inertia = [e.table_inertia for e in overriding(effects, "table_inertia")]
        self._bristles = self._make_bristles(float(chain.bristle_reach_rad[0, axis]))
        self._set_inertia(self._inertia)
        acting = (self._motor_torque, self._table_torque, self._friction, self._bristles)
        self.sound = not (any(acting) or self._slack)

    def _make_bristles(self, reach: float) -> list[list[float]]:
        """Reach, stiffness and root of each element; none of them is stretched."""
        if not reach:
            return []
        level, self._coulomb[2] = self._coulomb[2] / ELEMENTS, 0.0
        reaches = [reach * (2 * n + 1) / ELEMENTS for n in range(ELEMENTS)]
        return [[each, level / each, self.angle[2]] for each in reaches]

    def _set_inertia(self, inertia: Sequence[float]) -> None:
        self._masses = []
        for mass, viscous, coulomb in zip(inertia, self._viscous, self._coulomb, strict=True):
            drag = self._step_s * viscous / (2 * mass)
            push = self._step_s / (mass * (1 + drag))
            self._masses.append(((1 - drag) / (1 + drag), push, push * coulomb))

    def jam(self) -> None:
        """Something blocks the motor: friction that no torque overcomes."""
        self._coulomb[0] = math.inf
        self._set_inertia(self._inertia)

    def break_coupling(self) -> None:
        """The gear's joint gives way: a rest of inertia and friction goes on with the encoder."""
        for of_masses in (self._inertia, self._viscous, self._coulomb):
            of_masses[0] = REST_BEFORE_COUPLING * sum(of_masses)
        _, nut, _, nut_damping = self._joints
        self._joints = (0.0, nut, 0.0, nut_damping)
        self._set_inertia(self._inertia)

    def at(self, time_s: float) -> None:
        """Tell the time, once per sample."""
        self.time_s = time_s
        if self._added_inertia:
            motor, screw, table = self._inertia
            table += sum(added(time_s) for added in self._added_inertia)
            self._set_inertia([motor, screw, table])

    def advance(self, torque: float) -> None:
        """One step under a motor torque."""
        half = self._step_s / 2
        v0, v1, v2 = self.velocity
        a0, a1, a2 = self.angle
        a0, a1, a2 = self.angle = a0 + half * v0, a1 + half * v1, a2 + half * v2
        force0, force1, force2 = self._forces(torque)
        (keep0, push0, hold0), (keep1, push1, hold1), (keep2, push2, hold2) = self._masses
        free0 = keep0 * v0 + push0 * force0
        free1 = keep1 * v1 + push1 * force1
        free2 = keep2 * v2 + push2 * force2
        if self._friction:
            hold2 = push2 * self._friction_level(free2)
        w0, w1, w2 = self.velocity = (
            free0 - hold0 if free0 > hold0 else free0 + hold0 if free0 < -hold0 else 0.0,
            free1 - hold1 if free1 > hold1 else free1 + hold1 if free1 < -hold1 else 0.0,
            free2 - hold2 if free2 > hold2 else free2 + hold2 if free2 < -hold2 else 0.0,
        )
        self.acceleration = (w2 - v2) / self._step_s
        self.angle = a0 + half * w0, a1 + half * w1, a2 + half * w2

    def advance_sound(self, torque: float, steps: int) -> None:
        """As many steps of a sound axis, in one loop: calls would take most of the time.

        Where a step leaves an axis standing that stood before, so do all others.
        """
        step_s, half, offset = self._step_s, self._step_s / 2, self._offset
        gear, nut, gear_damping, nut_damping = self._joints
        (keep0, push0, hold0), (keep1, push1, hold1), (keep2, push2, hold2) = self._masses
        a0, a1, a2 = self.angle
        v0, v1, v2 = self.velocity
        before, load, stood = v2, self.load, not (v0 or v1 or v2)
        for _ in range(steps):
            before = v2
            a0, a1, a2 = a0 + half * v0, a1 + half * v1, a2 + half * v2
            joint = gear * (a0 - a1) + gear_damping * (v0 - v1)
            load = nut * (a1 - a2) + nut_damping * (v1 - v2)
            v0 = keep0 * v0 + push0 * (torque - joint)
            v1 = keep1 * v1 + push1 * (joint - load)
            v2 = keep2 * v2 + push2 * (load - offset)
            v0 = v0 - hold0 if v0 > hold0 else v0 + hold0 if v0 < -hold0 else 0.0
            v1 = v1 - hold1 if v1 > hold1 else v1 + hold1 if v1 < -hold1 else 0.0
            v2 = v2 - hold2 if v2 > hold2 else v2 + hold2 if v2 < -hold2 else 0.0
            a0, a1, a2 = a0 + half * v0, a1 + half * v1, a2 + half * v2
            if stood:
                if not (v0 or v1 or v2):
                    break
                stood = False
        self.angle, self.velocity, self.load = (a0, a1, a2), (v0, v1, v2), load
        if steps:
            self.acceleration = (v2 - before) / step_s

    def _forces(self, torque: float) -> tuple[float, float, float]:
        """Torque on each mass, dry friction and that against the ground aside."""
        motor, screw, table = self.angle
        motor_speed, screw_speed, table_speed = self.velocity
        gear, nut, gear_damping, nut_damping = self._joints
        stretch, rate = motor - screw, motor_speed - screw_speed
        if self._slack:
            stretch -= clip(stretch, self._slack)
        joint = gear * stretch + gear_damping * rate
        if self._slack and joint * stretch <= 0.0:  # across play it only pushes
            joint = 0.0
        self.load = load = nut * (screw - table) + nut_damping * (screw_speed - table_speed)
        on_motor, on_table = torque - joint, load - self._offset
        for resist in self._motor_torque:
            on_motor -= resist(self)
        for resist in self._table_torque:
            on_table -= resist(self)
        if self._bristles:
            on_table -= self._bristle_torque(table)
        return on_motor, joint - load, on_table

    def _bristle_torque(self, table: float) -> float:
        """Maxwell elements: each a spring whose root slips at its reach."""
        torque = 0.0
        for element in self._bristles:
            reach, stiffness, root = element
            stretch = min(max(table - root, -reach), reach)
            element[2] = table - stretch
            torque += stiffness * stretch
        return torque

    def _friction_level(self, free: float) -> float:
        level, direction = self._coulomb[2], sign(free)
        for added in self._friction:
            level += added(self, direction)
        return max(level, 0.0)
