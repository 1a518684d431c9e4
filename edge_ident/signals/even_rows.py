"""Time stamps that jitter although the samples do not.

A computer often stamps a sample when it gets it, and the board took it at an even rate. Then stamps
that are a thousandth of a second off spoil the speed of a fast axis more than its encoder does. The
position tells: its third differences hold less noise with even rows than with the stamps.
"""

from dataclasses import replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from edge_ident.signals.decimation import parts_of
from edge_ident.signals.metrics import quantile
from edge_ident.signals.recording import Recording

Array = NDArray[np.float64]

_LEAST: Final = 1e-3
"""Deviation from an even step, in sampling periods, below which stamps are good enough."""
_SMOOTHER: Final = 0.8
"""Noise of a position with even rows over that with its stamps, below which the stamps are wrong:
what they add is three quarters of what is left. No axis may be as much noisier with even rows."""
_SLOW: Final = 100
"""Samples over which jitter averages out."""
_FARTHEST: Final = 1.0
"""Deviation of the stamps from even rows, in sampling periods, after averaging; beyond, the rate
itself changes, or rows are missing."""
_TINY: Final = float(np.finfo(float).tiny)


def with_even_rows(recording: Recording) -> Recording:
    """A recording whose stamps jitter although its samples do not, with even stamps.

    Others are returned as they are. Rows may be missing: there the stamps step over whole periods.

    Parameters
    ----------
    recording : Recording

    Returns
    -------
    Recording
        With the rms of the jitter in `stamp_jitter` where its stamps were replaced.
    """
    steps = np.diff(recording.time_s)
    if np.ptp(steps) < _LEAST * np.min(steps):  # no step is farther from any quantile
        return recording
    period_s = quantile(steps, 0.5)
    if np.max(np.abs(steps - period_s)) < _LEAST * period_s:
        return recording
    stamps = recording.time_s / period_s
    stepped = np.maximum(1.0, np.rint(steps / period_s))
    for rows in (np.arange(len(stamps), dtype=np.float64), np.cumsum([0.0, *stepped])):
        slope, begin = np.polyfit(rows, stamps, 1)
        jitter = stamps - (begin + slope * rows)
        if _is_jitter(jitter) and _smoother(recording, stamps, rows):
            even_s = period_s * (begin + slope * rows)
            return replace(recording, time_s=even_s, stamp_jitter=float(np.std(jitter)))
    return recording


def even_rows_sentence(jitter: float) -> str:
    """What `with_even_rows` took out of the stamps, in sampling periods, in words."""
    return (
        f"time stamps jitter by {jitter:.1%} of a sampling period (rms), and the samples do not, "
        "because the position is smoother with even stamps; these are used"
    )


def _is_jitter(deviation: Array) -> bool:
    """Whether a deviation of the stamps, in sampling periods, averages out."""
    sums = np.cumsum([0.0, *deviation])
    averaged = (sums[_SLOW:] - sums[:-_SLOW]) / _SLOW
    return float(np.max(np.abs(averaged))) < _FARTHEST


def _smoother(recording: Recording, stamps: Array, rows: Array) -> bool:
    """Whether the positions say that the rows are even."""
    ratios = [
        (_noise(rows, axis.position) + _TINY) / (_noise(stamps, axis.position) + _TINY)
        for axis in recording.axes.values()
    ]
    return min(ratios) < _SMOOTHER and max(ratios) < 1.0 / _SMOOTHER


def _noise(times: Array, position: Array) -> float:
    """White noise of a position (N,), from third divided differences over uneven times (N,)."""
    mean_squares = []
    for t, x in zip(parts_of(times), parts_of(position), strict=True):
        nodes = np.lib.stride_tricks.sliding_window_view(t, 4)
        apart = nodes[:, :, None] - nodes[:, None, :]
        weights = 1.0 / np.prod(apart + np.eye(4), axis=2)
        differences = np.sum(weights * np.lib.stride_tricks.sliding_window_view(x, 4), axis=1)
        mean_squares.append(np.mean(differences**2 / np.sum(weights**2, axis=1)))
    return float(np.sqrt(np.mean(mean_squares)))
