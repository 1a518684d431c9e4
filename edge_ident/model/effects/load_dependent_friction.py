"""Load-dependent friction: a transmission loses a share of the effort that passes through it.

f = share·|T|·sign(v), where T is the effort at the transmission's input that goes on to the loads:
T = y + f, with y = moved·inertia·a + offset + load(x) + guided·(viscous_friction·v +
coulomb_friction·sign(v)). The load along the stroke, load(x), is that of the model. Solved for T:
T = y/(1 - share·sign(v)·sign(y)).
Source: Hamon, Gautier and Garrec, IEEE/RSJ IROS 2010, 6187 (load-dependent friction of robot
joints), written for the input side.
"""

from typing import Final

import numpy as np

from edge_ident.model.effect import Advice, Compensation, Draws, Effect, Parameter, Scale
from edge_ident.model.motion import Array, Motion, Values
from edge_ident.model.search import Excitation, Form, SearchSpec


class LoadDependentFriction(Effect):
    """Dry friction in proportion to the transmitted effort."""

    parameters = (
        Parameter("share", "1", 0.0, 0.9, "of the transmitted effort that is lost"),
        Parameter(
            "guided", "1", 0.0, 1.0, "part of the friction beyond the transmission", default=0.0
        ),
        Parameter("moved", "1", 0.0, 1.0, "part of the inertia beyond it", default=1.0),
    )
    follows_base = True

    def friction(self, at: Motion, values: Values) -> Array:
        """At one instant the transmitted effort is known at the input."""
        near = 1.0 - values["moved"]
        passed = at.transmitted - near * at.inertia_effort + values["guided"] * at.friction_effort
        own = near * values["share"] * at.direction * np.sign(passed)
        return values["share"] * np.abs(passed) / (1.0 - own)

    def resistance(self, motion: Motion, values: Values) -> Array:
        """Along a motion it is known at the output."""
        near = 1.0 - values["moved"]
        output = (
            motion.transmitted
            - near * motion.inertia_effort
            + values["guided"] * motion.friction_effort
        )
        share = values["share"] * motion.direction * np.sign(output)
        return output / (1.0 - share) - output


def _grid(excitation: Excitation) -> dict[str, Array]:
    """From all of it on the motor's side to nothing there."""
    shares = np.meshgrid(np.linspace(0.0, 1.0, 5), np.linspace(0.0, 1.0, 5))
    return dict(zip(("guided", "moved"), map(np.ravel, shares), strict=True))


def _draw(draws: Draws, scale: Scale) -> dict[str, Array]:
    """A loss of 5 % to 60 %, from a ball screw to a worm gear."""
    return {
        "share": draws.log_uniform(0.05, 0.6),
        "guided": draws.uniform(0.0, 1.0),
        "moved": draws.uniform(0.3, 1.0),
    }


EFFECT: Final = LoadDependentFriction(
    advice=Advice(
        in_words="friction grows with the load",
        part="gear, or screw and nut: their efficiency under load",
        action="Check lubrication and preload of nut or gear. Record with two payloads to "
        "confirm it.",
    ),
    search=SearchSpec(
        forms=(Form(("share",), ("guided", "moved")),),
        signature="friction that follows the transmitted effort, not the speed",
        alternatives=("actuator_deadband", "nonlinear_viscous", "payload_change"),
        experiment="two payloads, or accelerations that change at one speed: --motion multisine",
        grid=_grid,
        discrepancy=0.1,
        open_ended=("guided", "moved"),
        shares_friction=True,
    ),
    draw=_draw,
    compensation=Compensation(
        feedforward={
            "share": "transmission_loss",
            "guided": "transmitted_friction",
            "moved": "transmitted_inertia",
        },
        times={"moved": "inertia"},
        note="the board's law knows inertia and constant load; what a load along the stroke loses "
        "is left to feedback",
    ),
)
