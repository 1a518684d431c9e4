"""A low-pass filter that is computed at a few samples of a long record."""

from dataclasses import dataclass
from typing import Final, Self

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

_TOGETHER: Final = 3
"""Chunks that a point of the grid follows from: fewer hold much that it does not follow from, more
are too many products."""
_LONG: Final = 4
"""Impulse responses from which a gap is not filtered."""
_CACHED: Final = 131_072
"""Numbers that are filtered at once, in a processor's cache."""


@dataclass(frozen=True)
class SampledFilter:
    """Weights a record of N samples, and filters it at n of them.

    What is wanted lies on a grid of every so many samples, but for gaps. So the record is cut into
    chunks of a few points of the grid, one after the other. What a chunk adds to the points of its
    own, and to those before that still reach it, is one product with a matrix that all share. It
    stays in a processor's cache, as a matrix for the whole record would not.

    Attributes
    ----------
    matrix : (length, J, points) array
        What a chunk of so many samples adds to points whose chunk begins 0, 1, ... J - 1 earlier.
    weight : (N,) array
    runs : tuple of _Run
        Parts of the record with no long gap between what is wanted.
    """

    matrix: Array
    weight: Array
    runs: "tuple[_Run, ...]"

    @classmethod
    def of(cls, response: Array, sample_index: NDArray[np.intp], weight: Array) -> Self:
        """A filter by its impulse response.

        Parameters
        ----------
        response : (2·reach + 1,) array
            Symmetric; the record is reflected at its ends.
        sample_index : (n,) array of int
            Samples that are wanted, in their order.
        weight : (N,) array
            What the record is multiplied by before.
        """
        apart = np.diff(sample_index)
        step = max(int(np.gcd.reduce(apart)), 1)
        points = max(-(-(len(response) - step) // ((_TOGETHER - 1) * step)), 1)
        length = points * step
        matrix = np.zeros((_TOGETHER * length, points))
        for point in range(points):
            matrix[point * step :, point][: len(response)] = response
        shared = matrix.reshape(_TOGETHER, length, points).transpose(1, 0, 2).copy()
        gaps = np.flatnonzero(apart > _LONG * len(response)) + 1
        runs = (
            _Run.of(wanted, len(response) // 2, step, shared.shape, len(weight))
            for wanted in np.split(sample_index, gaps)
        )
        return cls(shared, weight, tuple(runs))

    def __call__(self, signals: Array) -> Array:
        """Signals (..., N), weighted and filtered, at the samples (..., n)."""
        flat = signals.reshape(-1, signals.shape[-1])
        found = np.empty((len(flat), sum(len(run.taken) for run in self.runs)))
        first = 0
        for run in self.runs:
            last = first + len(run.taken)
            count = max(1, _CACHED // (run.chunks * self.matrix.shape[0]))
            for row in range(0, len(flat), count):
                rows = slice(row, row + count)
                found[rows, first:last] = self._of_run(flat[rows], run)
            first = last
        return found.reshape(*signals.shape[:-1], first)

    def _of_run(self, signals: Array, run: "_Run") -> Array:
        """Signals (D, N), filtered, at the samples of one run."""
        length, together, points = self.matrix.shape
        cut = np.empty((len(signals), run.chunks * length))
        known, inside = run.inside.stop - run.inside.start, slice(run.before, None)
        np.multiply(signals[:, run.inside], self.weight[run.inside], out=cut[:, inside][:, :known])
        cut[:, run.before + known :] = 0.0
        for place, at in run.reflected:
            cut[:, place] = signals[:, at] * self.weight[at]
        parts = cut.reshape(-1, length) @ self.matrix.reshape(length, -1)
        parts = parts.reshape(len(signals), run.chunks, together, points)
        last = run.chunks - together + 1
        added = parts[:, :last, 0].copy()
        for earlier in range(1, together):
            added += parts[:, earlier : earlier + last, earlier]
        return np.asarray(added.reshape(len(signals), -1)[:, run.taken])


@dataclass(frozen=True)
class _Run:
    """Samples that are wanted, and the part of the record that they follow from.

    Attributes
    ----------
    chunks : int
        Number of those that the part is cut into.
    before : int
        Reflected samples before the record begins.
    inside : slice
        Samples of the record.
    reflected : tuple of (slice, array of int)
        Places in the part that lie beyond the record, and the samples that they repeat.
    taken : array of int
        Points of the grid that are wanted.
    """

    chunks: int
    before: int
    inside: slice
    reflected: tuple[tuple[slice, NDArray[np.intp]], ...]
    taken: NDArray[np.intp]

    @classmethod
    def of(
        cls,
        wanted: NDArray[np.intp],
        reach: int,
        step: int,
        shape: tuple[int, ...],
        samples: int,
    ) -> Self:
        """The run of some wanted samples; `shape` is that of the filter's matrix."""
        _, together, points = shape
        taken = (wanted - wanted[0]) // step
        begin, end = int(wanted[0]) - reach, int(wanted[-1]) + reach + 1
        last, inside = samples - 1, slice(max(begin, 0), min(end, samples))
        beyond = np.arange(begin, inside.start), np.arange(inside.stop, end)
        reflected = tuple(
            (slice(int(x[0]) - begin, int(x[-1]) - begin + 1), last - np.abs(last - np.abs(x)))
            for x in beyond
            if len(x)
        )
        chunks = int(taken[-1]) // points + together
        return cls(chunks, inside.start - begin, inside, reflected, taken)
