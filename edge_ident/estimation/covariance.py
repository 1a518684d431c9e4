"""Standard deviations of a least-squares estimate whose residuals are coloured.

The residual's spectrum is unknown. At the few lowest frequencies, where a slow motion shows its
parameters, it is hardly measured. So the method averages over spectra instead of estimating one:

- The discrete cosine transform turns stationary noise into nearly independent coefficients. The
  logarithm of their variance is a broken line over the logarithm of frequency. Its steps from
  octave to octave are a random walk of unknown step size. Nothing more is assumed.
- The likelihood is the restricted one (Patterson and Thompson 1971). It accounts for the part of
  the noise that the fitted parameters removed from the residual.
- The variance of every parameter follows from the spectrum. The uncertainty of its logarithm
  widens the interval (Laplace's approximation), as Student's t does for white noise.

The method combines known parts: Whittle's likelihood in the cosine domain, Gamma regression of a
log-spectrum, and empirical Bayes over the step size.
"""

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from edge_ident.signals.dct import dct2

Array = NDArray[np.float64]

_NORMAL_95: Final = 1.959964
"""Half a 95 % interval in standard deviations."""
_STEPS: Final = (0.05, 0.2, 0.5, 1.0, 2.0)
"""Sizes of the random walk that are averaged over, in natural logarithms of power: from white
noise to the slope of a second-order low-pass, 2.8."""
_LOWEST_RESOLVED: Final = 8.0
"""Index of the cosine below which octaves are no longer told apart."""
_BAND: Final = 0.6
"""Part of the cosines that the spectrum is fitted to; beyond, the low-pass filter cuts off."""
_LARGEST_ITERATIONS: Final = 10
_LARGEST_CHANGE: Final = 2.0
"""Of a logarithm of power in one iteration."""
_CONVERGED: Final = 0.05
"""Change of a logarithm of power, of which hardly anything is left in the next iteration."""
_RANK: Final = 1e-10
"""Singular value over the largest that counts as zero."""
_TINY: Final = float(np.finfo(float).tiny)


@dataclass(frozen=True)
class _Spectra:
    """Log-spectra of the noise, one for each size of the walk's steps.

    Attributes
    ----------
    coefficients : (S, M) array
        Of the walk's columns.
    covariance : (S, M, M) array
    share : (S,) array
        How probable each is.
    """

    coefficients: Array
    covariance: Array
    share: Array


def coloured_std(regressor: Array, residual: Array) -> Array:
    """Standard deviation of each ordinary least-squares parameter.

    Scaled so that value ± 1.96 std is a 95 % interval, however few the samples.

    Parameters
    ----------
    regressor : (N, K) array, N > K
    residual : (N,) array

    Returns
    -------
    (K,) array
    """
    samples, count = regressor.shape
    scale = float(np.sqrt(np.mean(residual**2)))
    if scale == 0.0:
        return np.zeros(count)
    left, singular, right = np.linalg.svd(regressor, full_matrices=False)
    kept = singular > _RANK * singular[0]
    basis, noise = dct2(left[:, kept]), dct2(residual / scale)
    band = min(samples, max(int(_BAND * samples), count + 4))
    walk = _walk(samples, band)
    spectra = _fit(basis[:band], noise[:band], walk[:band])
    weights = basis @ (right[kept] / singular[kept, None])
    return scale * _std(weights**2, walk, spectra)


def _std(weights: Array, walk: Array, spectra: _Spectra) -> Array:
    """Deviation of a sum of the noise's cosines with given (N, K) squared weights.

    A normal variable whose log-variance is itself normal with variance s² has its 97.5 % quantile
    at z·(1 + (z² - 1)/8·s²), to second order in s; within 2 % up to s = 2.
    """
    power = np.exp(spectra.coefficients @ walk.T)
    variance = np.maximum(power @ weights, _TINY)
    slope = (power[:, None, :] * weights.T) @ walk / variance[..., None]
    spread = np.sum((slope @ spectra.covariance) * slope, axis=2)
    mean = spectra.share @ np.log(variance)
    spread = spectra.share @ (spread + (np.log(variance) - mean) ** 2)
    return np.asarray(np.exp(0.5 * mean) * (1.0 + (_NORMAL_95**2 - 1.0) / 8.0 * spread))


def _walk(samples: int, band: int) -> Array:
    """Columns of a broken line: its level, and steps of about an octave up to the band's end."""
    octave = np.log2(1.0 + np.arange(samples) / _LOWEST_RESOLVED)
    place = octave / octave[band - 1] * max(1, round(octave[band - 1]))
    steps = np.clip(place[:, None] - np.arange(round(place[band - 1])), 0.0, 1.0)
    return np.column_stack([np.ones(samples), steps])


def _fit(basis: Array, noise: Array, walk: Array) -> _Spectra:
    """Modes of the restricted posterior by Fisher scoring, all step sizes at once.

    Parameters
    ----------
    basis : (N, K) array
        Cosine transform of the regressor's column space.
    noise : (N,) array
        Cosine transform of the residual.
    walk : (N, M) array
    """
    products, squares = _products(basis), _products(walk)
    sizes, columns = len(_STEPS), walk.shape[1]
    prior = np.array([[0.0, *np.full(columns - 1, step**-2)] for step in _STEPS])
    current = np.tile(_start(walk, noise, basis), (sizes, 1))
    for left in reversed(range(_LARGEST_ITERATIONS)):
        chi2, free, volume = _restricted(basis, products, noise, current @ walk.T)
        gradient = 0.5 * (chi2 - free) @ walk - prior * current
        information = 0.5 * (free @ squares).reshape(sizes, columns, columns)
        information += prior[:, :, None] * np.eye(columns)
        covariance = np.asarray(np.linalg.inv(information), dtype=np.float64)
        change = _each(covariance, gradient)
        largest = np.max(np.abs(change @ walk.T), axis=1, keepdims=True)
        if np.max(largest) < _CONVERGED or left == 0:
            break
        current = current + change / np.maximum(1.0, largest / _LARGEST_CHANGE)
    evidence = -0.5 * (
        np.sum(current @ walk.T + chi2, axis=1)
        + volume
        + np.linalg.slogdet(information)[1]
        + np.sum(prior * current**2, axis=1)
        - np.sum(np.log(prior[:, 1:]), axis=1)
    )
    share = np.exp(evidence - np.max(evidence))
    # from the mode to the mean: the third derivative of the likelihood is half of `free`
    spread = covariance.reshape(sizes, -1) @ squares.T
    shift = 0.25 * _each(covariance, (free * spread) @ walk)
    return _Spectra(current + shift, covariance, share / np.sum(share))


def _restricted(
    basis: Array, products: Array, noise: Array, log_power: Array
) -> tuple[Array, Array, Array]:
    """What (S, N) log-spectra leave of the noise once the parameters are fitted by them.

    Returns
    -------
    chi2 : (S, N) array
        Squares over their power.
    free : (S, N) array
        What these should be: one less the part that the parameters took.
    volume : (S,) array
        Logarithm of the determinant of the parameters' normal matrix.
    """
    precision = np.exp(-log_power)
    normal = (precision @ products).reshape(len(precision), basis.shape[1], -1)
    # columns without content in the band must not make it singular
    normal += _RANK * np.mean(precision) * np.eye(basis.shape[1])
    inverse = np.asarray(np.linalg.inv(normal), dtype=np.float64)
    fitted = _each(inverse, (precision * noise) @ basis)
    chi2 = (noise - fitted @ basis.T) ** 2 * precision
    free = np.maximum(1.0 - precision * (inverse.reshape(len(precision), -1) @ products.T), 0.0)
    return chi2, free, np.linalg.slogdet(normal)[1]


def _each(matrices: Array, vectors: Array) -> Array:
    """Products of (S, M, M) matrices with (S, M) vectors."""
    return (matrices @ vectors[..., None])[..., 0]


def _products(columns: Array) -> Array:
    """Products of every two of K columns, as (N, K²)."""
    return (columns[:, :, None] * columns[:, None, :]).reshape(len(columns), -1)


def _start(walk: Array, noise: Array, basis: Array) -> Array:
    """Least squares on the log-periodogram, whose mean lies 1.27 below the logarithm of power.

    Where the parameters took the noise out, it says little.
    """
    free = np.maximum(1.0 - np.sum(basis**2, axis=1), 1e-3)
    logarithm = np.log(noise**2 / free + 1e-9) + 1.27
    return np.asarray(np.linalg.lstsq(walk * free[:, None], logarithm * free, rcond=None)[0])
