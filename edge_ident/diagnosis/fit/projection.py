"""The linear algebra of the search: projection on what a model lacks, and points around shapes."""

from typing import Final

import numpy as np
from numpy.typing import NDArray
from scipy.stats import qmc

from edge_ident.diagnosis.fit.candidates import Candidate
from edge_ident.estimation.least_squares import unit_length
from edge_ident.model.effects import named

Array = NDArray[np.float64]

_OWN_SHARE: Final = 0.02
"""Of a column's length, below which it is another name for what the model has already."""
_TINY: Final = float(np.finfo(float).tiny)


def explained(
    candidate: Candidate, rows: Array, residual: Array, basis: Array
) -> tuple[Array, Array]:
    """Errors (D,) left by columns (D, k, n) at their best amplitudes (D, k); infinite where an
    amplitude is unphysical or the columns are nothing new."""
    residual = residual - basis @ (basis.T @ residual)
    total = float(residual @ residual)
    known, right = rows @ basis, rows @ residual
    gram = rows @ rows.transpose(0, 2, 1)
    whole = np.sqrt(np.einsum("dkk->dk", gram))
    # products of what no column of the basis holds already
    gram = gram - known @ known.transpose(0, 2, 1)
    length = np.sqrt(np.maximum(np.einsum("dkk->dk", gram), 0.0))
    if not candidate.form.linear:
        left = total - 2.0 * right[:, 0] + gram[:, 0, 0]
        return np.maximum(left, _TINY), np.ones((len(rows), 0))
    new = np.all(length > _OWN_SHARE * whole, axis=1) & np.all(length > 0.0, axis=1)
    scale = np.where(length > 0.0, length, 1.0)
    gram = gram / (scale[:, :, None] * scale[:, None, :])
    right = right / scale
    gram[~new] = np.eye(gram.shape[-1])
    new &= np.linalg.cond(gram) < _OWN_SHARE**-2
    gram[~new] = np.eye(gram.shape[-1])
    normalized = np.linalg.solve(gram, right[..., None])[..., 0]
    errors = total - np.einsum("dk,dk->d", normalized, right)
    amplitudes = normalized / scale
    bounds = named(candidate.effect).bounds
    low, high = np.array([bounds[name] for name in candidate.form.linear]).T
    physical = np.all((amplitudes >= low) & (amplitudes <= high), axis=1)
    return np.where(new & physical, np.maximum(errors, _TINY), np.inf), amplitudes


def orthonormal(jacobian: Array) -> Array:
    """Basis (n, R) of what the columns (n, P) of a jacobian span."""
    left, singular, _ = np.linalg.svd(unit_length(jacobian)[0], full_matrices=False)
    return np.asarray(left[:, singular > 1e-7 * singular[0]])


def _cube(shapes: int) -> Array:
    """Points (P, shapes) of a cube about zero, zero among them: a grid, or for many shapes evenly
    scattered ones."""
    if shapes <= 2:
        line = np.linspace(-1.0, 1.0, 9 if shapes == 1 else 5)
        return np.stack(np.meshgrid(*[line] * shapes, indexing="ij"), axis=-1).reshape(-1, shapes)
    scattered = qmc.Sobol(shapes, scramble=False).random_base2(6)
    return np.vstack([np.zeros(shapes), 2.0 * scattered - 1.0])


AROUND: Final = {shapes: _cube(shapes) for shapes in range(1, 7)}
"""Points to try around a set of shapes, by their number."""
