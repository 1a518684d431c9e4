"""Weighted least squares (IDIM-WLS; Gautier and Poignet 2001).

The method weighs each joint's equations by the reciprocal of their residual's deviation. One axis
has one equation, so segments of the motion take the place of the joints: where the model misses
more, samples count less. Weights and parameters are computed in turn until they converge.
"""

from typing import Final

import numpy as np
from numpy.typing import NDArray

from edge_ident.baselines.problem import Problem, fit
from edge_ident.errors import DataError
from edge_ident.estimation.covariance import coloured_std
from edge_ident.model.model import Estimate

Array = NDArray[np.float64]

_SEGMENTS: Final = 12
_FEWEST_SAMPLES: Final = 20
"""Fewest samples in a segment: its deviation is then known to a sixth."""
_LARGEST_RATIO: Final = 30.0
"""Largest ratio of weights: without it, a segment fitted by chance would end up alone."""
_ROUNDS: Final = 100
_CONVERGED: Final = 1e-6
"""Change of the modelled effort, relative to the effort, that ends the rounds."""


def estimate(problem: Problem) -> Estimate:
    """Estimate with the noise of each segment of the motion.

    Raises
    ------
    DataError
        The record is too short for two segments, or the weights do not converge.
    """
    count = min(_SEGMENTS, len(problem.effort) // _FEWEST_SAMPLES)
    if count < 2:
        raise DataError(
            f"{len(problem.effort)} independent samples are not enough to weigh segments of them",
            f"record a longer motion: {2 * _FEWEST_SAMPLES} are needed",
        )
    regressor, effort = problem.regressor, problem.effort
    weight = np.ones(len(effort))
    modelled = np.zeros(len(effort))
    for _ in range(_ROUNDS):
        weighted = regressor * weight[:, None]
        parameters = fit(weighted, effort * weight)
        before, modelled = modelled, regressor @ parameters
        if np.linalg.norm(modelled - before) <= _CONVERGED * np.linalg.norm(effort):
            std = coloured_std(weighted, (effort - modelled) * weight)
            return problem.with_noise_bias(Estimate(parameters, std))
        weight = _weights(effort - modelled, count)
    raise DataError(f"the weights did not converge in {_ROUNDS} rounds", "record a longer motion")


def _weights(residual: Array, count: int) -> Array:
    """Reciprocal deviation of the residual in each segment, for every sample."""
    segments = np.array_split(residual, count)
    deviation = np.array([np.sqrt(np.mean(segment**2)) for segment in segments])
    deviation = np.maximum(deviation, np.max(deviation) / _LARGEST_RATIO)
    deviation = np.maximum(deviation, np.finfo(float).tiny)
    return np.repeat(np.min(deviation) / deviation, [len(segment) for segment in segments])
