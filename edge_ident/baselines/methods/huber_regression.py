"""Huber's regression: outliers pull with a bounded force (Huber 1964).

Iteratively reweighted least squares; the scale is the median absolute residual, so that it does
not grow with the outliers.
"""

from typing import Final

import numpy as np
from numpy.typing import NDArray

from edge_ident.baselines.problem import Problem, fit
from edge_ident.errors import DataError
from edge_ident.estimation.covariance import coloured_std
from edge_ident.model.model import Estimate

Array = NDArray[np.float64]

_THRESHOLD: Final = 1.345
"""Threshold in deviations: 95 % of least squares' efficiency on normal noise."""
_MEDIAN_TO_DEVIATION: Final = 1.4826
_ROUNDS: Final = 200
_CONVERGED: Final = 1e-6
"""Change of the modelled effort, relative to the effort, that ends the rounds."""


def estimate(problem: Problem) -> Estimate:
    """Estimate with bounded influence of every sample.

    The deviations are those of least squares on pseudo-residuals (Street, Carroll and Ruppert
    1988), which gives the M-estimator's covariance, under coloured residuals too.

    Raises
    ------
    DataError
        The rounds do not converge.
    """
    regressor, effort = problem.regressor, problem.effort
    parameters = fit(regressor, effort)
    for _ in range(_ROUNDS):
        residual = effort - regressor @ parameters
        limit = _limit(residual)
        root = np.sqrt(np.clip(residual, -limit, limit) / np.where(residual == 0, 1, residual))
        root[residual == 0] = 1.0
        before = parameters
        parameters = fit(regressor * root[:, None], effort * root)
        moved = np.linalg.norm(regressor @ (parameters - before))
        if moved <= _CONVERGED * np.linalg.norm(effort):
            return problem.with_noise_bias(
                Estimate(parameters, _std(regressor, effort, parameters))
            )
    raise DataError(
        f"the weights did not converge in {_ROUNDS} rounds", "examine the residual over time"
    )


def _limit(residual: Array) -> float:
    """Residual beyond which a sample pulls no harder."""
    scale = _MEDIAN_TO_DEVIATION * float(np.median(np.abs(residual)))
    return max(_THRESHOLD * scale, np.finfo(float).tiny)


def _std(regressor: Array, effort: Array, parameters: Array) -> Array:
    residual = effort - regressor @ parameters
    limit = _limit(residual)
    inside = float(np.mean(np.abs(residual) <= limit))
    return coloured_std(regressor, np.clip(residual, -limit, limit) / inside)
