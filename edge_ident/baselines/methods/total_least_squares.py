"""Total least squares: acceleration and velocity have noise as the effort does.

Mixed LS-TLS (Van Huffel and Vandewalle 1991, section 3.5). The offset's column is exact and the
sign's nearly so; a QR decomposition removes both. The other columns and the effort are divided by
their noise. The answer is the right singular vector of the smallest singular value. Noise of
velocity and of acceleration is uncorrelated, as any stationary signal and its derivative are.
"""

from math import gamma, pi, sqrt
from typing import Final

import numpy as np
from numpy.typing import NDArray

from edge_ident.baselines.problem import Problem, fit
from edge_ident.errors import DataError
from edge_ident.estimation.covariance import coloured_std
from edge_ident.model.model import Estimate
from edge_ident.signals.encoder import position_noise

Array = NDArray[np.float64]

_NOISY: Final = 2
"""Leading columns of the regressor that carry noise: acceleration and velocity."""
_LEAST_EFFORT_NOISE: Final = 1e-6
"""Least noise of the effort, over its rms; without any, no rule could divide the residual."""
_UNCERTAINTY: Final = 0.1
"""Relative deviation of the noise's power: an encoder's steps are not quite white noise."""
_ROUNDS: Final = 50
_CONVERGED: Final = 1e-6
"""Change of the modelled effort, relative to the effort, that ends the rounds."""


def estimate(problem: Problem) -> Estimate:
    """Estimate with noise in regressor and effort.

    The encoder's noise follows from the position; the effort's is what is left of the residual,
    so both are found in turn until they converge.

    Raises
    ------
    DataError
        The rounds do not converge: encoder noise explains more than the residual.
    """
    regressor, effort = problem.regressor, problem.effort
    noise = _regressor_noise(problem)
    parameters = fit(regressor, effort)
    for _ in range(_ROUNDS):
        residual = effort - regressor @ parameters
        effort_noise = _effort_noise(residual, effort, noise * parameters)
        before, parameters = parameters, _mixed(regressor, effort, noise, effort_noise)
        moved = np.linalg.norm(regressor @ (parameters - before))
        if moved <= _CONVERGED * np.linalg.norm(effort):
            cleaned = _without_noise(regressor, effort, parameters, noise, effort_noise)
            std = coloured_std(cleaned, effort - regressor @ parameters)
            return problem.with_noise_bias(Estimate(parameters, std), _UNCERTAINTY)
    raise DataError(
        f"total least squares did not converge in {_ROUNDS} rounds",
        "record a motion with more acceleration, or a finer encoder",
    )


def _regressor_noise(problem: Problem) -> Array:
    """Standard deviation of the noise in each column, (4,).

    White noise of deviation s has density 2s²·period; the n-th derivative behind a filter of
    power gain 1/(1 + (f/f_c)⁸)² keeps (2π)²ⁿ·f_c²ⁿ⁺¹ times the integral of x²ⁿ/(1 + x⁸)².
    """
    signals = problem.signals
    density = 2.0 * position_noise(problem.axis.position) ** 2 * signals.period_s
    noise = np.zeros(problem.regressor.shape[1])
    for column, order in ((0, 2), (1, 1)):
        share = (2 * order + 1) / 8.0
        integral = gamma(share) * gamma(2.0 - share) / 8.0
        width = signals.cutoff_hz ** (2 * order + 1)
        noise[column] = (2.0 * pi) ** order * sqrt(density * width * integral)
    return noise


def _effort_noise(residual: Array, effort: Array, from_regressor: Array) -> float:
    """Deviation of the effort's own noise: the residual's without what the regressor causes."""
    variance = float(np.mean(residual**2)) - float(from_regressor @ from_regressor)
    return sqrt(max(variance, _LEAST_EFFORT_NOISE**2 * float(np.mean(effort**2))))


def _mixed(regressor: Array, effort: Array, noise: Array, effort_noise: float) -> Array:
    exact, noisy = regressor[:, _NOISY:], regressor[:, :_NOISY] / noise[:_NOISY]
    stacked = np.column_stack([exact, noisy, effort / effort_noise])
    triangle = np.linalg.qr(stacked).R
    k = exact.shape[1]
    vector = np.linalg.svd(triangle[k:, k:])[2][-1]
    scaled = -vector[:-1] / vector[-1]
    rest = triangle[:k, -1] - triangle[:k, k:-1] @ scaled
    exactly = np.linalg.lstsq(triangle[:k, :k], rest, rcond=None)[0]
    return np.asarray(effort_noise * np.concatenate([scaled / noise[:_NOISY], exactly]))


def _without_noise(
    regressor: Array, effort: Array, parameters: Array, noise: Array, effort_noise: float
) -> Array:
    """The regressor with its likeliest share of the residual taken out."""
    residual = effort - regressor @ parameters
    pulled = noise**2 * parameters
    return np.asarray(
        regressor + np.outer(residual, pulled) / (effort_noise**2 + pulled @ parameters)
    )
