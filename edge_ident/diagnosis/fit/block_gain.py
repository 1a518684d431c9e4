"""How much smaller one residual is than another, with an interval from blocks of time."""

from dataclasses import dataclass
from typing import Final

import numpy as np
import scipy.special
from numpy.typing import NDArray

Array = NDArray[np.float64]

_LEVEL: Final = 0.975
"""Quantile of the interval's ends."""
_TINY: Final = float(np.finfo(float).tiny)


@dataclass(frozen=True)
class Gain:
    """Relative reduction of a residual's rms, with its 95 % interval."""

    value: float
    interval: tuple[float, float]

    @property
    def certain(self) -> bool:
        """Whether the residual certainly falls."""
        return self.interval[0] > 0.0


def gain_of(block: NDArray[np.intp], before: Array, after: Array) -> Gain:
    """Relative reduction of the rms from one residual to another.

    The logarithm of the ratio of two sums over B blocks is nearly normal. Its variance is that of
    the blocks' parts of it (the delta method), with B - 1 degrees of freedom.

    Parameters
    ----------
    block : (n,) array of int
        Numbers of the blocks of time.
    before, after : (n,) arrays
    """
    present = np.bincount(block) > 0
    old, new = (np.bincount(block, r**2)[present] for r in (before, after))
    total_old, total_new = max(float(np.sum(old)), _TINY), max(float(np.sum(new)), _TINY)
    ratio = 0.5 * np.log(total_new / total_old)
    blocks = len(old)
    if blocks < 2:
        return Gain(float(1.0 - np.exp(ratio)), (-np.inf, 1.0))
    parts = 0.5 * (new / total_new - old / total_old)
    std = np.sqrt(blocks / (blocks - 1.0) * float(parts @ parts))
    reach = float(scipy.special.stdtrit(blocks - 1, _LEVEL)) * std
    ends = (float(1.0 - np.exp(ratio + reach)), float(1.0 - np.exp(ratio - reach)))
    return Gain(float(1.0 - np.exp(ratio)), ends)
