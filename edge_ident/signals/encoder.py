"""What a recorded position tells of its encoder: resolution and noise."""

from typing import Final

import numpy as np
from numpy.typing import NDArray

from edge_ident.signals.decimation import parts_of

Array = NDArray[np.float64]

_ALWAYS: Final = 0.9
"""Share of samples in which an axis moves, from which rounding is white noise."""
_MOTION: Final = 0.75
"""Noise by sixth differences over that by third ones, below which the third ones hold motion. Of
white noise and of counts that follow each other slowly, it is 0.95 to 1.05."""
_NO_ROUNDING: Final = 0.5
"""Noise over that of rounding, below which a position is not rounded."""


def position_noise(position: Array) -> float:
    """Standard deviation of white noise in a position, at least that of its quantization."""
    return count_and_noise(position)[1]


def encoder_count(position: Array) -> float:
    """Smallest step between values that a position takes, 0 where that is no count."""
    return count_and_noise(position)[0]


def count_and_noise(position: Array) -> tuple[float, float]:
    """`encoder_count` and `position_noise` of a position (N,), in less time than one by one."""
    white = _white_noise(position)
    count = _count(position, white)
    return count, max(white, count / float(np.sqrt(12.0)))


def _count(position: Array, white: float) -> float:
    """The smallest step, of a position with so much white noise.

    An axis that moves on all the time and never returns takes each value once. Its smallest step is
    that of the slowest sample. Rounding to counts of that size would show as noise.
    """
    parts, least = parts_of(position), 1e-9 * np.ptp(position)
    # a motion goes up and down for long: a merge sort takes an eighth of the time
    steps = np.concatenate([np.diff(np.sort(part, kind="stable")) for part in parts])
    count = float(np.min(np.where(steps > least, steps, np.inf)))
    if not np.isfinite(count):
        return 0.0
    changes = [np.count_nonzero(part[1:] != part[:-1]) / (len(part) - 1) for part in parts]
    moves = float(np.mean(changes)) > _ALWAYS
    rounding = count / np.sqrt(12.0)
    return 0.0 if moves and white < _NO_ROUNDING * rounding else count


def _white_noise(position: Array) -> float:
    """Third differences remove a slow motion and multiply white noise by √20.

    Sixth ones remove a faster motion, and multiply it by √924. Where they tell of decidedly less
    noise, the third hold motion.
    """
    third = [np.diff(part, 3) for part in parts_of(position)]
    noise = float(np.sqrt(np.mean([np.mean(part**2) for part in third]) / 20.0))
    sixth = [np.diff(part, 3) for part in third]
    without_motion = float(np.sqrt(np.mean([np.mean(part**2) for part in sixth]) / 924.0))
    return without_motion if without_motion < _MOTION * noise else noise
