"""Tables and bounds of the control law, for a number or for arrays of them.

Where a value is not a number it counts as the lower bound, as C's fmaxf takes it.
"""

import math
from types import ModuleType
from typing import Any

import numpy as np


def bounded(value: Any, lowest: float, highest: float, functions: ModuleType) -> Any:
    """The value, or the bound that it is beyond.

    Parameters
    ----------
    value : float or array
    lowest, highest : float
    functions : module
        `math`, or numpy for arrays; so in the functions below.
    """
    if functions is math:
        return min(max(lowest, value), highest)
    return np.fmin(np.fmax(value, lowest), highest)


def chosen(condition: Any, then: Any, otherwise: Any, functions: ModuleType) -> Any:
    """One of two values."""
    if functions is math:
        return then if condition else otherwise
    return np.where(condition, then, otherwise)


def interpolated(table: Any, at: Any, functions: ModuleType) -> Any:
    """A table's value between its entries; it falls to zero over one cell beyond its ends.

    Parameters
    ----------
    table : tuple, or (K, ...) array
        Behind the entries come the axes of drives, where each has a table of its own.
    at : float or array
        Number of the entry, and share of the way to the next.
    """
    at = bounded(at, -1.0, len(table), functions)
    cell = functions.floor(at)
    share = at - cell
    return (1.0 - share) * _entry(table, cell, functions) + share * _entry(
        table, cell + 1, functions
    )


def _entry(table: Any, number: Any, functions: ModuleType) -> Any:
    """Entry of a table; zero outside it."""
    if functions is math:
        return table[number] if 0 <= number < len(table) else 0.0
    rows = np.asarray(table)
    index = np.clip(number, 0, len(rows) - 1).astype(np.intp)
    if rows.ndim == 1:
        found = rows[index]
    else:
        shape = np.broadcast_shapes(index.shape, rows.shape[1:])
        found = np.take_along_axis(rows, np.broadcast_to(index, shape)[None], axis=0)[0]
    return np.where((number >= 0) & (number < len(rows)), found, 0.0)
