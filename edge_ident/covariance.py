"""Standard deviations of a least-squares estimate whose residuals are coloured.

Two estimates of the same covariance, of which the larger is taken per parameter, because each
is too small where the other is right:

- residuals as a stationary autoregression (Burg's method, order by Akaike's criterion): good for
  slow, steady colour, blind to bursts at reversals;
- Newey and West (1987) with the bandwidth of Andrews (1991): sees bursts, short of memory.
"""

from typing import Final

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

_LARGEST_ORDER: Final = 6
_LARGEST_CORRELATION: Final = 0.97
"""Autocorrelation beyond which the plug-in bandwidth would exceed the record."""
_TINY: Final = np.finfo(float).tiny


def coloured_std(regressor: Array, residual: Array) -> Array:
    """Standard deviation of each ordinary least-squares parameter.

    Parameters
    ----------
    regressor : (N, K) array, N > K
    residual : (N,) array

    Returns
    -------
    (K,) array
    """
    inverse = np.asarray(np.linalg.pinv(regressor.T @ regressor), dtype=np.float64)
    steady = _autoregressive_variance(regressor, residual, inverse)
    bursts = _newey_west_variance(regressor, residual, inverse)
    return np.sqrt(np.maximum(steady, bursts))


def _newey_west_variance(regressor: Array, residual: Array, inverse: Array) -> Array:
    samples, columns = regressor.shape
    scores = regressor * residual[:, None]
    middle = scores.T @ scores
    bandwidth = _andrews_bandwidth(scores)
    for lag in range(1, min(int(bandwidth) + 1, samples)):
        cross = scores[lag:].T @ scores[:-lag]
        middle += (1.0 - lag / (bandwidth + 1.0)) * (cross + cross.T)
    return np.asarray(np.diag(inverse @ middle @ inverse) * samples / (samples - columns))


def _andrews_bandwidth(scores: Array) -> float:
    """Bartlett lag window in samples, from a first-order autoregression of each score."""
    energy = np.maximum(np.sum(scores[:-1] ** 2, axis=0), _TINY)
    rho = np.sum(scores[1:] * scores[:-1], axis=0) / energy
    rho = np.clip(rho, -_LARGEST_CORRELATION, _LARGEST_CORRELATION)
    alpha = 4.0 * rho**2 / ((1.0 - rho) ** 2 * (1.0 + rho) ** 2)
    return float(1.1447 * (np.max(alpha) * len(scores)) ** (1.0 / 3.0))


def _autoregressive_variance(regressor: Array, residual: Array, inverse: Array) -> Array:
    samples = len(residual)
    coefficients, variance = _burg(residual)
    length = 2 * samples
    power = variance / np.abs(np.fft.fft(coefficients, length)) ** 2
    spectrum = np.fft.fft(regressor, length, axis=0)
    middle = np.real(spectrum.conj().T @ (spectrum * power[:, None])) / length
    covariance = inverse @ middle @ inverse
    # the fit took part of the noise out of the residual: put that share back, at most fivefold
    noise = float(np.mean(power)) * samples
    lost = float(np.trace(inverse @ middle))
    return np.asarray(np.diag(covariance) * noise / max(noise - lost, 0.2 * noise, _TINY))


def _burg(residual: Array) -> tuple[Array, float]:
    """Autoregression by Burg's method: coefficients with leading one, innovation variance."""
    samples = len(residual)
    forward, backward = residual[1:].copy(), residual[:-1].copy()
    coefficients, variance = np.array([1.0]), float(residual @ residual) / samples + _TINY
    best = (samples * np.log(variance), coefficients, variance)
    for order in range(1, _LARGEST_ORDER + 1):
        energy = float(forward @ forward + backward @ backward)
        reflection = -2.0 * float(forward @ backward) / max(energy, _TINY)
        extended = np.append(coefficients, 0.0)
        coefficients = extended + reflection * extended[::-1]
        forward, backward = (
            (forward + reflection * backward)[1:],
            (backward + reflection * forward)[:-1],
        )
        variance = variance * (1.0 - reflection**2) + _TINY
        criterion = samples * np.log(variance) + 2 * order
        if criterion < best[0]:
            best = (criterion, coefficients, variance)
    return best[1], best[2]
