"""Backlash: play between the encoder's side and the load.

For the width of the gap after a reversal the drive moves only its own inertia and friction; then
it takes the load along with an inelastic impact. The load has its share of the axis's inertia,
friction and weight; what the base model calls so includes it.
Source: Nordin and Gutman, Automatica 38 (2002) 1633 (dead-zone model), with contact that does not
bounce; along a known motion the time stepping of Moreau and Jean (rigid contact).
"""

from typing import Final

import numpy as np

from edge_ident.effect import Array, Effect, Extent, Form, Motion, Parameter, Values
from edge_ident.strengths import Draws, Scale

_CONTACT_RATE: Final = 300.0
"""Resonance in 1/s of the load on the contact, damped by half; rigid as far as a drive can tell."""


class Backlash(Effect):
    """A load that is taken along at the ends of a gap; memory: its position and speed."""

    parameters = (
        Parameter("gap", "{position}", 0.0, 1e9, "free travel between the contacts"),
        Parameter("load_inertia", "{inertia}", 1e-12, 1e9, "part of the inertia beyond the gap"),
        Parameter(
            "deceleration",
            "{position}/s^2",
            0.0,
            1e9,
            "of the free load by its Coulomb friction: that over load_inertia",
        ),
        Parameter(
            "damping_rate", "1/s", 0.0, 1e6, "its viscous friction over load_inertia", default=0.0
        ),
        Parameter(
            "weight", "{position}/s^2", -1e9, 1e9, "its share of the offset over it", default=0.0
        ),
    )
    discrepancy = 0.4
    open_shapes = ("deceleration",)
    needs_reversals = True
    forms = (Form(("load_inertia",), ("gap", "deceleration", "damping_rate", "weight")),)
    signature = "a stretch of little effort and of fixed length after each reversal, then an impact"
    rivals = ("presliding_hysteresis", "coupling_compliance")
    experiment = (
        "reversals at several accelerations, some smaller than the play: --motion multisine"
    )
    memory_size = 2

    def load(self, at: Motion, values: Values) -> Array:
        """Contact, in place of the viscous friction and the weight of a load that is carried."""
        carried = values["damping_rate"] * at.velocity + values["weight"]
        return _contact(at, values) - values["load_inertia"] * carried

    def friction(self, at: Motion, values: Values) -> Array:
        """What is left of it on the encoder's side."""
        return -values["load_inertia"] * values["deceleration"]

    def inertia(self, at: Motion, values: Values) -> Array:
        """What is left of it on the encoder's side."""
        return -values["load_inertia"]

    def start(self, at: Motion, values: Values) -> Array:
        """In the middle of the gap, at rest."""
        return np.array([at.position, np.zeros_like(at.position)])

    def rates(self, at: Motion, values: Values) -> Array:
        """Of the load; its friction is smoothed where it would stop within a contact's time."""
        speed = at.memory[1]
        deceleration = values["deceleration"]
        smoothed = np.minimum(np.maximum(_CONTACT_RATE * speed, -deceleration), deceleration)
        slowing = smoothed + values["damping_rate"] * speed + values["weight"]
        return np.array([speed, _contact(at, values) / values["load_inertia"] - slowing])

    def fastest_rate(self, values: Values, inertia: Array, speed: float) -> Array:
        """Of the contact, with both sides moving."""
        return _CONTACT_RATE * (1.0 + values["load_inertia"] / inertia)

    def resistance(self, motion: Motion, values: Values) -> Array:
        """Let the load move on by itself, sample by sample, and keep it in the gap."""
        period_s = motion.time_s[1] - motion.time_s[0]
        half = 0.5 * values["gap"][..., 0]
        deceleration, weight = values["deceleration"], values["weight"]
        slowing, falling = deceleration[..., 0] * period_s, weight[..., 0] * period_s
        kept = np.exp(-values["damping_rate"][..., 0] * period_s)
        carried = deceleration * motion.direction + values["damping_rate"] * motion.velocity
        together = motion.acceleration + carried + weight
        contact = together + np.zeros_like(values["gap"])
        position = motion.position[..., 0] - motion.direction[0] * half
        speed = motion.velocity[..., 0] + np.zeros_like(half)
        for k in range(1, len(motion.time_s)):
            free = speed * kept - falling
            free = free - np.minimum(np.maximum(free, -slowing), slowing)
            here = motion.position[..., k]
            reached = np.minimum(np.maximum(position + free * period_s, here - half), here + half)
            speed = (reached - position) / period_s
            position = reached
            contact[..., k] = (speed - free) / period_s
        # mean speeds before and after a sample differ by what acted at that sample
        contact[..., 1:-1] = contact[..., 2:]
        return values["load_inertia"] * (contact - together)

    def grid(self, extent: Extent) -> dict[str, Array]:
        """Gaps from what the encoder just resolves; loads with more or less than their share of
        the axis's friction."""
        inertia, viscous, coulomb, offset = extent.base
        inertia, viscous, coulomb = (max(x, 1e-9) for x in (inertia, viscous, coulomb))
        gaps, shares = np.meshgrid(
            np.geomspace(0.5 * extent.resolution, 0.03 * extent.travel, 24),
            np.array([0.1, 0.4, 1.0, 2.5]),
        )
        return {
            "gap": gaps.ravel(),
            "deceleration": shares.ravel() * coulomb / inertia,
            "damping_rate": np.full(gaps.size, 1.5 * viscous / inertia),
            "weight": np.full(gaps.size, 2.0 * offset / inertia),
        }

    def draw(self, draws: Draws, scale: Scale) -> dict[str, Array]:
        """0.02 % to 1 % of the travel; the load has 20 % to 80 % of inertia and friction."""
        gap = draws.log_uniform(2e-4, 1e-2) * scale.travel
        load_inertia = draws.uniform(0.2, 0.8) * scale.inertia
        friction = draws.uniform(0.2, 0.8) * scale.coulomb_friction
        return {
            "gap": gap,
            "load_inertia": load_inertia,
            "deceleration": friction / load_inertia,
            "damping_rate": scale.viscous_friction / scale.inertia,
            "weight": np.zeros(draws.shape),
        }


def _contact(at: Motion, values: Values) -> Array:
    """Effort of the contact, which pushes and never pulls."""
    behind = at.position - at.memory[0]
    half = 0.5 * values["gap"]
    depth = behind - np.minimum(np.maximum(behind, -half), half)
    pull = _CONTACT_RATE * (depth * _CONTACT_RATE + at.velocity - at.memory[1])
    return np.where(pull * depth > 0.0, values["load_inertia"] * pull, 0.0)


EFFECT: Final = Backlash()
