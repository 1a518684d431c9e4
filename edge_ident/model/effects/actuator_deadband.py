"""Actuator deadband: commands below a threshold give no torque; those above lose the threshold.

torque = command - clip(command, -width, width). Examples are the dead time of a bridge and the
overlap of a valve. The lost effort flips with the sign of the effort, not of the velocity.
Source: Tao and Kokotović, Adaptive Control of Systems with Actuator and Sensor Nonlinearities
(1996).
"""

from typing import Final

import numpy as np

from edge_ident.model.effect import Advice, Compensation, Draws, Effect, Parameter, Scale
from edge_ident.model.motion import Array, Values
from edge_ident.model.search import Excitation, Form, Largest, SearchSpec, Yardstick


class ActuatorDeadband(Effect):
    """Effort that is commanded and never arrives."""

    parameters = (Parameter("width", "{effort}", 0.0, 1e9, "half of the band without torque"),)

    def command(self, torque: Array, time_s: Array, values: Values) -> Array:
        """The band on top of what is needed."""
        return torque + values["width"] * np.sign(torque)

    def torque(self, command: Array, time_s: Array, values: Values) -> Array:
        """What is left beyond the band."""
        return command - np.clip(command, -values["width"], values["width"])

    def withheld(self, effort: Array, values: Values) -> Array:
        """What of a command stays in the band."""
        return np.clip(effort, -values["width"], values["width"])


def _grid(excitation: Excitation) -> dict[str, Array]:
    """Up to half of the peak: wider ones leave little to move the axis."""
    return {"width": excitation.effort * np.geomspace(0.003, 0.5, 12)}


def _draw(draws: Draws, scale: Scale) -> dict[str, Array]:
    """2 % to 30 % of the effort."""
    return {"width": draws.strength() * scale.effort}


EFFECT: Final = ActuatorDeadband(
    advice=Advice(
        in_words="small commands give no force",
        size="efforts below {width} are lost",
        part="the amplifier or the valve that drives the axis",
        action="At standstill, raise the command slowly and note where force begins. Set the "
        "compensation of the dead time or of the overlap.",
    ),
    search=SearchSpec(
        forms=(Form((), ("width",)),),
        signature="flips with the sign of the effort, not of the velocity",
        alternatives=("load_dependent_friction", "asymmetric_friction", "stribeck_friction"),
        experiment="a motion that brakes hard enough for the effort to change its sign while "
        "moving: --motion multisine",
        grid=_grid,
        largest=(Largest(("width",), 1.0, Yardstick.EFFORT),),
        discrepancy=0.1,
    ),
    draw=_draw,
    compensation=Compensation(feedforward={"width": "deadband_inverse"}),
)
