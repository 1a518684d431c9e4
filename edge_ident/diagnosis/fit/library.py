"""The library of a search: regressors of all candidates at the points of their grids.

They stand below each other. So one product of matrices scores all candidates on a residual. What
does not depend on the residual is computed once for every model.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from typing import Self

import numpy as np
from numpy.typing import NDArray

from edge_ident.diagnosis.fit.candidates import Candidate
from edge_ident.diagnosis.fit.projection import Orthogonal

Array = NDArray[np.float64]
Grid = Mapping[str, Array]
"""Values of a candidate's nonlinear parameters by name, arrays (D,)."""


@dataclass(frozen=True)
class Library:
    """Regressors of candidates at the valid samples.

    Attributes
    ----------
    points : mapping of Candidate to Grid
        Nonlinear parameters at D points of each candidate.
    rows : (L, n) array
        Its k regressors at each of the points, candidate after candidate.
    places : mapping of Candidate to slice
        Rows of each.
    grams : mapping of Candidate to (D, k, k) array
        Scalar products of its regressors at each point.
    cache : dict
        Components orthogonal to models that were projected on before.
    """

    points: Mapping[Candidate, Grid]
    rows: Array
    places: Mapping[Candidate, slice]
    grams: Mapping[Candidate, Array]
    cache: dict[object, Mapping[Candidate, Orthogonal]] = field(default_factory=dict, compare=False)

    @classmethod
    def of(cls, points: Mapping[Candidate, Grid], regressors: Mapping[Candidate, Array]) -> Self:
        """From regressors (D, k, n) of every candidate."""
        return cls._stacked(points, regressors, {c: _gram(x) for c, x in regressors.items()})

    @classmethod
    def _stacked(
        cls,
        points: Mapping[Candidate, Grid],
        regressors: Mapping[Candidate, Array],
        grams: Mapping[Candidate, Array],
    ) -> Self:
        places, last = {}, 0
        for candidate, part in regressors.items():
            first, last = last, last + part.shape[0] * part.shape[1]
            places[candidate] = slice(first, last)
        rows = np.concatenate([part.reshape(-1, part.shape[2]) for part in regressors.values()])
        return cls(points, rows, places, grams)

    def __iter__(self) -> Iterator[Candidate]:
        return iter(self.places)

    def __contains__(self, candidate: object) -> bool:
        return candidate in self.places

    def __getitem__(self, candidate: Candidate) -> Array:
        """Regressors (D, k, n) of a candidate."""
        points, count, _ = self.grams[candidate].shape
        return self.rows[self.places[candidate]].reshape(points, count, -1)

    def with_points(
        self, points: Mapping[Candidate, Grid], regressors: Mapping[Candidate, Array]
    ) -> Self:
        """The same with more points, and the regressors there, of some candidates."""
        together = {c: self[c] for c in self}
        every, grams = dict(self.points), dict(self.grams)
        for candidate, part in regressors.items():
            together[candidate] = np.concatenate([together[candidate], part])
            grams[candidate] = np.concatenate([grams[candidate], _gram(part)])
            every[candidate] = {
                name: np.concatenate([values, points[candidate][name]])
                for name, values in every[candidate].items()
            }
        return self._stacked(every, together, grams)

    def at(self, kept: NDArray[np.bool_]) -> Self:
        """The same at fewer of the samples (n,)."""
        if np.all(kept):
            return replace(self)
        return self.of(self.points, {c: self[c][..., kept] for c in self})

    def orthogonal(self, basis: Array, key: object) -> Mapping[Candidate, Orthogonal]:
        """The components of all regressors that are orthogonal to a basis (n, R).

        Parameters
        ----------
        key : object
            What makes the basis: they are kept for the next one of the same key. None keeps
            nothing.
        """
        if key in self.cache:
            return self.cache[key]
        known = self.rows @ basis
        found = {}
        for candidate, gram in self.grams.items():
            points, count, _ = gram.shape
            part = known[self.places[candidate]].reshape(points, count, -1)
            found[candidate] = Orthogonal.of(gram, part)
        if key is not None:
            self.cache[key] = found
        return found

    def products(self, residual: Array) -> Mapping[Candidate, Array]:
        """Scalar products (D, k) of all regressors with a residual (n,)."""
        products = self.rows @ residual
        return {c: products[self.places[c]].reshape(g.shape[:2]) for c, g in self.grams.items()}


def _gram(regressors: Array) -> Array:
    """Scalar products (D, k, k) of regressors (D, k, n)."""
    return np.asarray(regressors @ regressors.transpose(0, 2, 1))
