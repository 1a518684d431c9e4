"""Actuator saturation: the drive gives no more than a limit.

torque = clip(command, -limit, limit). Where iron saturates, the last of it comes slowly: from
(1 - knee)·limit on, torque = limit - knee·limit·exp(-beyond/(knee·limit)). In a simulation the
motion falls behind, and the recorded command exceeds what the motion needs. Along a known motion
the effort stops at the limit.
Source: Tao and Kokotović, Adaptive Control of Systems with Actuator and Sensor Nonlinearities
(1996).
"""

from typing import Final

import numpy as np

from edge_ident.model.effect import Advice, Compensation, Draws, Effect, Parameter, Scale
from edge_ident.model.motion import Array, Values
from edge_ident.model.search import Excitation, Form, SearchSpec

_CORNER: Final = 1e-9  # knee of a corner
_KNEE: Final = 0.2  # of iron; from 0.1 to 0.3 one looks like the other


class ActuatorSaturation(Effect):
    """A ceiling for the effort."""

    parameters = (
        Parameter("limit", "{effort}", 1e-9, 1e9, "most that the actuator gives"),
        Parameter("knee", "1", 0.0, 1.0, "share of it that comes slowly", default=0.0),
    )

    def command(self, torque: Array, time_s: Array, values: Values) -> Array:
        """Nothing above the limit."""
        return _given(torque, values)

    def torque(self, command: Array, time_s: Array, values: Values) -> Array:
        """Nothing above the limit."""
        return _given(command, values)

    def withheld(self, effort: Array, values: Values) -> Array:
        """What was commanded above the limit."""
        return effort - _given(effort, values)


def _given(command: Array, values: Values) -> Array:
    """What the actuator gives of a command."""
    slow = np.maximum(values["knee"], _CORNER) * values["limit"]
    straight = values["limit"] - slow
    beyond = np.maximum(np.abs(command) - straight, 0.0)
    given = np.minimum(np.abs(command), straight) - slow * np.expm1(-beyond / slow)
    return np.asarray(np.copysign(given, command))


def _grid(excitation: Excitation) -> dict[str, Array]:
    """Below the peak, which a controller that winds up commands far above the limit."""
    shares = np.concatenate([np.geomspace(0.05, 0.38, 8), np.linspace(0.4, 0.98, 30)])
    return {"limit": excitation.effort * shares}


def _rounded(excitation: Excitation) -> dict[str, Array]:
    """The same limits, with a knee."""
    limits = _grid(excitation)["limit"]
    return {"limit": limits, "knee": np.full(len(limits), _KNEE)}


def _draw(draws: Draws, scale: Scale) -> dict[str, Array]:
    """The highest 2 % to 40 % of the peak effort are missing."""
    return {"limit": (1.0 - draws.log_uniform(0.02, 0.4)) * scale.peak_effort}


EFFECT: Final = ActuatorSaturation(
    advice=Advice(
        in_words="the drive reaches its limit of force",
        size="the effort ends at {limit}",
        part="motor and amplifier: their limit of current or torque",
        action="Compare that limit with the largest command. Accelerate less, or raise the limit "
        "if motor and amplifier allow it.",
    ),
    search=SearchSpec(
        forms=(Form((), ("limit",)), Form((), ("limit",), grid=_rounded)),
        signature="nothing is wrong below the limit; above it the command is not obeyed",
        alternatives=("disturbance_event", "load_dependent_friction"),
        experiment="the same motion slower, which stays below the limit",
        grid=_grid,
        discrepancy=0.1,
    ),
    draw=_draw,
    compensation=Compensation(limit="limit"),
)
