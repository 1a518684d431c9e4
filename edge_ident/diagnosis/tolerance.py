"""The smallest effect that is worth naming."""

from typing import Final

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

TOLERANCE: Final = 0.01
"""Share of the rms effort that is worth naming, unless the caller says otherwise. A judgement: a
hundredth of the effort moves no gain."""
OUTLIER: Final = 5.0
"""Standard deviations of a residual beyond which no noise explains it."""


def worth_naming(left: Array, effort: Array) -> bool:
    """Whether what a model leaves at some samples (m,) is the tolerance of all efforts (n,)."""
    return bool(left @ left >= TOLERANCE**2 * (effort @ effort))
