"""Projection of candidates on the part of the effort that a model leaves (variable projection)."""

from typing import Final

import numpy as np
from numpy.typing import NDArray
from scipy.stats import qmc

from edge_ident.diagnosis.fit.candidates import Candidate
from edge_ident.estimation.least_squares import unit_length
from edge_ident.model.effects import named

Array = NDArray[np.float64]

_NEW_SHARE: Final = 0.02
"""Length of the orthogonal component, of the regressor, below which the model has it already."""
_TINY: Final = float(np.finfo(float).tiny)


def projected_errors(
    candidate: Candidate, regressors: Array, residual: Array, basis: Array
) -> tuple[Array, Array]:
    """Errors and linear parameters of D regressors at their least-squares fit.

    Parameters
    ----------
    regressors : (D, k, n) array
        Of the candidate.
    residual : (n,) array
        Of the model that the candidate is added to.
    basis : (n, R) array
        Orthonormal; spans the model's Jacobian.

    Returns
    -------
    (D,) and (D, k) arrays
        Sums of squares, infinite for what is unphysical or nothing new; and the parameters.
    """
    residual = residual - basis @ (basis.T @ residual)
    total = float(residual @ residual)
    known, right = regressors @ basis, regressors @ residual
    gram = regressors @ regressors.transpose(0, 2, 1)
    whole = np.sqrt(np.einsum("dkk->dk", gram))
    # the Gram matrix of the components orthogonal to the basis
    gram = gram - known @ known.transpose(0, 2, 1)
    length = np.sqrt(np.maximum(np.einsum("dkk->dk", gram), 0.0))
    if not candidate.form.linear:
        left = total - 2.0 * right[:, 0] + gram[:, 0, 0]
        return np.maximum(left, _TINY), np.ones((len(regressors), 0))
    new = np.all(length > _NEW_SHARE * whole, axis=1) & np.all(length > 0.0, axis=1)
    scale = np.where(length > 0.0, length, 1.0)
    right = right / scale
    normalized, new = _solved(gram / (scale[:, :, None] * scale[:, None, :]), right, new)
    errors = np.maximum(total - np.einsum("dk,dk->d", normalized, right), _TINY)
    linear = normalized / scale
    bounds = named(candidate.effect).bounds
    low, high = np.array([bounds[name] for name in candidate.form.linear]).T
    physical = np.all((linear >= low) & (linear <= high), axis=1)
    return np.where(new & physical, errors, np.inf), linear


def _solved(gram: Array, right: Array, new: NDArray[np.bool_]) -> tuple[Array, NDArray[np.bool_]]:
    """Solve D normal equations (D, k, k), (D, k); the mask (D,) tells those that have a solution.

    Equations outside the mask, and ill-conditioned ones, are replaced by trivial ones.
    """
    gram[~new] = np.eye(gram.shape[-1])
    new = new & (np.linalg.cond(gram) < _NEW_SHARE**-2)
    gram[~new] = np.eye(gram.shape[-1])
    return np.asarray(np.linalg.solve(gram, right[..., None])[..., 0]), new


def orthonormal(jacobian: Array) -> Array:
    """Orthonormal basis (n, R) of the columns of a Jacobian (n, P)."""
    left, singular, _ = np.linalg.svd(unit_length(jacobian)[0], full_matrices=False)
    return np.asarray(left[:, singular > 1e-7 * singular[0]])


def _cube(dimensions: int) -> Array:
    """Points (P, dimensions) of a cube about zero, zero among them.

    One or two dimensions have a grid, more have a Sobol sequence.
    """
    if dimensions <= 2:
        line = np.linspace(-1.0, 1.0, 9 if dimensions == 1 else 5)
        mesh = np.meshgrid(*[line] * dimensions, indexing="ij")
        return np.stack(mesh, axis=-1).reshape(-1, dimensions)
    scattered = qmc.Sobol(dimensions, scramble=False).random_base2(6)
    return np.vstack([np.zeros(dimensions), 2.0 * scattered - 1.0])


AROUND: Final = {dimensions: _cube(dimensions) for dimensions in range(1, 7)}
"""Points to try around a set of nonlinear parameters, by their number."""
