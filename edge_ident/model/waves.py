"""Sinusoids of position or time, and what acts at one place."""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


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
