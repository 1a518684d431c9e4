"""Linear least squares: inside bounds, and beside columns that are taken out."""

from dataclasses import dataclass
from functools import cache
from typing import Final, Self

import numpy as np
import scipy.optimize
from numpy.typing import NDArray

from edge_ident.diagnosis.fit.candidates import Candidate
from edge_ident.model.effects import named
from edge_ident.signals.conditioning import unit_length

Array = NDArray[np.float64]


# Linear least squares inside physical bounds.

_RANK: Final = 1e-9
_RIDGE: Final = 1e-6
"""Of columns of unit length: what cannot be told apart is small rather than huge and opposite."""


@dataclass(frozen=True)
class Bounded:
    """A least-squares solution inside bounds.

    Attributes
    ----------
    free : (P,) array of bool
        False at a bound that holds the parameter back.
    """

    solution: Array
    free: NDArray[np.bool_]


def solve(regressor: Array, target: Array) -> Array:
    """Least squares on columns of unit length; parameters that are not excited stay at zero."""
    unit, length = unit_length(regressor)
    return np.asarray((np.linalg.lstsq(unit, target, rcond=_RANK)[0].T / length).T)


def solve_within(regressor: Array, target: Array, low: Array, high: Array) -> Bounded:
    """Least squares inside bounds (bounded-variable least squares: Stark and Parker 1995).

    Parameters
    ----------
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


# Projection of candidates on the part of the effort that a model leaves (variable projection).


_NEW_SHARE: Final = 0.02
"""Length of the orthogonal component, of the regressor, below which the model has it already."""
_TINY: Final = float(np.finfo(float).tiny)


@dataclass(frozen=True)
class Orthogonal:
    """The components of D regressors, k each, that are orthogonal to a model's Jacobian.

    Attributes
    ----------
    energy : (D,) array
        Squared length of the first of the k.
    length : (D, k) array
        One where nothing is left.
    inverse : (D, k, k) array
        Of the Gram matrix of the components at unit length.
    new : (D,) array of bool
        Whether the model has none of them already, and they differ from each other.
    """

    energy: Array
    length: Array
    inverse: Array
    new: NDArray[np.bool_]

    @classmethod
    def of(cls, gram: Array, known: Array) -> Self:
        """From scalar products: the Gram matrix (D, k, k) of whole regressors, and the products
        (D, k, R) with an orthonormal basis that spans the Jacobian."""
        whole = np.sqrt(np.einsum("dkk->dk", gram))
        gram = gram - known @ known.transpose(0, 2, 1)
        energy = np.einsum("dkk->dk", gram)
        length = np.sqrt(np.maximum(energy, 0.0))
        new = np.all(length > _NEW_SHARE * whole, axis=1) & np.all(length > 0.0, axis=1)
        length = np.where(length > 0.0, length, 1.0)
        inverse, new = _inverse(gram / (length[:, :, None] * length[:, None, :]), new)
        return cls(energy[:, 0], length, inverse, new)

    def fit(self, right: Array, total: float, low: Array, high: Array) -> tuple[Array, Array]:
        """Errors and linear parameters of the D regressors at their least-squares fit.

        Parameters
        ----------
        right : (D, k) array
            Scalar products with the residual of the model, orthogonal to its Jacobian.
        total : float
            Energy of this residual.
        low, high : (k,) or (D, k) arrays
            Bounds of the linear parameters; empty for forms without any.

        Returns
        -------
        (D,) and (D, k) arrays
            Sums of squares, infinite for what is unphysical or nothing new; and the parameters.
        """
        if not low.size:
            left = total - 2.0 * right[:, 0] + self.energy
            return np.maximum(left, _TINY), np.ones((len(right), 0))
        right = right / self.length
        normalized = np.einsum("dkl,dl->dk", self.inverse, right)
        errors = np.maximum(total - np.einsum("dk,dk->d", normalized, right), _TINY)
        linear = normalized / self.length
        physical = np.all((linear >= low) & (linear <= high), axis=1)
        return np.where(self.new & physical, errors, np.inf), linear


@cache
def bounds_of(candidate: Candidate) -> Array:
    """Lowest and highest linear parameters of a candidate, (2, k)."""
    bounds = named(candidate.effect).bounds
    return np.array([bounds[name] for name in candidate.form.linear]).reshape(-1, 2).T


def _inverse(gram: Array, new: NDArray[np.bool_]) -> tuple[Array, NDArray[np.bool_]]:
    """Inverses of D Gram matrices (D, k, k); the mask (D,) tells those that have one.

    Matrices outside the mask, and ill-conditioned ones, are replaced by the identity.
    """
    if gram.shape[-1] == 1:
        return np.ones_like(gram), new
    gram[~new] = np.eye(gram.shape[-1])
    size = np.abs(np.linalg.eigvalsh(gram))
    new = new & (np.max(size, axis=1) < _NEW_SHARE**-2 * np.min(size, axis=1))
    gram[~new] = np.eye(gram.shape[-1])
    return np.asarray(np.linalg.inv(gram)), new


def orthonormal(jacobian: Array) -> Array:
    """Orthonormal basis (n, R) of the columns of a Jacobian (n, P)."""
    left, singular, _ = np.linalg.svd(unit_length(jacobian)[0], full_matrices=False)
    return np.asarray(left[:, singular > 1e-7 * singular[0]])
