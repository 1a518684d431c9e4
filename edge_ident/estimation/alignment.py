"""Bring a periodic recording to the phase and length that a network was trained for.

A network knows one motion, started at one phase (docs/network.md). A recording of the same motion
may start at any phase. It is averaged over its whole periods and rotated in time to the network's
start, so one network serves the sine of one axis and the cosine of the other.
"""

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from edge_ident.signals.conditioning import Signals
from edge_ident.signals.dct import dct2, idct2, subsample

Array = NDArray[np.float64]

_MISSING_SHARE: Final = 0.002
"""Share of a period that a recording may lack at its end."""


@dataclass(frozen=True)
class Subsampled:
    """What the network's image is made of.

    Attributes
    ----------
    regressor : (L, 4) array
        Subsampled, SI.
    effort : (L,) array
    """

    regressor: Array
    effort: Array


def align(signals: Signals, velocity: Array, period_s: float) -> Subsampled | None:
    """Average, rotate and subsample one axis.

    Parameters
    ----------
    signals : Signals
    velocity : (L,) array
        Subsampled velocity of the motion the network was trained for.
    period_s : float
        Its period.

    Returns
    -------
    Subsampled or None
        None where the recording is shorter than one period.
    """
    samples = round(period_s / signals.period_s)
    available = len(signals.effort)
    if available < samples * (1.0 - _MISSING_SHARE):
        return None
    samples = min(samples, available)
    periods = available // samples

    def average(signal: Array) -> Array:
        whole = signal[: periods * samples]
        return np.asarray(whole.reshape(periods, samples, *signal.shape[1:]).mean(axis=0))

    regressor, effort = average(signals.regressor), average(signals.effort)
    shift = _circular_shift(regressor[:, 1], _upsample(velocity, samples))
    return Subsampled(
        regressor=subsample(np.roll(regressor, shift, axis=0), len(velocity)),
        effort=subsample(np.roll(effort, shift), len(velocity)),
    )


def _circular_shift(signal: Array, reference: Array) -> int:
    """Samples by which to roll a signal for the best match with the reference."""
    product = np.fft.rfft(reference) * np.conj(np.fft.rfft(signal))
    return int(np.argmax(np.fft.irfft(product, len(signal))))


def _upsample(signal: Array, samples: int) -> Array:
    """Inverse of `edge_ident.signals.dct.subsample` for a signal without higher coefficients."""
    coefficients = np.zeros(samples)
    coefficients[: len(signal)] = dct2(signal)
    return np.asarray(idct2(coefficients) * np.sqrt(samples / len(signal)))
