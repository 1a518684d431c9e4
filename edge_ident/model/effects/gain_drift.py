"""Gain drift: the effort column's scale changes, and every coefficient with it.

command = torque·(1 + rate·t + curvature·t²). With a time constant τ in place of the curvature,
τ·(1 - exp(-t/τ)) takes the place of t. Examples are a magnet or an amplifier that warms. Before the
record starts, the scale is that at its start.
Source: Taylor expansion, first-order warming; NdFeB magnets lose about 0.1 % of their torque
constant per kelvin.
"""

from typing import Final

import numpy as np

from edge_ident.model.effect import Advice, Compensation, Draws, Effect, Parameter, Scale
from edge_ident.model.effects import offset_drift
from edge_ident.model.model import PARAMETERS
from edge_ident.model.motion import Array, Values
from edge_ident.model.search import Excitation, SearchSpec

_SMALLEST: Final = 0.05  # scale below which it stays, so that a long record never divides by zero


class GainDrift(Effect):
    """A factor on the whole effort, a parabola of time."""

    parameters = (
        Parameter("rate", "1/s", -10.0, 10.0, "relative growth of the effort at the start"),
        Parameter("curvature", "1/s^2", -10.0, 10.0, "half the growth of the rate", default=0.0),
        offset_drift.TIME_CONSTANT,
    )
    tied_to_time = True
    changes_base = PARAMETERS

    def command(self, torque: Array, time_s: Array, values: Values) -> Array:
        """More command for the same torque."""
        return torque * _scale(time_s, values)

    def torque(self, command: Array, time_s: Array, values: Values) -> Array:
        """Less torque for the same command."""
        return command / _scale(time_s, values)


def _grid(excitation: Excitation) -> dict[str, Array]:
    """From a straight line to what is over in a twentieth of the record."""
    return offset_drift.time_constants(excitation)


def _draw(draws: Draws, scale: Scale) -> dict[str, Array]:
    """4 % to 50 % over the record, up or down."""
    drift = draws.sign() * draws.log_uniform(0.04, 0.5) / scale.duration_s
    bend = draws.uniform(-0.5, 0.5)
    return {
        "rate": drift * (1.0 - bend),
        "curvature": drift * bend / scale.duration_s,
        "time_constant": np.full(draws.shape, 1e9),
    }


def _scale(time_s: Array, values: Values) -> Array:
    since = offset_drift.effective_time_s(time_s, values)
    return np.maximum(1.0 + (values["rate"] + values["curvature"] * since) * since, _SMALLEST)


EFFECT: Final = GainDrift(
    advice=Advice(
        in_words="the same command gives more or less force as time passes",
        part="amplifier, current sensor or motor magnets as they warm",
        action="Record once cold and once warm. Compare the current with a second instrument.",
    ),
    search=SearchSpec(
        forms=offset_drift.FORMS,
        signature="all coefficients move together",
        alternatives=("warm_up", "payload_change", "offset_drift"),
        experiment="the same motion at the beginning and at the end of a long record",
        grid=_grid,
        discrepancy=0.1,
        open_ended=("time_constant",),
        shares_friction=True,
    ),
    draw=_draw,
    compensation=Compensation(at_end=True),
)
