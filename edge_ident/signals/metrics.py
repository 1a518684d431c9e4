"""How well a model's effort matches the measured one."""

from dataclasses import dataclass
from functools import lru_cache
from typing import Final

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Metric:
    """Three measures of one comparison, all fractions.

    Attributes
    ----------
    time_spectral : float
        The paper's: mean of Pearson's correlation in time and of the DCT-II magnitudes
        (reconstruction). Lenient: it does not see a wrong scale.
    fit : float
        1 - ‖error‖ / ‖measured - mean‖.
    relative_residual : float
        ‖error‖ / ‖measured‖.
    """

    time_spectral: float
    fit: float
    relative_residual: float


def compare(measured: Array, modelled: Array) -> Metric:
    """Measure the match of two (N,) efforts."""
    shown = transformable(len(measured))
    spectra = np.abs(dct2(np.stack([measured[:shown], modelled[:shown]]).T))
    spectral = _correlation(spectra[:, 0], spectra[:, 1])
    error = float(np.linalg.norm(measured - modelled))
    spread = float(np.linalg.norm(measured - np.mean(measured)))
    return Metric(
        time_spectral=0.5 * (_correlation(measured, modelled) + spectral),
        fit=1.0 - error / max(spread, np.finfo(float).tiny),
        relative_residual=relative_residual(measured, modelled),
    )


def relative_residual(measured: Array, modelled: Array) -> float:
    """‖measured - modelled‖ / ‖measured‖ of two (N,) efforts."""
    scale = max(float(np.linalg.norm(measured)), np.finfo(float).tiny)
    return float(np.linalg.norm(measured - modelled)) / scale


def rms(values: Array) -> float:
    """Root of the mean square."""
    return float(np.sqrt(np.mean(values**2)))


def quantile(values: Array, share: float) -> float:
    """What a share of finite values does not exceed, interpolated as by `numpy.quantile`.

    That, and `numpy.median`, load `numpy.ma`: a twentieth of the start of a command.
    """
    place = share * (len(values) - 1)
    below = int(place)
    ordered = np.partition(values, below)
    above = ordered[below + 1 :].min() if place > below else ordered[below]
    return float(np.interp(place, (below, below + 1), (ordered[below], above)))


def _correlation(first: Array, second: Array) -> float:
    """Pearson's, and zero where either does not vary."""
    a, b = first - np.mean(first), second - np.mean(second)
    scale = float(np.linalg.norm(a) * np.linalg.norm(b))
    return float(a @ b) / scale if scale > 0 else 0.0


# Subsampling by the DCT-II, the paper's way to a fixed number of points. numpy alone.
#
# The orthonormal scaling and truncation are a reconstruction.

_ANY_LENGTH: Final = 1 << 13
POINTS: Final = 100
"""Length that the paper subsamples every signal to."""


def subsample(signal: Array, points: int = POINTS) -> Array:
    """Fewer points along the first axis, by truncating the orthonormal DCT-II.

    Keep the first `points` coefficients, transform back at that length, scale by √(points/N)
    (the paper's DCT-II subsampling; scaling reconstructed).

    Parameters
    ----------
    signal : (N, ...) array
        N is at least `points`.
    points : int

    Returns
    -------
    (points, ...) array
    """
    if len(signal) < points:
        raise ValueError(f"cannot subsample {len(signal)} samples to {points}")
    return np.asarray(idct2(dct2(signal, points)) * np.sqrt(points / len(signal)))


def dct2(signal: Array, count: int | None = None) -> Array:
    """Orthonormal DCT-II along the first axis, all coefficients or the first ones.

    The even samples, then the odd ones backwards, have the coefficients in their spectrum: that of
    k in the real part, that of N - k in the imaginary one (Makhoul 1980).
    """
    n = len(signal)
    count = count or n
    reordered = np.concatenate([signal[::2], signal[1::2][::-1]])
    spectrum = np.fft.rfft(reordered, axis=0)[:count] / _turns(n, signal.ndim)[:count]
    mirrored = -np.imag(spectrum[max(1, n - count + 1) : (n + 1) // 2])[::-1]
    result = np.concatenate([np.real(spectrum), mirrored]) * np.sqrt(2.0 / n)
    result[0] /= np.sqrt(2.0)
    return np.asarray(result)


def idct2(coefficients: Array) -> Array:
    """Inverse of `dct2` along the first axis."""
    n = len(coefficients)
    half = (n + 1) // 2
    scaled = coefficients * np.sqrt(0.5 * n)
    scaled[0] *= np.sqrt(2.0)
    mirrored = np.zeros_like(scaled[: n // 2 + 1])
    mirrored[1:] = scaled[: half - 1 : -1]
    spectrum = (scaled[: n // 2 + 1] - 1j * mirrored) * _turns(n, coefficients.ndim)
    reordered = np.fft.irfft(spectrum, n, axis=0)
    result = np.empty_like(reordered)
    result[::2], result[1::2] = reordered[:half], reordered[half:][::-1]
    return result


def transformable(samples: int) -> int:
    """Most of a number of samples that the transform takes in short time.

    Up to 8192 all are; beyond, the largest product of 2, 3 and 5, a few hundredths fewer at most.
    """
    if samples <= _ANY_LENGTH:
        return samples
    odd = (int(3**threes * 5**fives) for threes in range(8) for fives in range(6))
    powers = (n * 2 ** int(np.log2(samples // n)) for n in odd if n <= samples)
    return max(int(power) for power in powers)


@lru_cache(maxsize=32)
def _turns(samples: int, ndim: int) -> NDArray[np.complex128]:
    """Quarter of a turn over `samples`, along the first of `ndim` axes, up to half; read-only."""
    turns = np.exp(0.5j * np.pi / samples * np.arange(samples // 2 + 1))
    turns.flags.writeable = False
    return np.asarray(turns.reshape(-1, *([1] * (ndim - 1))))
