"""Backlash: play between the encoder's side and the load.

For the width of the gap after a reversal the drive moves only its own inertia and friction; then
it takes the load along with an inelastic impact. The load has its share of the axis's inertia
and Coulomb friction; what the base model calls inertia and Coulomb friction includes it.
Source: Nordin and Gutman, Automatica 38 (2002) 1633 (dead-zone model), with contact that does not
bounce; along a known motion the time stepping of Moreau and Jean (rigid contact).
"""

from typing import Final

import numpy as np

from edge_ident.effect import Array, Effect, Motion, Parameter, Values
from edge_ident.strengths import Draws, Scale

_CONTACT_RATE: Final = 300.0
"""Resonance in 1/s of the load on the contact, damped by half; rigid as far as a drive can tell."""


class Backlash(Effect):
    """A load that is taken along at the ends of a gap; memory: its position and speed."""

    parameters = (
        Parameter("gap", "{position}", 0.0, 1e9, "free travel between the contacts"),
        Parameter("load_inertia", "{inertia}", 1e-12, 1e9, "part of the inertia beyond the gap"),
        Parameter("load_friction", "{effort}", 0.0, 1e9, "part of the Coulomb friction beyond it"),
    )
    memory_size = 2

    def load(self, at: Motion, values: Values) -> Array:
        """Contact, which pushes and never pulls."""
        behind = at.position - at.memory[0]
        half = 0.5 * values["gap"]
        depth = behind - np.minimum(np.maximum(behind, -half), half)
        pull = _CONTACT_RATE * (depth * _CONTACT_RATE + at.velocity - at.memory[1])
        return np.where(pull * depth > 0.0, values["load_inertia"] * pull, 0.0)

    def friction(self, at: Motion, values: Values) -> Array:
        """What is left of it on the encoder's side."""
        return -values["load_friction"]

    def inertia(self, at: Motion, values: Values) -> Array:
        """What is left of it on the encoder's side."""
        return -values["load_inertia"]

    def start(self, at: Motion, values: Values) -> Array:
        """In the middle of the gap, at rest."""
        return np.array([at.position, np.zeros_like(at.position)])

    def rates(self, at: Motion, values: Values) -> Array:
        """Of the load; its friction is smoothed where it would stop within a contact's time."""
        speed = at.memory[1]
        deceleration = values["load_friction"] / values["load_inertia"]
        smoothed = np.minimum(np.maximum(_CONTACT_RATE * speed, -deceleration), deceleration)
        return np.array([speed, self.load(at, values) / values["load_inertia"] - smoothed])

    def fastest_rate(self, values: Values, inertia: Array, speed: float) -> Array:
        """Of the contact, with both sides moving."""
        return _CONTACT_RATE * (1.0 + values["load_inertia"] / inertia)

    def resistance(self, motion: Motion, values: Values) -> Array:
        """Let the load move on by its own friction, sample by sample, and keep it in the gap."""
        period_s = motion.time_s[1] - motion.time_s[0]
        half = 0.5 * values["gap"][..., 0]
        inertia, friction = values["load_inertia"][..., 0], values["load_friction"][..., 0]
        slowing = friction / inertia * period_s
        contact = values["gap"] + np.zeros_like(motion.position)
        position = motion.position[..., 0] - motion.direction[0] * half
        speed = motion.velocity[..., 0] + np.zeros_like(half)
        contact[..., 0] = inertia * motion.acceleration[..., 0] + friction * motion.direction[0]
        for k in range(1, len(motion.time_s)):
            free = speed - np.clip(speed, -slowing, slowing)
            here = motion.position[..., k]
            reached = np.minimum(np.maximum(position + free * period_s, here - half), here + half)
            speed = (reached - position) / period_s
            position = reached
            contact[..., k] = inertia * (speed - free) / period_s
        together = values["load_inertia"] * motion.acceleration
        return contact - together - values["load_friction"] * motion.direction

    def draw(self, draws: Draws, scale: Scale) -> dict[str, Array]:
        """0.02 % to 1 % of the travel; the load has 20 % to 80 % of inertia and friction."""
        return {
            "gap": draws.log_uniform(2e-4, 1e-2) * scale.travel,
            "load_inertia": draws.uniform(0.2, 0.8) * scale.inertia,
            "load_friction": draws.uniform(0.2, 0.8) * scale.coulomb_friction,
        }


EFFECT: Final = Backlash()
