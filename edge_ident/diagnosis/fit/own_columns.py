"""What each of several recordings has of its own beside the common model: a shift, and an offset.

Between two days, bearings warm up and sensors are tared. A model with one offset would have to
explain the difference by causes.
"""

from collections.abc import Hashable
from typing import Final

import numpy as np
from numpy.typing import NDArray

from edge_ident.diagnosis.fit.candidates import base_regressor
from edge_ident.diagnosis.prepare.axis_data import AxisData
from edge_ident.model.model import PARAMETERS

Array = NDArray[np.float64]

_KEY: Final[Hashable] = "own columns"
_OFFSET: Final = PARAMETERS.index("offset")


def own_columns(data: AxisData) -> Array:
    """Columns (n, 2·R - 1) for R recordings, computed once for the data.

    First what a further shift of each adds to the effort, per s. Then an offset of each but the
    last, above that of the last. The offset of the base model is the mean over all samples.
    """
    if _KEY not in data.cache:
        ones = base_regressor(data)[:, _OFFSET]
        inside = [data.recording == k for k in range(len(data.segments) - 1)]
        offsets = [(here - np.mean(here)) * ones for here in inside]
        data.cache[_KEY] = np.column_stack([data.timing_columns, *offsets])
    return data.cache[_KEY]


def own_limits(data: AxisData, *, shifted: bool) -> tuple[Array, Array]:
    """Lowest and highest values (2·R - 1,) of the same.

    Where a delay carries the whole shift, `shifted` is False, and there is no further one.
    """
    early, late = data.timing_limits
    offsets = np.full(len(data.segments) - 1, np.inf)
    return np.append(early * shifted, -offsets), np.append(late * shifted, offsets)
