"""Sinusoids of position or time, and what acts at one place."""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def wave(angle: Array, cosine: Array, sine: Array) -> Array:
    """cosine·cos(angle) + sine·sin(angle).

    A search asks for one amplitude after the other. One that is zero throughout costs nothing.
    """
    if not (sine.any() or cosine.any()):
        return np.zeros(())
    if not sine.any():
        return np.asarray(cosine * np.cos(angle))
    if not cosine.any():
        return np.asarray(sine * np.sin(angle))
    return np.asarray(cosine * np.cos(angle) + sine * np.sin(angle))


def bump(position: Array, size: Array, place: Array, width: Array) -> Array:
    """size·exp(-((position - place)/width)²)."""
    if not size.any():
        return np.zeros(())
    return np.asarray(size * np.exp(-np.square((position - place) / width)))
