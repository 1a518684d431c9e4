"""External vibration: something else shakes the machine, in time and not with the motion.

f = cosine·cos(2π·frequency·t) + sine·sin(2π·frequency·t), t from the start of the record. It is
not a property of the axis, so it is not in the catalogue. The diagnosis fits it so that no effect
of the axis takes its place.
"""

from typing import Final

import numpy as np

from edge_ident.model.compensation import Compensation
from edge_ident.model.effect import Array, Effect, Parameter, Values
from edge_ident.model.motion import Motion
from edge_ident.model.search import Form, SearchSpec
from edge_ident.model.waves import wave

_MANY: Final = 1e9


class ExternalVibration(Effect):
    """A sinusoid in time."""

    parameters = (
        Parameter(
            "cosine", "{effort}", -_MANY, _MANY, "amplitude in phase with the record's start"
        ),
        Parameter("sine", "{effort}", -_MANY, _MANY, "amplitude a quarter period later"),
        Parameter("frequency", "Hz", 0.0, _MANY, "of the vibration"),
    )
    tied_to_time = True

    def load(self, at: Motion, values: Values) -> Array:
        """A sinusoid of time."""
        angle = 2.0 * np.pi * values["frequency"] * at.time_s
        return wave(angle, values["cosine"], values["sine"])


EXTERNAL_VIBRATION: Final = ExternalVibration(
    search=SearchSpec(
        forms=(Form(("cosine", "sine"), ("frequency",)),),
        signature="follows the clock, whatever the motion",
        repeats=True,
    ),
    compensation=Compensation(without="it follows the clock, not the axis; find what shakes it"),
)
