"""Columns of a linear model, decomposed once for all who ask of them."""

from functools import cached_property
from typing import Final

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

_RANK: Final = 1e-10
"""Singular value over the largest that counts as zero."""


class Columns:
    """A regressor, its columns of unit length, and their singular value decomposition.

    Parameters
    ----------
    values : (N, P) array

    Attributes
    ----------
    values : (N, P) array
    unit : (N, P) array
        Columns of unit length.
    length : (P,) array
        That they had; one for empty ones.
    """

    def __init__(self, values: Array) -> None:
        self.values = values
        self.unit, self.length = unit_length(values)

    @cached_property
    def svd(self) -> tuple[Array, Array, Array]:
        """Left singular vectors (N, P) of `unit`, singular values (P,), and right vectors (P, P)
        in rows."""
        left, singular, right = np.linalg.svd(self.unit, full_matrices=False)
        return left, singular, right

    def solved(self, effort: Array, rank: float = _RANK) -> Array:
        """Least-squares parameters (P,) of the unit columns for an effort (N,).

        Parameters
        ----------
        rank : float
            Singular value over the largest up to which a direction counts as zero.
        """
        left, singular, right = self.svd
        kept = singular > rank * singular[0]
        return np.asarray(right[kept].T @ ((left[:, kept].T @ effort) / singular[kept]))

    @cached_property
    def inverse(self) -> Array:
        """Inverse (P, P) of the unit columns' normal matrix."""
        _, singular, right = self.svd
        kept = singular > _RANK * singular[0]
        root = right[kept].T / singular[kept]
        return np.asarray(root @ root.T)

    @property
    def condition_number(self) -> float:
        """Condition number of the unit columns; infinite where one follows from the others."""
        singular = self.svd[1]
        return float(singular[0] / singular[-1]) if singular[-1] > 0.0 else float(np.inf)


def unit_length(regressor: Array) -> tuple[Array, Array]:
    """Columns (N, P) of unit length, and the lengths (P,) that they had; one for empty ones."""
    length = np.linalg.norm(regressor, axis=0)
    length = np.where(length > 0, length, 1.0)
    return regressor / length, length
