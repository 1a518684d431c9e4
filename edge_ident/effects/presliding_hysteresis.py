"""Presliding hysteresis: dry friction that builds up with the distance since a reversal.

Part of the Coulomb friction, the level, acts through bristles: f = level·z, where
dz/dx = (1 - z·sign(v))/distance, whatever the speed. After a reversal z goes from one side to the
other like 1 - 2·exp(-distance travelled/distance); smaller reversals make loops inside.
Source: Dahl, AIAA Journal 14 (1976) 1675, with exponent one.
"""

from typing import Final

import numpy as np

from edge_ident.effect import Array, Effect, Extent, Form, Motion, Parameter, Values
from edge_ident.strengths import Draws, Scale


class PreslidingHysteresis(Effect):
    """Coulomb friction that needs a distance to change its sign; memory: z."""

    parameters = (
        Parameter("level", "{effort}", 0.0, 1e9, "part of the Coulomb friction that builds up"),
        Parameter("distance", "{position}", 1e-9, 1e9, "in which 63 % of it is built up"),
    )
    discrepancy = 0.15
    needs_reversals = True
    forms = (Form(("level",), ("distance",)),)
    signature = "depends on the distance since the reversal, not on speed or time"
    rivals = ("backlash", "stribeck_friction", "coupling_compliance")
    experiment = "small reversals of several sizes: --motion multisine"
    memory_size = 1

    def load(self, at: Motion, values: Values) -> Array:
        """Of the bristles."""
        return np.asarray(values["level"] * at.memory[0])

    def friction(self, at: Motion, values: Values) -> Array:
        """What the bristles take over from Coulomb friction."""
        return -values["level"]

    def rates(self, at: Motion, values: Values) -> Array:
        """Dahl's equation over time."""
        stretch = at.velocity - np.abs(at.velocity) * at.memory
        return np.asarray(stretch / values["distance"])

    def fastest_rate(self, values: Values, inertia: Array, speed: float) -> Array:
        """Bristle resonance, or saturation at top speed."""
        resonance = np.sqrt(values["level"] / (values["distance"] * inertia))
        return np.maximum(resonance, speed / values["distance"])

    def resistance(self, motion: Motion, values: Values) -> Array:
        """Dahl's equation solved exactly from each reversal to the next."""
        distance, position, direction = values["distance"], motion.position, motion.direction
        state = np.empty(np.broadcast_shapes(distance.shape, position.shape))
        turns = np.flatnonzero(np.diff(direction)) + 1
        start = np.full_like(state[..., :1], direction[0])  # fully built up
        for first, last in zip([0, *turns], [*turns, len(direction)], strict=True):
            before = max(first - 1, 0)
            travelled = np.abs(position[..., first:last] - position[..., before, None])
            towards = direction[first] if direction[first] else start
            state[..., first:last] = towards + (start - towards) * np.exp(-travelled / distance)
            start = state[..., last - 1 : last].copy()
        return values["level"] * (state - direction)

    def grid(self, extent: Extent) -> dict[str, Array]:
        """From what the encoder just resolves to a tenth of the travel."""
        return {"distance": np.geomspace(2.0 * extent.resolution, 0.1 * extent.travel, 16)}

    def draw(self, draws: Draws, scale: Scale) -> dict[str, Array]:
        """20 % to all of the Coulomb friction, within 0.02 % to 2 % of the travel."""
        return {
            "level": draws.uniform(0.2, 1.0) * scale.coulomb_friction,
            "distance": draws.log_uniform(2e-4, 2e-2) * scale.travel,
        }


EFFECT: Final = PreslidingHysteresis()
