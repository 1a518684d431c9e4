"""Sinusoids of position or time, powers, and what acts at one place."""

from functools import reduce
from typing import Final

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

TURNS_RAD: Final = (2.0 * np.pi, np.pi)
"""Periods of what repeats once or twice per turn."""


def wave(angle: Array, cosine: Array, sine: Array) -> Array:
    """cosine·cos(angle) + sine·sin(angle). One without amplitude costs nothing."""
    if not (sine.any() or cosine.any()):
        return np.zeros(())
    half = np.tan(0.5 * angle)
    below = half * half
    below += 1.0
    # in place: new memory takes longer than what is computed there
    found = np.asarray(2.0 * cosine + 2.0 * sine * half)
    found /= below
    found -= cosine
    return found


def cosine_and_sine(angle: Array) -> tuple[Array, Array]:
    """Both, from the tangent of half the angle: numpy computes that several times as fast as either
    where the processor has wide vectors, and as fast as both where it has not."""
    half = np.tan(0.5 * angle)
    share = half * half
    share += 1.0
    share = 2.0 / share
    half *= share
    share -= 1.0
    return share, half


def bump(position: Array, size: Array, place: Array, width: Array) -> Array:
    """size·exp(-((position - place)/width)²)."""
    if not size.any():
        return np.zeros(())
    return np.asarray(size * np.exp(-np.square((position - place) / width)))


def polynomial(x: Array, *coefficients: Array) -> Array:
    """Powers of x from the first on. One without coefficients costs nothing."""
    if not any(one.any() for one in coefficients):
        return np.zeros(())
    *lower, found = coefficients
    for one in reversed(lower):
        found = one + found * x
    return found * x


def added(*parts: Array) -> Array:
    """Their sum. What is no more than a zero takes no pass over all samples."""
    found = [part for part in parts if part.ndim or part]
    return reduce(np.add, found) if found else np.zeros(())
