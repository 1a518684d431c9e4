"""External vibration: something else shakes the machine, in time and not with the motion.

f = cosine·cos(2π·frequency·t) + sine·sin(2π·frequency·t) while one recording lasts: what shakes the
machine has another phase in the next one, and hardly the same frequency. It is not a property of
the axis, so it is not in the catalogue. The diagnosis fits it so that no effect of the axis takes
its place.
"""

from typing import Final

import numpy as np

from edge_ident.model.compensation import Compensation
from edge_ident.model.effect import CLOCK, Array, Effect, Parameter, Values
from edge_ident.model.motion import Motion
from edge_ident.model.search import Form, SearchSpec
from edge_ident.model.waves import wave

_MANY: Final = 1e9


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
