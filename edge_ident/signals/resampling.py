"""Uneven sampling: from time stamps to the even grid that every filter needs.

One policy for the whole project: all columns are interpolated to the even grid of the mean period.
Time stamps that lie on that grid, but for floating-point rounding, leave the samples as they were
read. Where stamps deviate by more than 5 % of a period, the sampling is called uneven, and the user
is told.
"""

from dataclasses import dataclass, replace
from typing import Final, Self

import numpy as np
from numpy.typing import NDArray

from edge_ident.signals.decimation import LONG
from edge_ident.signals.metrics import quantile
from edge_ident.signals.recording import AxisRecord
from edge_ident.signals.unknown_samples import clipped, stale

Array = NDArray[np.float64]

_ROUNDING: Final = 1e-6
"""Deviation from an even grid, in sampling periods, that floating-point rounding explains."""
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
