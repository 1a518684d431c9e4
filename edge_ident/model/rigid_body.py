"""Terms that no catalogue lists: the base model of every axis, and a vibration from outside."""

from typing import Final

import numpy as np

from edge_ident.model.effect import CLOCK, Compensation, Effect, Parameter
from edge_ident.model.motion import Array, Motion, Values, wave
from edge_ident.model.search import Form, SearchSpec

# Rigid body and friction: the base term that every axis has.
#
# effort = inertia·a + viscous_friction·v + coulomb_friction·sign(v) + offset, the paper's reduced
# model (a reconstruction, see `edge_ident.model.model`).

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


RIGID_BODY: Final = RigidBody(search=SearchSpec(discrepancy=0.003))


# External vibration: something else shakes the machine, in time and not with the motion.
#
# f = cosine·cos(2π·frequency·t) + sine·sin(2π·frequency·t) while one recording lasts: what shakes
# the machine has another phase in the next one, and hardly the same frequency. It is not a property
# of the axis, so it is not in the catalogue. The diagnosis fits it so that no effect of the axis
# takes its place.


class ExternalVibration(Effect):
    """A sinusoid in time."""

    parameters = (
        Parameter("cosine", "{effort}", -_MANY, _MANY, "amplitude in phase with time zero"),
        Parameter("sine", "{effort}", -_MANY, _MANY, "amplitude a quarter period later"),
        Parameter("frequency", "Hz", 0.0, _MANY, "of the vibration"),
        Parameter("begin", "s", -_MANY, _MANY, "of the recording"),
        Parameter("end", "s", -_MANY, _MANY, "of the recording"),
        CLOCK,
    )
    tied_to_time = True

    def load(self, at: Motion, values: Values) -> Array:
        """A sinusoid of time."""
        angle = 2.0 * np.pi * values["frequency"] * at.time_s
        lasts = (at.time_s >= values["begin"]) & (at.time_s <= values["end"])
        here = lasts & (values["clock"] == at.clock)
        return np.asarray(wave(angle, values["cosine"], values["sine"]) * here)


EXTERNAL_VIBRATION: Final = ExternalVibration(
    search=SearchSpec(
        forms=(Form(("cosine", "sine"), ("frequency",)),),
        signature="follows the clock, whatever the motion",
        repeats=True,
    ),
    compensation=Compensation(without="it follows the clock, not the axis; find what shakes it"),
)
