"""Linear least squares inside physical bounds."""

from dataclasses import dataclass
from typing import Final

import numpy as np
import scipy.optimize
from numpy.typing import NDArray

from edge_ident.signals.conditioning import unit_length

Array = NDArray[np.float64]

_RANK: Final = 1e-9
_RIDGE: Final = 1e-6
"""Of columns of unit length: what cannot be told apart is small rather than huge and opposite."""


@dataclass(frozen=True)
class Bounded:
    """A least-squares solution inside bounds.

    Attributes
    ----------
    solution : (P,) array
    free : (P,) array of bool
        False at a bound that holds the parameter back.
    """

    solution: Array
    free: NDArray[np.bool_]


def solve(regressor: Array, target: Array) -> Array:
    """Least squares on columns of unit length; parameters that are not excited stay at zero.

    Parameters
    ----------
    regressor : (n, P) array
    target : (n,) array

    Returns
    -------
    (P,) array
    """
    unit, length = unit_length(regressor)
    return np.asarray((np.linalg.lstsq(unit, target, rcond=_RANK)[0].T / length).T)


def solve_within(regressor: Array, target: Array, low: Array, high: Array) -> Bounded:
    """Least squares inside bounds (bounded-variable least squares: Stark and Parker 1995).

    Parameters
    ----------
    regressor : (n, P) array
    target : (n,) array
    low, high : (P,) arrays
        Equal where a parameter is fixed.
    """
    open_ = low < high
    found = np.where(open_, 0.0, low)
    target = target - regressor @ found
    unit, length = unit_length(regressor[:, open_])
    triangular, reduced = _reduced(unit, target)
    optimum = np.linalg.lstsq(triangular, reduced, rcond=_RANK)[0] / length
    free = open_.copy()
    low, high = low[open_], high[open_]
    if np.all((optimum >= low) & (optimum <= high)):
        found[open_] = optimum
        return Bounded(found, free)
    ridge = _RIDGE * np.eye(len(length))
    inside = scipy.optimize.lsq_linear(
        np.vstack([triangular, ridge]),
        np.concatenate([reduced, np.zeros(len(length))]),
        (low * length, high * length),
        method="bvls",
    )
    # rounding must not leave the bounds
    found[open_] = np.clip(inside.x / length, low, high)
    free[open_] = inside.active_mask == 0
    return Bounded(found, free)


def _reduced(regressor: Array, target: Array) -> tuple[Array, Array]:
    """The same problem with as many rows as columns: R of the QR decomposition, and Qᵀ·target."""
    orthonormal, triangular = np.linalg.qr(regressor)
    return triangular, orthonormal.T @ target
