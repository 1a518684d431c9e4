"""The base model of an axis: rigid body and friction, linear in its four parameters.

effort = inertia·a + viscous_friction·v + coulomb_friction·sign(v) + offset

A reconstruction of the paper's reduced model (the text fixes four coefficients per axis, three
positive and one of either sign, but not their names).
"""

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

PARAMETERS: Final = ("inertia", "viscous_friction", "coulomb_friction", "offset")
POSITIVE: Final = np.array([True, True, True, False])
"""Which parameters physics requires to be positive; the offset may have either sign."""


@dataclass(frozen=True)
class Estimate:
    """Parameters in the order of `PARAMETERS` with their standard deviations, (4,) each, SI."""

    parameters: NDArray[np.float64]
    std: NDArray[np.float64]


def regressor(
    velocity: NDArray[np.float64], acceleration: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Columns that multiply the parameters, in the order of `PARAMETERS`.

    Parameters
    ----------
    velocity, acceleration : (N,) arrays
        In rad/s and rad/s², or m/s and m/s².

    Returns
    -------
    (N, 4) array
        Acceleration, velocity, its sign, and one.
    """
    return np.column_stack(
        [acceleration, velocity, np.sign(velocity), np.ones_like(velocity)]
    ).astype(np.float64)
