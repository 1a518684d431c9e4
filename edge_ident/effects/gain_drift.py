"""Gain drift: the effort column's scale changes, and every coefficient with it.

command = torque·(1 + rate·t): a magnet that warms, an amplifier that drifts. Before the record
starts the scale is that at its start.
Source: first-order expansion; NdFeB magnets lose about 0.1 % of their torque constant per kelvin.
"""

from typing import Final

import numpy as np

from edge_ident.effect import Array, Effect, Parameter, Values
from edge_ident.strengths import Draws, Scale

_SMALLEST: Final = 0.05
"""Scale below which it stays, so that a long record never divides by zero."""


class GainDrift(Effect):
    """A factor on the whole effort, linear in time."""

    parameters = (Parameter("rate", "1/s", -1.0, 1.0, "relative growth of the effort"),)

    def command(self, torque: Array, time_s: Array, values: Values) -> Array:
        """More command for the same torque."""
        return torque * _scale(time_s, values)

    def torque(self, command: Array, time_s: Array, values: Values) -> Array:
        """Less torque for the same command."""
        return command / _scale(time_s, values)

    def draw(self, draws: Draws, scale: Scale) -> dict[str, Array]:
        """4 % to 50 % over the record, up or down."""
        return {"rate": draws.sign() * draws.log_uniform(0.04, 0.5) / scale.duration_s}


def _scale(time_s: Array, values: Values) -> Array:
    return np.maximum(1.0 + values["rate"] * np.maximum(time_s, 0.0), _SMALLEST)


EFFECT: Final = GainDrift()
