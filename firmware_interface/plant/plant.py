"""One drive behind a board: a command per sample goes in, what the encoders show comes out."""

import math
from collections import deque
from collections.abc import Sequence
from typing import Final, Protocol

import numpy as np

from firmware_interface.plant.drives import SAMPLE_S, Array, Chain, Drives, Value, clip, sign
from firmware_interface.plant.effect import Effect

DELAY: Final = 0.2
"""Share of a sample after which a new command begins to act: 0.5 ms of 2.5."""
LEAD_IN_S: Final = 5.0
"""A host goes to the start of its motion, and gathers speed there, before it records."""
_REMEMBERED: Final = 64  # samples of effort from which the recorded one is made


class Axis(Protocol):
    """What moves in an axis."""

    acceleration: float
    other_velocity: float
    other_acceleration: float

    @property
    def angle(self) -> tuple[float, float, float]:
        """Of the masses, rad."""

    @property
    def velocity(self) -> tuple[float, float, float]:
        """Of the masses, rad/s."""

    def at(self, time_s: float) -> None:
        """Tell the time, once per sample."""

    def advance(self, torque: float) -> None:
        """One step under a motor torque."""

    def advance_sound(self, torque: float, steps: int) -> None:
        """As many steps of a sound axis."""

    def jam(self) -> None:
        """Block the motor where it is."""

    def break_coupling(self) -> None:
        """Part the motor from what it drives."""


class Plant:
    """A drive that stands at zero, with its effects.

    Parameters
    ----------
    drive : Drives
        One.
    effects : sequence of Effect
        Drawn for it.
    sample_s : float
        Time that passes in a sample.
    delay : float
        Share of a sample after which a new command begins to act.
    lead_in_s : float
        From the first effort to zero on the clock of the effects.
    """

    def __init__(
        self,
        drive: Drives,
        effects: Sequence[Effect] = (),
        sample_s: float = SAMPLE_S,
        delay: float = DELAY,
        lead_in_s: float = LEAD_IN_S,
    ) -> None:
        chain, axes = drive.chain, range(drive.shape[1])
        for effect in effects:
            chain = effect.chain(chain)
        own = [[e.of_axis(0, axis) for e in effects if e.hit[0, axis]] for axis in axes]
        step_s = sample_s / STEPS_PER_SAMPLE
        moving = [MovingAxis(chain, axis, own[axis], step_s) for axis in axes]
        self._axes: Sequence[Axis] = moving
        self._sound = all(axis.sound for axis in moving)
        self._encoders = [[e.encoder for e in overriding(some, "encoder")] for some in own]
        self._amplifiers = [[e.applied for e in overriding(some, "applied")] for some in own]
        self._recorders = [e.recorded for e in overriding(effects, "recorded")]
        self._commands = deque([[0.0] * len(axes)] * _REMEMBERED, _REMEMBERED)
        self._sample_s = sample_s
        self._late = round(delay * STEPS_PER_SAMPLE)
        self._torque = [0.0] * len(axes)
        self._time_s = -lead_in_s
        self._begun = False

    @property
    def output_rad(self) -> list[float]:
        """Gearbox output angle of each axis."""
        return [axis.angle[0] for axis in self._axes]

    @property
    def output_rad_s(self) -> list[float]:
        """Gearbox output speed of each axis."""
        return [axis.velocity[0] for axis in self._axes]

    @property
    def table_rad(self) -> list[float]:
        """Angle of each axis's table, which no encoder of this drive shows."""
        return [axis.angle[2] for axis in self._axes]

    @property
    def torque_nm(self) -> list[float]:
        """What the motor of each axis makes of the last command."""
        return list(self._torque)

    @property
    def shown_rad(self) -> list[float]:
        """What the encoders show, before they count it."""
        shown = self.output_rad
        for axis, encoders in enumerate(self._encoders):
            for encoder in encoders:
                shown[axis] = encoder(shown[axis])
        return shown

    def advance(self, command: Sequence[float]) -> None:
        """Let one sample pass: the command before it acts until the new one comes, N·m."""
        self._begun = self._begun or any(command)
        self._commands.append(list(command))
        acting = [self._applied(axis, float(torque)) for axis, torque in enumerate(command)]
        for moving in self._axes:
            moving.at(self._time_s)
        self._steps(self._torque, self._late)
        self._steps(acting, STEPS_PER_SAMPLE - self._late)
        self._torque = acting
        if self._begun:
            self._time_s += self._sample_s

    def lose_encoder(self, axis: int) -> None:
        """From now on the counts of an axis stand still: no more pulses come."""
        stands_rad = self.shown_rad[axis]

        def lost(angle: Value) -> Value:
            return angle * 0.0 + stands_rad

        self._encoders[axis].append(lost)

    def jam(self, axis: int) -> None:
        """Block an axis where it is."""
        self._axes[axis].jam()

    def break_coupling(self, axis: int) -> None:
        """Part an axis from what it drives."""
        self._axes[axis].break_coupling()

    def recorded_nm(self, command: Sequence[float]) -> list[float]:
        """Effort that stands in the record for a command about to be given."""
        if not self._recorders:
            return list(command)
        efforts = np.array([*self._commands, command])[:, None, :]
        stamps = self._time_s + self._sample_s * np.arange(1.0 - len(efforts), 1.0)
        for recorder in self._recorders:
            efforts = recorder(efforts, stamps)
        last: list[float] = efforts[-1, 0].tolist()
        return last

    def _applied(self, axis: int, torque: float) -> float:
        for made_of in self._amplifiers[axis]:
            torque = float(made_of(torque, self._time_s))
        return torque

    def _steps(self, torque: Sequence[float], count: int) -> None:
        if self._sound:
            for axis, given in zip(self._axes, torque, strict=True):
                axis.advance_sound(given, count)
            return
        pairs = list(zip(self._axes, reversed(self._axes), torque, strict=True))
        for _ in range(count):
            # an axis sees the other as it was before the step, whichever goes first
            for axis, other, _given in pairs:
                axis.other_velocity = other.velocity[2]
                axis.other_acceleration = other.acceleration
            for axis, _other, given in pairs:
                axis.advance(given)


# One axis in motion, in plain numbers: the scheme of `mechanism`, for one drive at a time.
#
# A board moves its drive sample by sample, and numpy is slow for single numbers. A test holds the
# two against each other, with every effect.

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
        self._loss = float(chain.loss_s_per_rad[0, axis])
        self._motor_torque = [e.motor_torque for e in overriding(effects, "motor_torque")]
        self._table_torque = [e.table_torque for e in overriding(effects, "table_torque")]
        self._friction = [e.table_friction for e in overriding(effects, "table_friction")]
        self._added_inertia = [e.table_inertia for e in overriding(effects, "table_inertia")]
        self._bristles = self._make_bristles(float(chain.bristle_reach_rad[0, axis]))
        self._set_inertia(self._inertia)
        acting = (self._motor_torque, self._table_torque, self._friction, self._bristles)
        self.sound = not (any(acting) or self._slack or self._loss)

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
        if self._loss:
            joint += gear * abs(stretch) * self._loss * rate
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


# The moving parts, stepped in time: Moreau's midpoint scheme with set-valued friction.
#
# Positions go half a step, velocities a whole one under the forces met there, positions the other
# half. Viscous friction is taken at the mean velocity; dry friction at the new velocity, where it
# is a soft threshold on the velocity that the mass would have without it: a mass that friction can
# hold stands still exactly. Joints act explicitly (J. J. Moreau, 'Numerical aspects of the sweeping
# process', 1999). Second order where motion is smooth, apart from the joints' dampers.

# Found by convergence (tests/test_plant.py): finer steps change efforts by less than the noise.
STEPS_PER_SAMPLE = 10
# Maxwell elements per bristle friction; their reaches are even from 0 to twice the mean
ELEMENTS = 8


def overriding(effects: Sequence[Effect], hook: str) -> list[Effect]:
    """Effects that act by a hook."""
    return [e for e in effects if getattr(type(e), hook) is not getattr(Effect, hook)]


class Mechanism:
    """A batch of chains in motion; a `State` that effects can look at."""

    def __init__(
        self, chain: Chain, effects: Sequence[Effect], step_s: float, angle: Array, velocity: Array
    ) -> None:
        for effect in effects:
            chain = effect.chain(chain)
        self.time_s = 0.0
        self.angle = np.repeat(angle[None], 3, axis=0)
        self.velocity = np.repeat(velocity[None], 3, axis=0)
        self.load = np.zeros_like(chain.offset)
        self.table_acceleration = np.zeros_like(chain.offset)
        self._chain, self._step_s = chain, step_s
        self._damping = chain.damping
        self._force = np.empty_like(chain.inertia)
        self._motor_torque = [e.motor_torque for e in overriding(effects, "motor_torque")]
        self._table_torque = [e.table_torque for e in overriding(effects, "table_torque")]
        self._friction = [e.table_friction for e in overriding(effects, "table_friction")]
        self._inertia = [e.table_inertia for e in overriding(effects, "table_inertia")]
        self._play = chain.play_rad / 2 if chain.play_rad.any() else None
        self._lossy = bool(chain.loss_s_per_rad.any())
        self._coulomb = chain.coulomb.copy()
        self._bristles = self._make_bristles() if chain.bristle_reach_rad.any() else None
        self._set_inertia(chain.inertia)

    def _make_bristles(self) -> tuple[Array, Array, Array]:
        """Reach, stiffness and root of each element, (elements, B, A); drawn out at the start."""
        reach = self._chain.bristle_reach_rad
        soft = reach > 0
        level = np.where(soft, self._coulomb[2], 0.0) / ELEMENTS
        self._coulomb[2][soft] = 0.0
        share = (2 * np.arange(ELEMENTS) + 1)[:, None, None] / ELEMENTS
        reach = share * np.where(soft, reach, 1.0)
        return reach, level / reach, self.angle[2] - np.sign(self.velocity[2]) * reach

    def _set_inertia(self, inertia: Array) -> None:
        drag = self._step_s * self._chain.viscous / (2 * inertia)
        self._keep = (1 - drag) / (1 + drag)
        self._push = self._step_s / (inertia * (1 + drag))
        self._hold = self._push * self._coulomb

    @property
    def other_velocity(self) -> Array:
        """Velocity of the other axis's table, (B, A)."""
        return self.velocity[2, :, ::-1]

    @property
    def other_acceleration(self) -> Array:
        """Acceleration of the other axis's table, (B, A)."""
        return self.table_acceleration[:, ::-1]

    def at(self, time_s: float) -> None:
        """Tell the time, once per sample."""
        self.time_s = time_s
        if self._inertia:
            inertia = self._chain.inertia.copy()
            for added in self._inertia:
                inertia[2] += added(time_s)
            self._set_inertia(inertia)

    def advance(self, torque: Array) -> None:
        """One step under a motor torque, (B, A)."""
        half = self._step_s / 2
        self.angle += half * self.velocity
        free = self._keep * self.velocity + self._push * self._forces(torque)
        hold = self._friction_impulse(free) if self._friction else self._hold
        free -= np.minimum(np.maximum(free, -hold), hold)
        self.table_acceleration = (free[2] - self.velocity[2]) / self._step_s
        self.velocity = free
        self.angle += half * free

    def follow(self, velocity: Array) -> Array:
        """One step in which the motor takes this velocity, (B, A): the torque that this needs.

        While the motor stands its dry friction bears any torque up to its level; it is taken as
        zero then.
        """
        half = self._step_s / 2
        self.angle += half * self.velocity
        free = self._keep * self.velocity + self._push * self._forces(np.zeros_like(velocity))
        torque = (velocity + np.sign(velocity) * self._hold[0] - free[0]) / self._push[0]
        free -= np.minimum(np.maximum(free, -self._hold), self._hold)
        free[0] = velocity
        self.velocity = free
        self.angle += half * free
        return np.asarray(torque)

    def _forces(self, torque: Array) -> Array:
        """Torque on each mass, dry friction and that against the ground aside, (3, B, A)."""
        joint = self._joints()
        self.load = joint[1]
        force = self._force
        np.subtract(torque, joint[0], out=force[0])
        np.subtract(joint[0], joint[1], out=force[1])
        np.subtract(joint[1], self._chain.offset, out=force[2])
        for resist in self._motor_torque:
            force[0] -= resist(self)
        for resist in self._table_torque:
            force[2] -= resist(self)
        if self._bristles is not None:
            force[2] -= self._bristle_torque()
        return force

    def _joints(self) -> Array:
        """Torque of each joint, (2, B, A); across play it only pushes."""
        stretch = self.angle[:-1] - self.angle[1:]
        rate = self.velocity[:-1] - self.velocity[1:]
        if self._play is not None:
            stretch[0] -= np.minimum(np.maximum(stretch[0], -self._play), self._play)
        torque = self._chain.stiffness * stretch
        more = self._damping * rate
        if self._lossy:
            more[0] += abs(torque[0]) * self._chain.loss_s_per_rad * rate[0]
        torque += more
        if self._play is not None:
            torque[0] *= (self._play == 0) | (torque[0] * stretch[0] > 0)
        return torque

    def _bristle_torque(self) -> Array:
        """Maxwell elements: each a spring whose root slips at its reach."""
        assert self._bristles is not None
        reach, stiffness, root = self._bristles
        stretch = self.angle[2] - root
        np.minimum(np.maximum(stretch, -reach), reach, out=stretch)
        np.subtract(self.angle[2], stretch, out=root)
        return np.asarray((stiffness * stretch).sum(axis=0))

    def _friction_impulse(self, free: Array) -> Array:
        hold = self._hold.copy()
        direction = np.sign(free[2])
        level = self._coulomb[2]
        for added in self._friction:
            level = level + added(self, direction)
        hold[2] = self._push[2] * np.maximum(level, 0.0)
        return hold
