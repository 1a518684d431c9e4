"""Bring a periodic recording to the phase and length that a network was trained for.

A network knows one motion, started at one phase (docs/network.md). A recording of the same motion
may start at any phase. It is averaged over its whole periods and rotated in time to the network's
start, so one network serves the sine of one axis and the cosine of the other.
"""

from dataclasses import dataclass
from functools import lru_cache
from typing import Final

import numpy as np
from numpy.typing import NDArray

from edge_ident.signals.conditioning import Signals
from edge_ident.signals.dct import dct2, idct2, subsample

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

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
        None where the recording is shorter than one period, or a period has fewer samples than the
        network reads.
    """
    samples = round(period_s / signals.period_s)
    available = len(signals.effort)
    if available < samples * (1.0 - _MISSING_SHARE) or min(samples, available) < len(velocity):
        return None
    samples = min(samples, available)
    periods = available // samples
    # columns are large: none has a name that is not needed any more
    period = np.stack([*signals.regressor.T, signals.effort])[:, : periods * samples]
    period = period.reshape(len(period), periods, samples).mean(axis=1)
    shift = _circular_shift(period[1], _spectrum(tuple(velocity.tolist()), samples))
    period = np.roll(period, shift, axis=1)
    seen = subsample(period.T, len(velocity))
    return Subsampled(regressor=seen[:, :-1], effort=seen[:, -1])


def _circular_shift(signal: Array, reference: Complex) -> int:
    """Samples by which to roll a signal for the best match with the reference's spectrum."""
    product = reference * np.conj(np.fft.rfft(signal))
    return int(np.argmax(np.fft.irfft(product, len(signal))))


@lru_cache(maxsize=8)
def _spectrum(velocity: tuple[float, ...], samples: int) -> Complex:
    """Spectrum of a signal that `edge_ident.signals.dct.subsample` made of so many samples.

    It had no higher coefficients. The network's motion is the same for every recording.
    """
    coefficients = np.zeros(samples)
    coefficients[: len(velocity)] = dct2(np.array(velocity))
    return np.fft.rfft(idct2(coefficients) * np.sqrt(samples / len(velocity)))
