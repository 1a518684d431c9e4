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

_STRETCHES: Final = 12
_FEWEST_SAMPLES: Final = 20
"""In a stretch: its deviation is then known to a sixth."""
_LARGEST_RATIO: Final = 30.0
"""Between the weights: without it, a stretch that is fitted by chance would end up alone."""
_ROUNDS: Final = 100
_SETTLED: Final = 1e-6
"""Change of the modelled effort, relative to the effort, that ends the rounds."""


def estimate(problem: Problem) -> Estimate:
    """Estimate with the noise of each stretch of the motion.

    Raises
    ------
    DataError
        The record is too short for two stretches, or the weights do not converge.
    """
    count = min(_STRETCHES, len(problem.effort) // _FEWEST_SAMPLES)
    if count < 2:
        raise DataError(
            f"{len(problem.effort)} independent samples are too few to weigh stretches of them",
            f"record a longer motion: {2 * _FEWEST_SAMPLES} are needed",
        )
    regressor, effort = problem.regressor, problem.effort
    weight = np.ones(len(effort))
    modelled = np.zeros(len(effort))
    for _ in range(_ROUNDS):
        weighted = regressor * weight[:, None]
        parameters = fit(weighted, effort * weight)
        before, modelled = modelled, regressor @ parameters
        if np.linalg.norm(modelled - before) <= _SETTLED * np.linalg.norm(effort):
            std = coloured_std(weighted, (effort - modelled) * weight)
            return problem.with_noise_bias(Estimate(parameters, std))
        weight = _weights(effort - modelled, count)
    raise DataError(f"the weights did not converge in {_ROUNDS} rounds", "record a longer motion")


def _weights(residual: Array, count: int) -> Array:
    """Reciprocal deviation of the residual in each stretch, for every sample."""
    stretches = np.array_split(residual, count)
    deviation = np.array([np.sqrt(np.mean(stretch**2)) for stretch in stretches])
    deviation = np.maximum(deviation, np.max(deviation) / _LARGEST_RATIO)
    deviation = np.maximum(deviation, np.finfo(float).tiny)
    return np.repeat(np.min(deviation) / deviation, [len(stretch) for stretch in stretches])
