"""Load-dependent friction: a transmission that loses a share of what passes through it.

f = share·|T|·sign(v), where T is the effort at the transmission's input that goes on to inertia
and constant load: T = inertia·a + offset + f. Solved for f, with y = inertia·a + offset:
T = y/(1 - share·sign(v)·sign(y)).
Source: Hamon, Gautier and Garrec, IEEE/RSJ IROS 2010, 6187 (load-dependent friction of robot
joints), written for the input side.
"""

from typing import Final

import numpy as np

from edge_ident.effect import Array, Effect, Form, Motion, Parameter, Values
from edge_ident.strengths import Draws, Scale


class LoadDependentFriction(Effect):
    """Dry friction in proportion to the transmitted effort."""

    parameters = (Parameter("share", "1", 0.0, 0.9, "of the transmitted effort that is lost"),)
    discrepancy = 0.1
    follows_base = True
    forms = (Form(("share",)),)
    signature = "friction that follows the transmitted effort, not the speed"
    rivals = ("actuator_deadband", "nonlinear_viscous", "payload_change")
    experiment = "two payloads, or accelerations that change at one speed: --motion multisine"

    def friction(self, at: Motion, values: Values) -> Array:
        """At one instant the transmitted effort is known at the input."""
        return values["share"] * np.abs(at.transmitted)

    def resistance(self, motion: Motion, values: Values) -> Array:
        """Along a motion it is known at the output."""
        output = motion.transmitted
        share = values["share"] * motion.direction * np.sign(output)
        return output / (1.0 - share) - output

    def draw(self, draws: Draws, scale: Scale) -> dict[str, Array]:
        """A loss of 5 % to 60 %, from a ball screw to a worm gear."""
        return {"share": draws.log_uniform(0.05, 0.6)}


EFFECT: Final = LoadDependentFriction()
