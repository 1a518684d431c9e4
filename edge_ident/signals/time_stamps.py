"""Time stamps as they are recorded: uneven, jittering, with rows lost; and the even grid."""

from dataclasses import dataclass, replace
from typing import Final, Self

import numpy as np
from numpy.typing import NDArray

from edge_ident.signals.filters import LONG, Mask, parts_of
from edge_ident.signals.metrics import quantile
from edge_ident.signals.recording import Array, AxisRecord, Recording

# Samples of a recording that say nothing: read before a pause and stamped after it, or clipped.


_PAUSE: Final = 2.0  # sampling periods from one stamp to the next, from which a recorder paused
# Share of pauses from which the sampling is uneven by nature, and no recorder paused.
_SELDOM: Final = 0.02
# Share of a record at exactly its highest or lowest effort, from which it is clipped.
_AT_PEAK: Final = 0.005
# Samples at the peak over those at each of the next levels. A sinusoid in counts reaches 3.
_PILE: Final = 5.0
_NEXT_LEVELS: Final = 3
# Different values of an effort, up to which its levels are those of a command.
_FEWEST_LEVELS: Final = 20


def stale(time_s: Array) -> Mask:
    """Rows (N,) that end a pause of the time stamps.

    A recorder that is held up has often read the position already and stamps it when it goes on.
    So the row that ends a pause may be as old as the pause is long.
    """
    steps = np.diff(time_s)
    ends = np.concatenate([[False], steps > _PAUSE * quantile(steps, 0.5)])
    ends[-1] = False
    return ends if np.mean(ends) < _SELDOM else np.zeros(len(ends), dtype=np.bool_)


def clipped(effort: Array) -> Mask:
    """Samples (N,) at exactly the highest or the lowest effort, where many are.

    The effort that the axis needed there is unknown. A command that takes a few levels only is not
    clipped.
    """
    found = np.zeros(len(effort), dtype=np.bool_)
    for sign, peak in ((1.0, np.max(effort)), (-1.0, np.min(effort))):
        if np.count_nonzero(effort == peak) <= _AT_PEAK * len(effort):
            continue
        levels, counts = np.unique(sign * effort, return_counts=True)
        if len(levels) < _FEWEST_LEVELS:
            return found
        beside = float(np.mean(counts[-1 - _NEXT_LEVELS : -1]))
        if counts[-1] > max(_AT_PEAK * len(effort), _PILE * beside):
            found |= sign * effort == levels[-1]
    return found


# Uneven sampling: from time stamps to the even grid that every filter needs.
#
# One policy for the whole project: all columns are interpolated to the even grid of the mean
# period. Time stamps that lie on that grid, but for floating-point rounding, leave the samples as
# they were read. Where stamps deviate by more than 5 % of a period, the sampling is called uneven,
# and the user is told.


# Deviation from an even grid, in sampling periods, that floating-point rounding explains.
_ROUNDING: Final = 1e-6
GAP: Final = 3.0
"""Sampling periods between two samples, from which samples are missing."""
UNEVEN: Final = 0.05
"""Deviation above which the user is told."""


@dataclass(frozen=True)
class EvenGrid:
    """The even grid of a recording, from its first to its last time stamp.

    Attributes
    ----------
    begin_s : float
    period_s : float
        The mean sampling period.
    jitter : float
        Largest deviation of a time stamp from the grid, in sampling periods.
    """

    begin_s: float
    period_s: float
    jitter: float
    _stamps_s: Array

    @classmethod
    def of(cls, time_s: Array) -> Self:
        """The grid of time stamps (N,)."""
        period_s = float((time_s[-1] - time_s[0]) / (len(time_s) - 1))
        even_s = time_s[0] + period_s * np.arange(len(time_s))
        deviation = time_s - even_s
        jitter = float(np.max(np.abs(deviation - np.mean(deviation)))) / period_s
        return cls(float(time_s[0]), period_s, jitter, time_s)

    @property
    def time_s(self) -> Array:
        """Times on the grid, (N,); made when they are asked for, because they may be many."""
        return np.asarray(self.begin_s + self.period_s * np.arange(len(self._stamps_s)), np.float64)

    @property
    def uneven(self) -> bool:
        """Whether the sampling is so uneven that the user should know."""
        return self.jitter > UNEVEN

    def resampled(self, signal: Array) -> Array:
        """A signal (N,) on the grid; signals (D, N) only where the stamps lie on it."""
        if self.jitter <= _ROUNDING:
            return signal
        kept = ~stale(self._stamps_s)
        return interpolated(self.time_s, self._stamps_s[kept], signal[kept])

    def unknown(self, effort: Array) -> NDArray[np.bool_]:
        """Samples (N,) inside a gap of the time stamps, or where an effort (N,) is clipped.

        No interpolation knows the motion inside a gap.
        """
        if self.jitter <= _ROUNDING:
            return clipped(effort)
        stamps_s = self._stamps_s[~stale(self._stamps_s)]
        after = np.clip(np.searchsorted(stamps_s, self.time_s), 1, len(stamps_s) - 1)
        around_s = stamps_s[after] - stamps_s[after - 1]
        inside = around_s > GAP * quantile(np.diff(self._stamps_s), 0.5)
        nearest = np.searchsorted(self._stamps_s, self.time_s - 0.5 * self.period_s)
        nearest = np.clip(nearest, 0, len(effort) - 1)
        return np.asarray(inside | clipped(effort)[nearest])

    def axis(self, record: AxisRecord) -> AxisRecord:
        """All columns of an axis on the grid."""
        reference = None if record.reference is None else self.resampled(record.reference)
        return replace(
            record,
            position=self.resampled(record.position),
            effort=self.resampled(record.effort),
            reference=reference,
        )


def interpolated(at: Array, time: Array, signal: Array) -> Array:
    """Cubic Lagrange interpolation (M,) of a signal (N,), N at least 4."""
    if len(at) > LONG:  # block by block: the nodes take ten times the memory of the signal
        blocks = np.split(at, np.arange(LONG, len(at), LONG))
        return np.concatenate([interpolated(block, time, signal) for block in blocks])
    first = np.clip(np.searchsorted(time, at) - 2, 0, len(time) - 4)
    nodes = first[:, None] + np.arange(4)
    t = time[nodes]
    result = np.zeros_like(at)
    for i in range(4):
        others = [j for j in range(4) if j != i]
        weight = np.prod((at[:, None] - t[:, others]) / (t[:, [i]] - t[:, others]), axis=1)
        result += weight * signal[nodes[:, i]]
    return result


# Time stamps that jitter although the samples do not.
#
# A computer often stamps a sample when it gets it, and the board took it at an even rate. Then
# stamps that are a thousandth of a second off spoil the speed of a fast axis more than its encoder
# does. The position tells: its third differences hold less noise with even rows than with the
# stamps.


# Deviation from an even step, in sampling periods, below which stamps are good enough.
_LEAST: Final = 1e-3
# Noise of a position with even rows over that with its stamps, below which the stamps are wrong:
# what they add is three quarters of what is left. No axis may be as much noisier with even rows.
_SMOOTHER: Final = 0.8
_SLOW: Final = 100  # samples over which jitter averages out
# Deviation of the stamps from even rows, in sampling periods, after averaging; beyond, the rate
# itself changes, or rows are missing.
_FARTHEST: Final = 1.0
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


# Rows that are missing although the time stamps do not say so.
#
# A recorder that loses a sample now and then, and numbers its rows, stamps the next one too early.
# The axis then seems to go twice as far in one sampling period as in those before and after: an
# acceleration that no effort made. Where the position says so, the time that is missing is put in.

_EVEN: Final = 0.05  # deviation of a step from whole sampling periods, up to which rows are even
# Steps on either side that a step is compared with: one of them may be another loss.
_BESIDE: Final = 3
# Share of a step: so far steps differ from the mean of those beside them, and losses from whole
# steps.
_NEAR: Final = 0.25
_BEYOND_NOISE: Final = 8.0  # step over the noise of a step, from which it tells
# The same over what an encoder counts in: a step and the mean beside it differ by up to two.
_COUNTS: Final = 8.0
_SLOW_ROW: Final = 0.05  # share of the fastest step, below which a step tells nothing
# Share of the steps, above which the sampling is another. Of steps that are longer by no whole
# number, or backwards, to those that are: a few of these, and the encoder is to blame.
_FEW_LOST: Final = 0.1
_NORMAL: Final = 0.6745  # median of the magnitude of noise, in its standard deviations


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
    return max(_COUNTS * counts, _SLOW_ROW * float(np.max(sizes)))


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
    if np.count_nonzero(odd) > _FEW_LOST * np.count_nonzero(found) or np.mean(found) > _FEW_LOST:
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
