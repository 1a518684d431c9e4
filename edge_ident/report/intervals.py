"""Parameters in words: 95 % intervals, to the digits that the standard deviation leaves."""

import math
from typing import Final

from edge_ident.model.model import NORMAL_95

EFFECTIVE: Final = "effective: the line through the friction curve, over the speeds visited"
"""What people are told of an effective parameter, once."""
_MOST_DECIMALS: Final = 9


def decimals(std: float) -> int:
    """Decimals that show two digits of a standard deviation."""
    return max(0, 1 - int(f"{std:.1e}".partition("e")[2]))


def interval_texts(value: float, std: float | None) -> tuple[str, str, str] | None:
    """A value and the ends of its 95 % interval; None where no interval is known or can be shown.

    Parameters
    ----------
    value : float
    std : float or None
    """
    if not std or not math.isfinite(std) or decimals(std) > _MOST_DECIMALS:
        return None
    low, high = value - NORMAL_95 * std, value + NORMAL_95 * std
    shown, lowest, highest = (f"{end:.{decimals(std)}f}" for end in (value, low, high))
    return shown, lowest, highest
