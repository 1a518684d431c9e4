"""In which unit time stamps are likely written."""

from typing import Final

import numpy as np
from numpy.typing import NDArray

TIME_UNITS: Final = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9}
"""Units in s, the coarsest first."""
TIME_WORDS: Final = {
    "s": "seconds", "ms": "milliseconds", "us": "microseconds", "ns": "nanoseconds",
}  # fmt: skip
_SLOW_S: Final = 0.1
"""Sampling period from which the unit is likelier a finer one."""
_FAST_S: Final = 2e-5
"""Sampling period of the fastest recordings of a drive."""
_SINCE_1970_S: Final = (1e9, 1e10)
"""Stamps of the years 2001 to 2286. What lies there in one unit lies there in no other."""


def likely_unit(time: NDArray[np.float64]) -> str:
    """The unit in which stamps (N,) have a plausible sampling period: s, ms, us or ns.

    Of several, that in which they are seconds since 1970, else the coarsest.
    """
    step = float(np.median(np.diff(time)))
    plausible = [text for text, factor in TIME_UNITS.items() if step * factor < _SLOW_S]
    low_s, high_s = _SINCE_1970_S
    dated = [text for text in plausible if low_s <= time[0] * TIME_UNITS[text] < high_s]
    return (*dated, *plausible, "ns")[0]


def only_plausible(step: float, text: str) -> bool:
    """Whether a drive is sampled at these steps in one unit of TIME_UNITS alone."""
    plausible = [t for t, factor in TIME_UNITS.items() if _FAST_S <= step * factor < _SLOW_S]
    return plausible == [text]
