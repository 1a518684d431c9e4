"""Numbers with their deviations, as text."""

import math
from typing import Final

# Deviation over value below which it is none of a measurement: a bound holds the value, or another
# number gives it.
_ROUNDING: Final = 1e-6


def with_deviation(value: float, std: float | None) -> str:
    """A value to four digits, and its standard deviation where that says anything.

    Examples
    --------
    >>> with_deviation(-0.8094, 0.012), with_deviation(-0.8094, 5.9e-12)
    ('-0.8094 ± 0.012', '-0.8094')
    """
    if std is None or not math.isfinite(std) or std < _ROUNDING * abs(value):
        return f"{value:.4g}"
    return f"{value:.4g} ± {std:.2g}"
