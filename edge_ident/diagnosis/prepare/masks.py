"""Samples that lie: where nobody knows whereto an axis slides, where the encoder's counts beat with
the sampling."""

from typing import Final

import numpy as np
from numpy.typing import NDArray

from edge_ident.model.effect import Motion

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

SMEAR_PERIODS: Final = 0.7
"""Cut-off periods to either side over which the filter spreads what happens at one moment."""
_TURN_NOISE: Final = 8.0
"""Distance from a turning point, in standard deviations of the encoder's noise, within which the
axis may not have turned yet: two counts and a third of one that has no other noise."""
_STILL_NOISE: Final = 6.0
"""Range of the position, in the same unit, of an axis that stands: less than two counts."""
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


def tapered(mask: Mask, by: float) -> Array:
    """From 0, twice so many samples away from a mask (N,), smoothly to 1 well before it begins."""
    half = int(np.ceil(by))
    window = np.hanning(2 * half + 3)
    spread = np.convolve(widened(mask, half), window / np.sum(window), "same")
    return np.asarray(np.clip(spread, 0.0, 1.0))


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


def undecided(position: Array, noise: float, cutoff_hz: float, period_s: float) -> Mask:
    """Samples (N,) in which the encoder cannot tell whereto the axis slides.

    Those around each turning point that lie within the encoder's noise of it, and those of
    standstills of half a cut-off period. Until the axis has moved on, its friction is anything
    between both its directions.
    """
    turning = np.zeros(len(position), dtype=np.bool_)
    for turn in _turning_points(position, _TURN_NOISE * noise):
        away = np.abs(position - position[turn]) > _TURN_NOISE * noise
        before, after = np.flatnonzero(away[:turn]), np.flatnonzero(away[turn:])
        first = before[-1] + 1 if len(before) else 0
        turning[first : turn + (after[0] if len(after) else len(away))] = True
    width = max(2, int(np.ceil(0.5 / (cutoff_hz * period_s))))
    if width >= len(position):
        return turning
    windows = np.lib.stride_tricks.sliding_window_view(position, width)
    still = np.ptp(windows, axis=1) <= _STILL_NOISE * noise
    return turning | (np.convolve(still, np.ones(width)) > 0.5)


def _turning_points(position: Array, least: float) -> list[int]:
    """Extremes from which the position comes back by more than the least."""
    turns: list[int] = []
    highest = lowest = 0
    direction = 0
    for k, here in enumerate(position.tolist()):
        if here > position[highest]:
            highest = k
        if here < position[lowest]:
            lowest = k
        if direction >= 0 and position[highest] - here > least:
            turns += [highest] if direction > 0 else []
            direction, lowest = -1, k
        elif direction <= 0 and here - position[lowest] > least:
            turns += [lowest] if direction < 0 else []
            direction, highest = 1, k
    return turns
