"""Subsampling by the DCT-II, the paper's way to a fixed number of points. numpy alone.

The orthonormal scaling and truncation are a reconstruction.
"""

from typing import Final

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

_ANY_LENGTH: Final = 1 << 13
POINTS: Final = 100
"""Length that the paper subsamples every signal to."""


def subsample(signal: Array, points: int = POINTS) -> Array:
    """Fewer points along the first axis, by truncating the orthonormal DCT-II.

    Keep the first `points` coefficients, transform back at that length, scale by √(points/N)
    (the paper's DCT-II subsampling; scaling reconstructed).

    Parameters
    ----------
    signal : (N, ...) array, N at least `points`

    Returns
    -------
    (points, ...) array
    """
    if len(signal) < points:
        raise ValueError(f"cannot subsample {len(signal)} samples to {points}")
    return np.asarray(idct2(dct2(signal)[:points]) * np.sqrt(points / len(signal)))


def dct2(signal: Array) -> Array:
    """Orthonormal DCT-II along the first axis."""
    n = len(signal)
    mirrored = np.concatenate([signal, signal[::-1]])
    spectrum = np.fft.rfft(mirrored, axis=0)[:n]
    twiddle = _along_first(np.exp(-0.5j * np.pi * np.arange(n) / n), signal.ndim)
    result = np.real(spectrum * twiddle) / np.sqrt(2.0 * n)
    result[0] /= np.sqrt(2.0)
    return np.asarray(result)


def idct2(coefficients: Array) -> Array:
    """Inverse of `dct2` along the first axis."""
    n = len(coefficients)
    scaled = coefficients * np.sqrt(2.0 * n)
    scaled[0] *= np.sqrt(2.0)
    twiddle = _along_first(np.exp(0.5j * np.pi * np.arange(n) / n), coefficients.ndim)
    # the mirrored signal's spectrum is zero at its Nyquist frequency
    spectrum = np.concatenate([scaled * twiddle, np.zeros_like(scaled[:1])])
    return np.asarray(np.fft.irfft(spectrum, 2 * n, axis=0)[:n])


def transformable(samples: int) -> int:
    """Most of a number of samples that the transform takes in short time.

    Up to 8192 all are; beyond, the largest product of 2, 3 and 5, a few hundredths fewer at most.
    """
    if samples <= _ANY_LENGTH:
        return samples
    odd = (int(3**threes * 5**fives) for threes in range(8) for fives in range(6))
    powers = (n * 2 ** int(np.log2(samples // n)) for n in odd if n <= samples)
    return max(int(power) for power in powers)


def _along_first(vector: NDArray[np.complex128], ndim: int) -> NDArray[np.complex128]:
    return vector.reshape(-1, *([1] * (ndim - 1)))
