"""Nonlinear viscous friction: a power of the speed, as of churning oil, air, a thinning lubricant.

f = level·|v|^exponent·sign(v), with the speed in units of one per second, on top of the linear
viscous friction.
Source: Waiboer, Aarts and Jonker, Velocity dependence of joint friction in robotic manipulators
with gear transmissions (2005), for powers of the speed in lubricated joints.
"""

from typing import Final

import numpy as np

from edge_ident.model.effect import Advice, Compensation, Draws, Effect, Parameter, Scale
from edge_ident.model.motion import Array, Motion, Values
from edge_ident.model.search import Excitation, Form, SearchSpec


class NonlinearViscous(Effect):
    """Friction that bends with speed."""

    parameters = (
        Parameter("level", "{effort}", -1e9, 1e9, "at a speed of one per second"),
        Parameter("exponent", "1", 0.2, 4.0, "power of the speed"),
    )

    def load(self, at: Motion, values: Values) -> Array:
        """Against the motion where the level is positive."""
        power = np.abs(at.velocity) ** values["exponent"]
        return values["level"] * power * np.sign(at.velocity)

    def fastest_rate(self, values: Values, inertia: Array, speed: float) -> Array:
        """Its slope at top speed, or at a hundredth of it for powers below one."""
        exponent = values["exponent"]
        at_speed = np.where(exponent < 1.0, 0.01 * speed, speed)
        return np.abs(values["level"]) * exponent * at_speed ** (exponent - 1.0) / inertia


def _grid(excitation: Excitation) -> dict[str, Array]:
    """Away from one, where it would be viscous friction."""
    return {"exponent": np.array([0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 1.4, 1.7, 2.0, 2.3, 2.7, 3.0])}


def _draw(draws: Draws, scale: Scale) -> dict[str, Array]:
    """2 % to 30 % of the effort; powers of a half or of two, seldom negative."""
    thins = draws.sign() > 0
    exponent = np.where(thins, draws.uniform(0.3, 0.7), draws.uniform(1.7, 2.3))
    rms_power = 0.65 * scale.speed**exponent
    sign = np.where(draws.uniform(0.0, 1.0) < 0.25, -0.5, 1.0)
    return {"level": sign * draws.strength() * scale.effort / rms_power, "exponent": exponent}


EFFECT: Final = NonlinearViscous(
    advice=Advice(
        in_words="friction does not grow evenly with speed, as with oil, grease or air",
        part="lubricant, seals, and covers or fans that move air",
        action="Check kind and amount of the lubricant. Record again when the machine is warm.",
    ),
    search=SearchSpec(
        forms=(Form(("level",), ("exponent",)),),
        signature="friction bends over the whole range of speeds",
        alternatives=("stribeck_friction", "warm_up", "load_dependent_friction"),
        experiment="many speeds both ways, in no order of time: --motion multisine",
        curve=("friction", "speed"),
        grid=_grid,
        # beside Coulomb friction, ever smaller powers tend to the logarithm of the speed
        open_ended=("exponent",),
        shares_friction=True,
    ),
    draw=_draw,
    compensation=Compensation(over="speed"),
)
