"""Friction that differs by direction: a preloaded nut, a skewed seal, a worn guide.

f = difference·|v| + bend·v². Viscous friction is larger by the difference forward and smaller by
it backward; a seal that lifts with the speed makes it bend. Coulomb friction by direction is not
part of this effect: (C₊ - C₋)/2 adds the same effort both ways, which is exactly an offset.
Source: the EMPS reference model with friction by direction (Janot, Gautier and Brunot 2019).
"""

from typing import Final

import numpy as np

from edge_ident.model.effect import Advice, Compensation, Draws, Effect, Parameter, Scale
from edge_ident.model.motion import Array, Motion, Values
from edge_ident.model.search import Form, SearchSpec


class AsymmetricFriction(Effect):
    """Half the difference of viscous friction forward and backward."""

    parameters = (
        Parameter(
            "difference", "{effort}*s/{position}", -1e9, 1e9, "viscous friction, forward over mean"
        ),
        Parameter(
            "bend",
            "{effort}*s^2/{position}^2",
            -1e9,
            1e9,
            "how that changes with the speed",
            default=0.0,
        ),
    )

    def load(self, at: Motion, values: Values) -> Array:
        """The same sign both ways."""
        speed = np.abs(at.velocity)
        return (values["difference"] + values["bend"] * speed) * speed

    def fastest_rate(self, values: Values, inertia: Array, speed: float) -> Array:
        """Rate of viscous friction at top speed."""
        steepest = np.abs(values["difference"]) + 2.0 * np.abs(values["bend"]) * speed
        return steepest / inertia


def _draw(draws: Draws, scale: Scale) -> dict[str, Array]:
    """3 % to 60 % of viscous friction, either way."""
    share = draws.sign() * draws.log_uniform(0.03, 0.6)
    return {"difference": share * scale.viscous_friction}


EFFECT: Final = AsymmetricFriction(
    advice=Advice(
        in_words="friction differs between the two directions",
        part="guides, seals and bearings that are loaded from one side",
        action="Compare the motor current both ways at one constant speed. Check seals, wipers and "
        "the alignment of the guides.",
    ),
    search=SearchSpec(
        forms=(Form(("difference",)), Form(("difference", "bend"))),
        signature="grows with speed and does not change its sign with the direction",
        alternatives=("position_dependent_friction", "nonlinear_viscous", "actuator_deadband"),
        experiment="constant speeds both ways over the same stroke: --motion staircase",
        curve=("difference of directions", "speed"),
        shares_friction=True,
    ),
    draw=_draw,
    compensation=Compensation(
        feedforward={"difference": "viscous_difference_feedforward"}, over="speed"
    ),
)
