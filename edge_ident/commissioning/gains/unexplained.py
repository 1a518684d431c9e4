"""Effort that a model leaves unexplained, and how much of it another motion will meet.

Most of it may be nothing but the encoder's noise: differentiated twice and multiplied by the
inertia, it looks like effort. No drive needs that. So the encoder's noise is taken out as Wiener
does, frequency by frequency. Its spectrum is that of replicas: the same motion, read with counts
that lie elsewhere. What stays may belong to the place in the motion and come back, or be new each
time.

An axis that stands takes any effort up to its friction, so nothing is seen there. Noise of the
same spectrum stands in for it.
Source: Wiener, Extrapolation, Interpolation, and Smoothing of Stationary Time Series (1949).
"""

import math
from typing import Final

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

from edge_ident.commissioning.gains.drawn_axes import DRAWS
from edge_ident.signals.conditioning import Signals, filtered_regressor
from edge_ident.signals.filters import differentiate

Array = NDArray[np.float64]

_NEIGHBOURS: Final = 4
"""Frequencies on either side over which a spectrum is averaged."""
_TINY: Final = 1e-30


def encoder_replicas(
    parameters: Array,
    signals: Signals,
    position: Array,
    rng: np.random.Generator,
    every: int = 1,
) -> Array:
    """What noise of the encoder alone would leave unexplained by a base model, (DRAWS, M).

    The motion is read again with counts that lie elsewhere.

    Parameters
    ----------
    parameters : (4,) array
        Of the base model.
    signals : Signals
        Of the axis.
    position : (N,) array
        As recorded, evenly sampled.
    rng : Generator
    every : int
        Of the N samples, every so many are wanted.
    """
    cutoff_hz, period_s = signals.cutoff_hz, signals.period_s
    (true,) = differentiate(position, cutoff_hz, period_s, orders=[0])
    count = signals.encoder_count
    beyond = math.sqrt(max(signals.position_noise**2 - count**2 / 12.0, 0.0))
    of_true = (filtered_regressor(true, cutoff_hz, period_s) @ parameters)[::every]
    found = np.empty((DRAWS, len(of_true)))
    for row, lies in zip(found, rng.uniform(size=DRAWS), strict=True):
        read = true + beyond * rng.normal(size=len(true))
        if count:
            read = count * (np.round(read / count + lies) - lies)
        row[:] = (filtered_regressor(read, cutoff_hz, period_s) @ parameters)[::every] - of_true
    return found


def drawn_unexplained(
    left: Array, known: NDArray[np.bool_], replicas: Array, rng: np.random.Generator
) -> Array:
    """Effort (D, N) that drives like this one need beyond what the model explains.

    Parameters
    ----------
    left : (D, N) array
        Effort that the model leaves, where it is known.
    known : (N,) array of bool
    replicas : (D, N) array
        Of what the encoder's noise has in it. How strong that is by chance, each drive takes from
        one of them.
    rng : Generator
    """
    drives, samples = left.shape
    share = max(float(np.mean(known)), 1.0 / samples)
    turns = rng.uniform(size=(drives, samples // 2 + 1))
    back = np.cos(rng.uniform(0.0, 0.5 * np.pi, drives))
    found = np.empty(left.shape)
    for row, of_left, replica, turn, comes in zip(found, left, replicas, turns, back, strict=True):
        # one after the other: the spectra of all are large
        seen, noise = (np.fft.rfft(np.where(known, of, 0.0)) for of in (of_left, replica))
        strength = np.maximum(_smooth(np.abs(seen) ** 2), _TINY)
        true = np.clip(1.0 - _smooth(np.abs(noise) ** 2) / strength, 0.0, 1.0)
        turned = seen / math.sqrt(share) * np.exp(2j * np.pi * turn)
        mixed = comes * true * seen + np.sqrt(true - (comes * true) ** 2) * turned
        both = np.fft.irfft(np.stack([mixed, np.sqrt(true) * turned]), samples)
        row[:] = np.where(known, *both)
    return found


def _smooth(power: Array) -> Array:
    """Mean over neighbouring frequencies."""
    around = np.pad(power, _NEIGHBOURS, mode="reflect")
    return np.asarray(np.mean(sliding_window_view(around, 2 * _NEIGHBOURS + 1, axis=-1), axis=-1))
