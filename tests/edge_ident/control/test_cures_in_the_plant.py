"""Cures in closed loop: the board's law around the independent plant."""

from dataclasses import replace

import numpy as np
import pytest

from edge_ident.control.gain_design import design
from edge_ident.control.position_loop import LoopHardware
from edge_ident.model.model import BASE, PARAMETERS, AxisModel, SupportedRange, Term
from firmware_interface.motion import Multisine, SineComponent
from firmware_interface.plant import COUNT_RAD, SAMPLE_S, Effect
from firmware_interface.plant.drives import multisine
from firmware_interface.plant.effect import Scales
from firmware_interface.plant.feed_drive import FEED_DRIVE, feed_drive
from firmware_interface.plant.plant import DELAY
from tools.cure_machines import EFFORT_LIMIT_NM, Machine

HARDWARE = LoopHardware(SAMPLE_S, DELAY * SAMPLE_S, COUNT_RAD, EFFORT_LIMIT_NM)
RANGE = SupportedRange((-2.0, 2.0), (-2.0, 2.0), (-4.0, 4.0), (-10.0, 10.0))
MOTIONS = {
    "x": Multisine((SineComponent(0.9, 1.1, 0.3), SineComponent(0.15, 4.0, 1.0))),
    "z": Multisine((SineComponent(0.7, 1.7, 1.0),)),
}
DRIVES = feed_drive()
CHAIN = DRIVES.chain
LOAD = {"inertia": CHAIN.inertia[1:, 0, 0].sum(), "coulomb": CHAIN.coulomb[1:, 0, 0].sum()}


def hidden(name: str, strength: float) -> Effect:
    """On axis x alone."""
    scales = Scales.of(DRIVES, multisine())
    return Effect.kinds[name].draw(np.array([[strength, 0.0]]), np.random.default_rng(1), scales)


def known(effect: Effect) -> Term:
    """The same effect in the terms of the model."""
    size = float(effect.size[0, 0])
    values = {
        "actuator_deadband": {"width": size},
        "backlash": {
            "gap": size,
            "load_inertia": LOAD["inertia"],
            "deceleration": LOAD["coulomb"] / LOAD["inertia"],
        },
    }
    return Term(effect.name, values[effect.name], supported=RANGE)


def spring(effect: Effect) -> Term:
    """A spring about the middle of its stroke; what it takes there goes to the offset."""
    stiffness = float(effect.size[0, 0] / effect.travel[0, 0])
    values = {"stiffness": stiffness, "curvature": 0.0, "cosine": 0.0, "sine": 0.0, "period": 1.0}
    return Term("position_dependent_load", values, supported=RANGE)


def error_rad(effect: Effect, *terms: Term, offset_nm: float = 0.0) -> float:
    banks = {}
    for name, body in FEED_DRIVE.items():
        values = dict(zip(PARAMETERS, vars(body).values(), strict=True))
        if name == "x":
            values["offset"] += offset_nm
        base = Term(BASE, values, supported=RANGE)
        own = terms if name == "x" else ()
        banks[name] = design(AxisModel((base, *own)), HARDWARE).gains
    return Machine(DRIVES, (effect,), "x").follow(banks, MOTIONS, 6.0).error_rad("x")


@pytest.mark.parametrize(
    ("name", "strength", "times"),
    [("actuator_deadband", 0.4, 10.0), ("backlash", 0.02, 3.0)],
)
def test_a_machine_follows_better_with_what_is_known_of_it(
    name: str, strength: float, times: float
) -> None:
    effect = hidden(name, strength)
    ignorant, knowing = error_rad(effect), error_rad(effect, known(effect))
    print(name, ignorant, knowing)
    assert times * knowing < ignorant


def test_a_spring_no_longer_pulls_the_axis_away() -> None:
    effect = hidden("position_dependent_load", 0.5)
    effect = replace(effect, hose=np.ones((1, 2)), slack=np.zeros((1, 2)))
    middle = -float(effect.size[0, 0] * effect.centre[0, 0] / effect.travel[0, 0])
    ignorant = error_rad(effect, offset_nm=middle)
    knowing = error_rad(effect, spring(effect), offset_nm=middle)
    print(ignorant, knowing)
    assert 10.0 * knowing < ignorant
