"""Joints of an arm, recorded: moments of the links, and inertia and friction of their own."""

import numpy as np
from numpy.typing import NDArray

from edge_ident.signals.recording import AxisRecord

Array = NDArray[np.float64]

PERIOD_S = 4e-3
COUNT_RAD = 1e-5
NOISE_NM = 0.02


def twice_differentiated(values: Array) -> Array:
    """By time, along the first axis."""
    return np.gradient(np.gradient(values, PERIOD_S, axis=0), PERIOD_S, axis=0)


def joint(
    angle: Array,
    moment: Array,
    inertia: float,
    friction: tuple[float, float],
    zero: float,
    rng: np.random.Generator,
) -> AxisRecord:
    """A joint that turns by an angle (N,) against a moment (N,) of its links, read from some zero.

    Friction is viscous and Coulomb friction; the generator draws the noise of the effort.
    """
    speed, (viscous, coulomb) = np.gradient(angle, PERIOD_S), friction
    effort = moment + inertia * np.gradient(speed, PERIOD_S)
    effort += viscous * speed + coulomb * np.sign(speed)
    effort += NOISE_NM * rng.standard_normal(len(angle))
    return AxisRecord(COUNT_RAD * np.round((angle + zero) / COUNT_RAD), effort, "rad", "N*m")
