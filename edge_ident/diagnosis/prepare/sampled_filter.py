"""A low-pass filter that is computed at a few samples of a long record."""

from dataclasses import dataclass
from typing import Final, Self

import numpy as np
import scipy.sparse
from numpy.typing import NDArray

Array = NDArray[np.float64]

_TOGETHER: Final = 16
"""Neighbouring samples that are computed by one dense matrix. Their impulse responses overlap
nearly all; of many more they would not."""


@dataclass(frozen=True)
class SampledFilter:
    """Weights a record of N samples, and filters it at n of them.

    Attributes
    ----------
    blocks : tuple of slice and array
        A part of the record, and the matrix (part, rows) of the filter at a few of its samples.
    """

    blocks: tuple[tuple[slice, Array], ...]

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
        blocks = []
        for first in range(0, len(sample_index), _TOGETHER):
            of_rows = slice(first, first + _TOGETHER)
            part = slice(int(at[of_rows].min()), int(at[of_rows].max()) + 1)
            blocks.append((part, whole[of_rows, part].toarray().T.copy()))
        return cls(tuple(blocks))

    def __call__(self, signals: Array) -> Array:
        """Signals (..., N), weighted and filtered, at the samples (..., n)."""
        parts = [signals[..., part] @ matrix for part, matrix in self.blocks]
        return np.concatenate(parts, axis=-1)
