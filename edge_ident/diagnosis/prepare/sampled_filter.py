"""A low-pass filter that is computed at a few samples of a long record."""

from dataclasses import dataclass
from typing import Final, Self

import numpy as np
import scipy.sparse
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

Array = NDArray[np.float64]

_TOGETHER: Final = 16
"""Neighbouring samples that are computed by one dense matrix. Their impulse responses overlap
nearly all; of many more they would not."""
_FEW: Final = 4
"""Signals up to which all parts of the record are copied and multiplied in one call: one call for
each part takes longer than its sums."""


@dataclass(frozen=True)
class SampledFilter:
    """Weights a record of N samples, and filters it at n of them.

    Attributes
    ----------
    begins : (B,) array of int
        Where each part of the record begins, all of the same length.
    matrices : (B, part, rows) array
        The filter at a few samples of each part; zero where a part has fewer than the others.
    ends : (B,) array of int
        Where what each matrix needs of its part ends.
    places : (n,) array of int
        Of the wanted samples among all B·rows.
    """

    begins: NDArray[np.intp]
    matrices: Array
    ends: NDArray[np.intp]
    places: NDArray[np.intp]

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
        reach, last = len(response) // 2, len(weight) - 1
        at = np.abs(sample_index[:, None] + np.arange(-reach, reach + 1))
        at = last - np.abs(last - at)
        rows = np.repeat(np.arange(len(sample_index)), len(response))
        entries = (np.tile(response, len(sample_index)) * weight[at.ravel()], (rows, at.ravel()))
        whole = scipy.sparse.csr_array(entries, shape=(len(sample_index), len(weight)))
        pieces = _pieces(sample_index, reach)
        length = max(int(np.ptp(at[piece])) for piece in pieces) + 1
        begins = np.array([min(int(at[p].min()), len(weight) - length) for p in pieces])
        ends = np.array([int(at[piece].max()) + 1 for piece in pieces])
        matrices = np.zeros((len(pieces), length, _TOGETHER))
        for matrix, piece, first in zip(matrices, pieces, begins, strict=True):
            matrix[:, : len(at[piece])] = whole[piece, first : first + length].toarray().T
        places = [k * _TOGETHER + np.arange(len(at[p])) for k, p in enumerate(pieces)]
        return cls(begins, matrices, ends, np.concatenate(places))

    def __call__(self, signals: Array) -> Array:
        """Signals (..., N), weighted and filtered, at the samples (..., n)."""
        flat = signals.reshape(-1, signals.shape[-1])
        blocks, length, rows = self.matrices.shape
        if len(flat) <= _FEW:
            parts = sliding_window_view(flat, length, axis=-1)[:, self.begins]
            found = (parts.swapaxes(0, 1) @ self.matrices).swapaxes(0, 1)
        else:
            found = np.empty((len(flat), blocks, rows))
            for k, (first, end) in enumerate(zip(self.begins, self.ends, strict=True)):
                found[:, k] = flat[:, first:end] @ self.matrices[k, : end - first]
        found = found.reshape(len(flat), -1)
        if len(self.places) < found.shape[1]:
            found = found[:, self.places]
        return found.reshape(*signals.shape[:-1], -1)


def _pieces(sample_index: NDArray[np.intp], reach: int) -> list[slice]:
    """A few neighbouring samples each; none across a gap that the filter does not reach over."""
    gaps = np.flatnonzero(np.diff(sample_index) > reach) + 1
    ends = np.array([*gaps, len(sample_index)])
    pieces, first = [], 0
    for end in ends:
        while first < end:
            pieces.append(slice(first, min(first + _TOGETHER, int(end))))
            first = pieces[-1].stop
    return pieces
