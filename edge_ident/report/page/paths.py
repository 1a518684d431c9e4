"""Signals as paths of SVG: lines of few enough points, clouds of dots, means over bins."""

from typing import Final

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

WIDTH: Final = 20_000
HEIGHT: Final = 4_000
"""Whole numbers across a plot: fine enough to enlarge it, short to write."""
_BUCKETS: Final = 2500
"""Parts of a line; each gives its lowest and its highest sample."""
_DOTS: Final = 450
_BINS: Final = 40
PER_BIN: Final = 15
"""Samples over which noise is averaged."""


def envelope(x: Array, y: Array, buckets: int = _BUCKETS) -> tuple[Array, Array]:
    """Lowest and highest sample of each of so many buckets, in their order of time.

    What sticks out stays visible, which thinning would lose. A bucket without a finite value gives
    two NaN, which break the line. Short signals are returned as they are.
    """
    each = -(-len(y) // buckets)
    if each <= 2:
        return x, y
    missing = -len(y) % each
    padded = np.concatenate([y, np.full(missing, np.nan)]).reshape(-1, each)
    empty = np.all(np.isnan(padded), axis=1)
    low = np.argmin(np.where(np.isnan(padded), np.inf, padded), axis=1)
    high = np.argmax(np.where(np.isnan(padded), -np.inf, padded), axis=1)
    both = np.sort(np.stack([low, high], axis=1), axis=1)
    index = np.minimum((both + each * np.arange(len(padded))[:, None]).ravel(), len(y) - 1)
    return x[index], np.where(np.repeat(empty, 2), np.nan, y[index])


def line_path(x: Array, y: Array) -> str:
    """A path through points between 0 and 1; a NaN breaks it. The second axis points upwards."""
    across, down = _whole(x, y)
    written: list[str] = []
    at: tuple[int, int] | None = None
    for column, row, seen in zip(across, down, np.isfinite(y), strict=True):
        if not seen:
            at = None
            continue
        step = (column - at[0], row - at[1]) if at else (column, row)
        if step != (0, 0) or not at:
            written.append(f"{'l' if at else 'M'}{step[0]} {step[1]}")
        at = (column, row)
    return "".join(written).replace(" -", "-")


def dots_path(x: Array, y: Array, dots: int = _DOTS) -> str:
    """Points between 0 and 1 as strokes without length, thinned out evenly."""
    thin = slice(None, None, max(1, -(-len(x) // dots)))
    across, down = _whole(x[thin], y[thin])
    return "".join(f"M{column} {row}h0" for column, row in zip(across, down, strict=True))


def means(x: Array, y: Array, per_bin: int = PER_BIN) -> tuple[Array, Array]:
    """Means over bins of equal width, of so many samples on average; scarce ones are left out."""
    if not len(x):
        return x, y
    bins = int(np.clip(len(x) // per_bin, 1, _BINS))
    edges = np.linspace(np.min(x), np.max(x), bins + 1)
    index = np.clip(np.searchsorted(edges, x, side="right") - 1, 0, bins - 1)
    count = np.bincount(index, minlength=bins)
    full = 3 * count >= per_bin
    found = [np.bincount(index, weights=of, minlength=bins)[full] / count[full] for of in (x, y)]
    return found[0], found[1]


def _whole(x: Array, y: Array) -> tuple[list[int], list[int]]:
    shown = np.clip(np.nan_to_num(y), -1.0, 2.0)
    across = np.rint(WIDTH * x).astype(int).tolist()
    return across, np.rint(HEIGHT * (1.0 - shown)).astype(int).tolist()
