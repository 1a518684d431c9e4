"""How much effort above the band the base model misses, beyond what instruments explain.

Where encoder noise hides the acceleration, the account with all of it holds that noise, and the one
with a part of it holds what the inertia takes. In each band of frequencies the lesser of the two
counts, without its own noise: that of the effort, and that of the encoder through the inertia.
"""

from collections.abc import Sequence
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from edge_ident.diagnosis.above_band.full_bandwidth import WIDEST, WideSignals

Array = NDArray[np.float64]

_BANDS: Final = 24
"""Bands of equal ratio, from the cut-off to the highest frequency."""
_STANDS_OUT: Final = 3.0
"""Power in a band, of that of its noise, from which it is missed. Rounding is not white, and in a
controlled drive it is answered."""
_SEEN: Final = 0.5
"""Weight from which the direction of a sample is known."""


class Missed(NamedTuple):
    """What is missed in a recording: its mean square, and the number of samples."""

    mean_square: float
    samples: int


def missed_above(wide: WideSignals, accounts: Array, inertia: float, density: float) -> Missed:
    """What is missed above the band in one recording.

    Parameters
    ----------
    wide : WideSignals
    accounts : (3, N) array
        The effort there without inertia and friction (`accounts.accounts`).
    inertia : float
    density : float
        Power of the white noise of the effort, per Hz.
    """
    samples = int(np.count_nonzero(wide.weight > _SEEN))
    frequency = np.fft.rfftfreq(accounts.shape[1], wide.period_s)
    power = 2.0 * np.abs(np.fft.rfft(accounts)) ** 2 / (accounts.shape[1] * max(samples, 1))
    edges = np.geomspace(wide.cutoff_hz, max(WIDEST / wide.period_s, wide.cutoff_hz), _BANDS + 1)
    band = np.digitize(frequency, edges)
    step_hz = 1.0 / (wide.period_s * accounts.shape[1])
    encoder = 2.0 * wide.period_s * wide.position_noise**2 * (2.0 * np.pi * frequency) ** 4
    noise = step_hz * np.stack(
        [density + given * inertia**2 * encoder for given in (0.0, 1.0)]
    )  # with a part of the acceleration, and with all of it
    total = 0.0
    for number in range(1, _BANDS + 1):
        inside = band == number
        seen, known = np.sum(power[:2, inside], axis=1), np.sum(noise[:, inside], axis=1)
        excess = np.where(seen > _STANDS_OUT * known, seen - known, 0.0)
        total += float(np.min(excess))
    return Missed(total, samples)


def together(recordings: Sequence[Missed]) -> float:
    """Rms of what is missed in all recordings."""
    samples = sum(one.samples for one in recordings)
    energy = sum(one.mean_square * one.samples for one in recordings)
    return float(np.sqrt(energy / max(samples, 1)))
