"""Rigid body and friction: the base term that every axis has.

effort = inertia·a + viscous_friction·v + coulomb_friction·sign(v) + offset, the paper's reduced
model (a reconstruction, see `edge_ident.model.model`).
"""

from typing import Final

import numpy as np

from edge_ident.model.effect import Array, Effect, Parameter, Values
from edge_ident.model.motion import Motion
from edge_ident.model.search import SearchSpec

_MANY: Final = 1e9


class RigidBody(Effect):
    """Inertia, viscous and Coulomb friction, and a constant effort."""

    parameters = (
        Parameter("inertia", "{inertia}", 0.0, _MANY, "moved by the effort"),
        Parameter("viscous_friction", "{effort}*s/{position}", 0.0, _MANY, "per speed"),
        Parameter("coulomb_friction", "{effort}", 0.0, _MANY, "at any speed, against the motion"),
        Parameter("offset", "{effort}", -_MANY, _MANY, "weight and amplifier offset"),
    )

    def load(self, at: Motion, values: Values) -> Array:
        """Viscous friction and offset."""
        return self.load_at(at.velocity, values)

    def load_at(self, velocity: Array, values: Values) -> Array:
        """The same at a velocity, all that it depends on."""
        return values["viscous_friction"] * velocity + values["offset"]

    def friction(self, at: Motion, values: Values) -> Array:
        """Coulomb's."""
        return values["coulomb_friction"]

    def resistance(self, motion: Motion, values: Values) -> Array:
        """All of that; a zero where there is nothing, beside terms that are computed alone."""
        if not any(value.any() for value in values.values()):
            return np.zeros(())
        return super().resistance(motion, values)

    def inertia(self, at: Motion, values: Values) -> Array:
        """Inertia of everything that moves with the encoder."""
        return values["inertia"]


RIGID_BODY: Final = RigidBody(
    search=SearchSpec(discrepancy=0.003),
)
