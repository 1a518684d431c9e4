"""Samples of a recording that say nothing: read before a pause and stamped after it, or clipped."""

from typing import Final

import numpy as np
from numpy.typing import NDArray

from edge_ident.signals.metrics import quantile

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

_PAUSE: Final = 2.0
"""Sampling periods from one stamp to the next, from which a recorder paused."""
_SELDOM: Final = 0.02
"""Share of pauses from which the sampling is uneven by nature, and no recorder paused."""
_AT_PEAK: Final = 0.005
"""Share of a record at exactly its highest or lowest effort, from which it is clipped."""
_PILE: Final = 5.0
"""Samples at the peak over those at each of the next levels. A sinusoid in counts reaches 3."""
_NEXT_LEVELS: Final = 3
_FEWEST_LEVELS: Final = 20
"""Different values of an effort, up to which its levels are those of a command."""


def stale(time_s: Array) -> Mask:
    """Rows (N,) that end a pause of the time stamps.

    A recorder that is held up has often read the position already and stamps it when it goes on.
    So the row that ends a pause may be as old as the pause is long.
    """
    steps = np.diff(time_s)
    ends = np.concatenate([[False], steps > _PAUSE * quantile(steps, 0.5)])
    ends[-1] = False
    return ends if np.mean(ends) < _SELDOM else np.zeros(len(ends), dtype=np.bool_)


def clipped(effort: Array) -> Mask:
    """Samples (N,) at exactly the highest or the lowest effort, where many are.

    The effort that the axis needed there is unknown. A command that takes a few levels only is not
    clipped.
    """
    found = np.zeros(len(effort), dtype=np.bool_)
    for sign, peak in ((1.0, np.max(effort)), (-1.0, np.min(effort))):
        if np.count_nonzero(effort == peak) <= _AT_PEAK * len(effort):
            continue
        levels, counts = np.unique(sign * effort, return_counts=True)
        if len(levels) < _FEWEST_LEVELS:
            return found
        beside = float(np.mean(counts[-1 - _NEXT_LEVELS : -1]))
        if counts[-1] > max(_AT_PEAK * len(effort), _PILE * beside):
            found |= sign * effort == levels[-1]
    return found
