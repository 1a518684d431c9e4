"""Rows that are missing although the time stamps do not say so.

A recorder that loses a sample now and then, and numbers its rows, stamps the next one too early.
The axis then seems to go twice as far in one sampling period as in those before and after: an
acceleration that no effort made. Where the position says so, the time that is missing is put in.
"""

from dataclasses import replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from edge_ident.signals.even_rows import with_even_rows
from edge_ident.signals.metrics import quantile
from edge_ident.signals.recording import Recording

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

_EVEN: Final = 0.05
"""Deviation of a step from whole sampling periods, up to which rows are even."""
_BESIDE: Final = 3
"""Steps on either side that a step is compared with: one of them may be another loss."""
_NEAR: Final = 0.25
"""Share of a step: so far steps differ from the mean of those beside them, and losses from whole
steps."""
_BEYOND_NOISE: Final = 8.0
"""Step over the noise of a step, from which it tells."""
_COUNTS: Final = 8.0
"""The same over what an encoder counts in: a step and the mean beside it differ by up to two."""
_SLOW: Final = 0.05
"""Share of the fastest step, below which a step tells nothing."""
_SELDOM: Final = 0.1
"""Share of the steps, above which the sampling is another. Of steps that are longer by no whole
number, or backwards, to those that are: a few of these, and the encoder is to blame."""
_NORMAL: Final = 0.6745
"""Median of the magnitude of noise, in its standard deviations."""


def with_mended_stamps(recording: Recording) -> Recording:
    """A recording with the time stamps that its positions tell: those of even rows where the stamps
    jitter, and with the time of rows that are missing. Others are returned as they are."""
    return with_lost_rows(with_even_rows(recording))


def with_lost_rows(recording: Recording) -> Recording:
    """A recording whose time steps over rows that are missing; others are returned as they are.

    Every axis that moves fast enough to tell has to tell the same.

    Parameters
    ----------
    recording : Recording
        With even time stamps, but for gaps.

    Returns
    -------
    Recording
        With the number of rows that were found to be missing in `lost_rows`.
    """
    steps = np.diff(recording.time_s)
    period_s = quantile(steps, 0.5)
    passed = np.maximum(1.0, np.rint(steps / period_s))
    if (
        len(steps) <= 2 * _BESIDE
        or np.max(np.abs(steps / period_s - passed)) > _EVEN * passed.max()
    ):
        return recording
    moved = [np.diff(axis.position) / passed for axis in recording.axes.values()]
    if not any(map(_jumps, moved)):
        return recording  # most are; what follows takes longer
    lost, contradicted = np.zeros(len(steps)), np.zeros(len(steps), dtype=np.bool_)
    for steps in moved:
        of_axis, in_time = _lost(steps)
        lost, contradicted = np.maximum(lost, of_axis), contradicted | in_time
    lost[contradicted] = 0.0
    if not np.any(lost):
        return recording
    time_s = recording.time_s + period_s * np.cumsum([0.0, *lost])
    return replace(recording, time_s=time_s, lost_rows=int(np.sum(lost)))


def lost_rows_sentence(lost: int) -> str:
    """What `with_lost_rows` found, in words."""
    were = "row is" if lost == 1 else "rows are"
    return (
        f"{lost} {were} missing without a gap in the time stamps: in one sampling period the "
        "position goes the way of several; the time of these rows was put in"
    )


def _least(steps: Array) -> float:
    """Size of a step (N,) from which it tells, whatever the noise."""
    sizes = np.abs(steps)
    counts = float(np.min(sizes, where=sizes > 0.0, initial=np.inf))
    return max(_COUNTS * counts, _SLOW * float(np.max(sizes)))


def _jumps(steps: Array) -> bool:
    """Whether a step (N,) differs from the one before by as much as a loss makes at least."""
    return bool(np.max(np.abs(np.diff(steps))) > (1.0 - 2.0 * _NEAR) * _least(steps))


def _lost(steps: Array) -> tuple[Array, Mask]:
    """Rows that are missing inside each step (N,) of a position, and where certainly none is."""
    sides = _windows(steps)[:, :_BESIDE], _windows(steps)[:, -_BESIDE:]
    before, after = map(_middle, sides)
    around = 0.5 * (before + after)
    off = steps - around
    off -= _middle(_windows(off))  # what a motion that bends is off by
    noise = quantile(np.abs(off), 0.5) / _NORMAL
    size = np.maximum(np.abs(around), np.finfo(float).tiny)
    least = max(_BEYOND_NOISE * noise, _least(steps))
    tells = (size > least) & (np.abs(before - after) < 2.0 * _NEAR * size)
    ratio = np.where(tells, off * np.sign(around) / size, 0.0)
    rows = np.rint(ratio)
    whole = np.abs(ratio - rows) < _NEAR * np.maximum(0.5 * rows, 1.0)
    found = tells & (rows >= 1.0) & whole
    odd = tells & ~(whole & (rows >= 0.0))
    if np.count_nonzero(odd) > _SELDOM * np.count_nonzero(found) or np.mean(found) > _SELDOM:
        return np.zeros(len(steps)), np.zeros(len(steps), dtype=np.bool_)
    return np.where(found, rows, 0.0), tells & (rows == 0.0)


def _windows(values: Array) -> Array:
    """Each value (N,) with those beside it, (N, W)."""
    padded = np.pad(values, _BESIDE, mode="edge")
    return np.lib.stride_tricks.sliding_window_view(padded, 2 * _BESIDE + 1)


def _middle(windows: Array) -> Array:
    """Medians (N,) of an odd number of values each; numpy's own loads masked arrays."""
    middle = windows.shape[1] // 2
    return np.asarray(np.partition(windows, middle, axis=1)[:, middle])
