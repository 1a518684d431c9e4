"""Samples that lie: where the filter mixes both directions, where the axis stands, where the
encoder's counts beat with the sampling."""

from typing import Final

import numpy as np
from numpy.typing import NDArray

from edge_ident.effect import Motion
from edge_ident.filters import lowpass

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

SMEAR_PERIODS: Final = 0.7
"""Cut-off periods to either side of a reversal in which the filter mixes both directions."""
_HARMONICS: Final = 2
"""Of the rounding error, which is a sawtooth."""
_SLOW_SWEEP: Final = 8.0
"""Cut-off periods over the time in which a beat crosses the band, at which it is still one."""


def reversals(motion: Motion) -> NDArray[np.intp]:
    """Last samples before the velocity changes its sign."""
    return np.flatnonzero(np.diff(np.sign(motion.velocity)) != 0)


def widened(mask: Mask, by: int) -> Mask:
    """A mask (N,) and so many samples to either side of it."""
    return np.asarray(np.convolve(mask, np.ones(2 * by + 1), "same") > 0.5)


def beating(motion: Motion, count: float, cutoff_hz: float, period_s: float, smear: int) -> Mask:
    """Samples (N,) near which the encoder's counts beat slowly with the sampling.

    At a speed of a whole number of counts per sample the rounding error, a tone otherwise far
    above the filter, is folded into its band; where the speed stays there for a while it looks
    like motion, and the controller answers it.
    """
    beats = np.zeros(len(motion.velocity))
    if count > 0.0:
        for harmonic in range(1, _HARMONICS + 1):
            per_sample = harmonic * np.abs(motion.velocity) * period_s / count
            folded_hz = np.abs(per_sample - np.round(per_sample)) / period_s
            sweep = harmonic * np.abs(motion.acceleration) / count
            beats += (
                (per_sample > 0.5) & (folded_hz < cutoff_hz) & (sweep < cutoff_hz**2 * _SLOW_SWEEP)
            )
    return widened(beats > 0.5, smear)


def standstills(moving: Mask, turns: NDArray[np.intp], cutoff_hz: float, period_s: float) -> Array:
    """Filtered box and ramp (N, 2 S) over each of S standstills; a pulse at each other reversal."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], ~moving, [False]]).astype(int)))
    rows = []
    for first, last in zip(edges[::2], edges[1::2], strict=True):
        margin = min(int(SMEAR_PERIODS / (cutoff_hz * period_s)), (last - first - 1) // 2)
        inside = np.arange(first + margin, last - margin)
        for shape in (np.ones(len(inside)), np.linspace(-1.0, 1.0, len(inside))):
            row = np.zeros(len(moving))
            row[inside] = shape
            rows.append(row)
    for turn in turns[moving[turns]]:
        row = np.zeros(len(moving))
        row[turn : turn + 2] = 0.5
        rows.append(row)
    filtered = lowpass(np.array(rows).reshape(len(rows), len(moving)), cutoff_hz, period_s)
    return filtered.T
