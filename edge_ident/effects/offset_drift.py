"""Offset drift: the constant effort changes with time.

f = rate·t + curvature·t² from the start of the record: an amplifier or a force sensor that warms.
Source: Taylor expansion.
"""

from typing import Final

import numpy as np

from edge_ident.effect import Array, Effect, Form, Motion, Parameter, Values
from edge_ident.strengths import Draws, Scale


class OffsetDrift(Effect):
    """A slow effort of its own, independent of the motion."""

    parameters = (
        Parameter("rate", "{effort}/s", -1e9, 1e9, "growth at the start"),
        Parameter("curvature", "{effort}/s^2", -1e9, 1e9, "half the growth of the rate"),
    )
    discrepancy = 0.1
    forms = (Form(("rate",)), Form(("rate", "curvature")))
    signature = "the mean effort moves with time, whatever the motion"
    rivals = ("position_dependent_load", "gain_drift", "payload_change")
    experiment = "the same motion several times over"

    def load(self, at: Motion, values: Values) -> Array:
        """A parabola of time."""
        since = np.maximum(at.time_s, 0.0)
        return (values["rate"] + values["curvature"] * since) * since

    def draw(self, draws: Draws, scale: Scale) -> dict[str, Array]:
        """2 % to 30 % of the effort about its mean, straight or bent."""
        drift = draws.sign() * draws.strength() * scale.effort / scale.duration_s
        bend = draws.uniform(-1.0, 1.0)
        return {
            "rate": 3.5 * drift * (1.0 - np.abs(bend)),
            "curvature": 3.4 * drift * bend / scale.duration_s,
        }


EFFECT: Final = OffsetDrift()
