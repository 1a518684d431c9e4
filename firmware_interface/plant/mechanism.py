"""The moving parts, stepped in time: Moreau's midpoint scheme with set-valued friction.

Positions go half a step, velocities a whole one under the forces met there, positions the other
half. Viscous friction is taken at the mean velocity; dry friction at the new velocity, where it is
a soft threshold on the velocity that the mass would have without it: a mass that friction can hold
stands still exactly. Joints act explicitly (J. J. Moreau, 'Numerical aspects of the sweeping
process', 1999). Second order where motion is smooth, apart from the joints' dampers.
"""

from collections.abc import Sequence

import numpy as np

from firmware_interface.plant.drives import Array, Chain
from firmware_interface.plant.effect import Effect

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
        damping = self._damping * (self.velocity[:-1] - self.velocity[1:])
        if self._play is None:
            return self._chain.stiffness * stretch + damping
        slack = self._play
        stretch[0] -= np.minimum(np.maximum(stretch[0], -slack), slack)
        torque = self._chain.stiffness * stretch + damping
        pushes = (slack == 0) | (torque[0] * stretch[0] > 0)
        torque[0] *= pushes
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
