"""Networks whose answers are known, on the paper's motion."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from edge_ident.estimation.manifest import Manifest
from edge_ident.estimation.network import Network
from export.configuration import IMPROVED
from export.manifest import describe
from export.motion import paper_motion

Array = NDArray[np.float64]
Answer = Callable[[Array], Array]
"""Residual (4,) in shares from an image (100, 100)."""

START = (0.5, 0.5, 0.5, 0.0)
MOTION = paper_motion()
SCALES = MOTION.column_scales
SHAPES = MOTION.scaled_regressor(100)
COLUMNS = SHAPES * SCALES


class StandIn(Network):
    """Answers with a function of the image; counts its passes."""

    def __init__(self, answer: Answer, start: tuple[float, ...] | None) -> None:
        self.manifest = paper_manifest(start)
        self.variant = "fp32"
        self.passes = 0
        self._answer = answer

    def residual_shares(self, images: NDArray[np.float32]) -> Array:
        self.passes += len(images)
        return np.array([self._answer(image[0].astype(np.float64)) for image in images])


def paper_manifest(start: tuple[float, ...] | None) -> Manifest:
    """Of a network for the paper's motion, with round figures for its deviations."""
    configuration = replace(IMPROVED, start_shares=start)
    described = describe(configuration, MOTION, {"fp32": b"", "int8": b""})
    deviations = dict.fromkeys(described.parameter_std, np.full(4, 0.001))
    return replace(described, parameter_std=deviations, parameter_std_per_residual=np.ones(4))


def reader(part: float = 1.0, *, rows: slice = slice(None), error: Array | float = 0.0) -> Answer:
    """Least squares of the remainder in the image, for networks with the start `START`.

    Parameters
    ----------
    part : float
        Of the residual that it answers.
    rows : slice
        The remainder's points that it looks at.
    error : (4,) array or float
        That it adds, in shares of the remainder's scale.
    """
    model = SHAPES @ np.array(START)
    inverse = np.linalg.pinv(SHAPES[rows])

    def answer(image: Array) -> Array:
        remainder = model @ image / (model @ model)
        return -part * inverse @ remainder[rows] + error

    return answer


def nothing(image: Array) -> Array:
    """What a useless network answers."""
    return np.zeros(4)
