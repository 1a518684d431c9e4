"""Stribeck friction: dry friction that falls as a lubricant film builds up with speed.

f = level·exp(-(|v|/speed)^exponent)·sign(v), on top of Coulomb friction: the same in acceleration
and deceleration, and in both directions. It is searched for with an exponent of two and of one.
Source: Armstrong-Hélouvry, Dupont and Canudas de Wit, Automatica 30 (1994) 1083, for both: two is
Bo and Pavelescu's, one is Tustin's.
"""

from collections.abc import Mapping
from typing import Final

import numpy as np

from edge_ident.model.effect import Advice, Compensation, Draws, Effect, Parameter, Scale
from edge_ident.model.motion import Array, Motion, Values
from edge_ident.model.search import Excitation, Form, Largest, SearchSpec, Yardstick

_BOARD: Final = 2.0  # exponent of the board's law


class StribeckFriction(Effect):
    """Static friction above Coulomb friction, decaying with speed."""

    parameters = (
        Parameter("level", "{effort}", 0.0, 1e9, "static friction less Coulomb friction"),
        Parameter("speed", "{position}/s", 1e-9, 1e9, "at which 1/e of it is left"),
        Parameter("exponent", "1", 0.5, 4.0, "how steeply it falls about there", default=_BOARD),
    )

    def friction(self, at: Motion, values: Values) -> Array:
        """The bump."""
        part = np.abs(at.velocity) / values["speed"]
        return values["level"] * np.exp(-(part ** values["exponent"]))

    def fastest_rate(self, values: Values, inertia: Array, speed: float) -> Array:
        """Steepest slope of the bump, level/speed for an exponent of one, over the inertia."""
        return values["exponent"] * values["level"] / (values["speed"] * inertia)


def _grid(excitation: Excitation) -> dict[str, Array]:
    """From a hundredth of the top speed to where it would look viscous."""
    return {"speed": excitation.speed * np.geomspace(0.01, 0.6, 16)}


def _exponential(excitation: Excitation) -> dict[str, Array]:
    """The same speeds, with an exponent of one."""
    speeds = _grid(excitation)["speed"]
    return {"speed": speeds, "exponent": np.ones(len(speeds))}


def _another_curve(values: Mapping[str, float], top_speed: float) -> str:
    """The board's law has an exponent of two."""
    return "" if values["exponent"] == _BOARD else "it falls otherwise than the board's curve does"


def _draw(draws: Draws, scale: Scale) -> dict[str, Array]:
    """Static friction 5 % to 100 % above Coulomb's, gone at 2 % to 30 % of the top speed."""
    return {
        "level": draws.log_uniform(0.05, 1.0) * scale.coulomb_friction,
        "speed": draws.log_uniform(0.02, 0.3) * scale.speed,
    }


EFFECT: Final = StribeckFriction(
    advice=Advice(
        in_words="friction is higher at low speed: the axis sticks before it slides",
        size="{level} more friction at rest than in motion",
        part="guides, bearings, nut or gear, and seals: their lubrication",
        action="Check that enough of the right lubricant arrives. Move the axis over its whole "
        "stroke for some minutes and record again.",
    ),
    search=SearchSpec(
        forms=(Form(("level",), ("speed",)), Form(("level",), ("speed",), grid=_exponential)),
        signature="friction is higher at low speed, the same accelerating and decelerating",
        alternatives=("nonlinear_viscous", "presliding_hysteresis"),
        experiment="long moves at slow speeds, both ways: --motion staircase",
        curve=("friction", "speed"),
        grid=_grid,
        largest=(Largest(("level",), 1.0, Yardstick.EFFORT),),
        discrepancy=0.05,
        shares_friction=True,
    ),
    draw=_draw,
    compensation=Compensation(
        feedforward={"level": "stribeck_feedforward", "speed": "stribeck_speed_rad_s"},
        objection=_another_curve,
    ),
)
