"""The library of a search: regressors of all candidates at the points of their grids.

They stand below each other. So a few products of matrices score all candidates on a residual. What
does not depend on the residual is computed once for every model, and what does not depend on the
model once for every column of one.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from itertools import groupby, pairwise
from typing import Final, NamedTuple, Self

import numpy as np
from numpy.typing import NDArray

from edge_ident.diagnosis.fit.candidates import Candidate
from edge_ident.diagnosis.fit.projection import Orthogonal, bounds_of
from edge_ident.signals.conditioning import unit_length

Array = NDArray[np.float64]
Grid = Mapping[str, Array]
"""Values of a candidate's nonlinear parameters by name, arrays (D,)."""
Fits = Mapping[Candidate, tuple[Array, Array]]
"""Of candidates at D points each: errors (D,) and linear parameters (D, k)."""

_TOLD_APART: Final = 1e4
"""Largest condition number of a model's columns with which products with them, and not with a basis
of them, are as good but for rounding."""


class _Alike(NamedTuple):
    """Candidates with the same number k of linear parameters, whose rows stand together.

    Attributes
    ----------
    points : mapping of Candidate to slice
        Points of each, among the D of all.
    rows : slice
    gram : (D, k, k) array
        Scalar products of the regressors at each point.
    low, high : (D, k) arrays
        Bounds of the linear parameters; (D, 0) for forms without any.
    """

    points: Mapping[Candidate, slice]
    rows: slice
    gram: Array
    low: Array
    high: Array


@dataclass(frozen=True)
class Stack:
    """Regressors of candidates at the valid samples.

    Attributes
    ----------
    rows : (L, n) array
        The k regressors of a candidate at each of its points, candidate after candidate.
    blocks : tuple of _Alike
    cache : dict
        Components orthogonal to models that were projected on before, by model; and products with
        columns of models, by column.
    """

    rows: Array
    blocks: tuple[_Alike, ...]
    cache: dict[object, tuple[Orthogonal, ...]] = field(default_factory=dict, compare=False)
    products: dict[bytes, Array] = field(default_factory=dict, compare=False)

    @classmethod
    def of(cls, regressors: Mapping[Candidate, Array]) -> Self:
        """From regressors (D, k, n) of every candidate."""
        ordered = sorted(regressors, key=_linear_count)
        rows = np.concatenate([regressors[c].reshape(-1, regressors[c].shape[2]) for c in ordered])
        blocks, first = [], 0
        for _, alike in groupby(ordered, key=_linear_count):
            parts = {c: regressors[c] for c in alike}
            blocks.append(_alike(parts, first))
            first = blocks[-1].rows.stop
        return cls(rows, tuple(blocks))

    def of_candidate(self, candidate: Candidate) -> Array:
        """Its regressors (D, k, n)."""
        block = next(b for b in self.blocks if candidate in b.points)
        _, count, _ = block.gram.shape
        rows = self.rows[block.rows].reshape(-1, count, self.rows.shape[1])
        return rows[block.points[candidate]]

    def fits(self, basis: Array, jacobian: Array, left: Array, key: object) -> Fits:
        """See `Library.fits`."""
        total, products, found = float(left @ left), self.rows @ left, {}
        for block, part in zip(self.blocks, self._orthogonal(basis, jacobian, key), strict=True):
            product = products[block.rows].reshape(block.gram.shape[:2])
            errors, linear = part.fit(product, total, block.low, block.high)
            found.update({c: (errors[at], linear[at]) for c, at in block.points.items()})
        return found

    def _orthogonal(self, basis: Array, jacobian: Array, key: object) -> tuple[Orthogonal, ...]:
        """The components of the regressors of each block that are orthogonal to a basis."""
        if key in self.cache:
            return self.cache[key]
        known = self.rows @ basis if key is None else self._known(basis, jacobian)
        found = tuple(
            Orthogonal.of(b.gram, known[b.rows].reshape(*b.gram.shape[:2], -1)) for b in self.blocks
        )
        if key is not None:
            self.cache[key] = found
        return found

    def _known(self, basis: Array, jacobian: Array) -> Array:
        """Products (L, R) with a basis, from those with the columns of the Jacobian."""
        unit, _ = unit_length(jacobian)
        turned = basis.T @ unit
        if np.linalg.cond(turned) > _TOLD_APART:
            return np.asarray(self.rows @ basis)
        products = np.stack([self._product(column) for column in unit.T], axis=1)
        return np.asarray(products @ np.linalg.pinv(turned))

    def _product(self, column: Array) -> Array:
        """Products (L,) with a column (n,) that many models have."""
        key = column.tobytes()
        if key not in self.products:
            self.products[key] = self.rows @ column
        return self.products[key]


@dataclass(frozen=True)
class Library:
    """Regressors of candidates at the points of their grids, and at more points.

    Attributes
    ----------
    points : mapping of Candidate to Grid
        Nonlinear parameters at D points of each candidate.
    stacks : tuple of Stack
        The regressors there, and those at points that were added later.
    whole : dict
        Regressors (D, k, n) of candidates that were asked for.
    """

    points: Mapping[Candidate, Grid]
    stacks: tuple[Stack, ...]
    whole: dict[Candidate, Array] = field(default_factory=dict, compare=False)

    @classmethod
    def of(cls, points: Mapping[Candidate, Grid], regressors: Mapping[Candidate, Array]) -> Self:
        """From regressors (D, k, n) of every candidate."""
        return cls(points, (Stack.of(regressors),))

    def __iter__(self) -> Iterator[Candidate]:
        return iter(self.points)

    def __contains__(self, candidate: object) -> bool:
        return candidate in self.points

    def __getitem__(self, candidate: Candidate) -> Array:
        """Regressors (D, k, n) of a candidate."""
        if candidate not in self.whole:
            parts = [
                stack.of_candidate(candidate)
                for stack in self.stacks
                if any(candidate in block.points for block in stack.blocks)
            ]
            self.whole[candidate] = parts[0] if len(parts) == 1 else np.concatenate(parts)
        return self.whole[candidate]

    def with_points(
        self, points: Mapping[Candidate, Grid], regressors: Mapping[Candidate, Array]
    ) -> Self:
        """The same with more points, and the regressors there, of some candidates."""
        if not points:
            return self
        every = dict(self.points)
        for candidate, more in points.items():
            every[candidate] = {
                name: np.concatenate([values, more[name]])
                for name, values in every[candidate].items()
            }
        return type(self)(every, (*self.stacks, Stack.of(regressors)))

    def at(self, kept: NDArray[np.bool_]) -> Self:
        """The same at fewer of the samples (n,)."""
        if np.all(kept):
            return replace(self)
        return self.of(self.points, {c: self[c][..., kept] for c in self})

    def fits(self, basis: Array, jacobian: Array, left: Array, key: object) -> Fits:
        """Every candidate at each of its points, fitted to the residual of a model.

        Parameters
        ----------
        basis : (n, R) array
            Orthonormal; it spans the same as the Jacobian.
        jacobian : (n, P) array
        left : (n,) array
            The residual, orthogonal to the basis.
        key : object
            What makes the basis: what is computed is kept for the next one of the same key. None
            keeps nothing.
        """
        first, *more = (stack.fits(basis, jacobian, left, key) for stack in self.stacks)
        found = dict(first)
        for fits in more:
            for candidate, added in fits.items():
                errors, linear = zip(found[candidate], added, strict=True)
                found[candidate] = np.concatenate(errors), np.concatenate(linear)
        return found


def _linear_count(candidate: Candidate) -> int:
    return len(candidate.form.linear)


def _alike(regressors: Mapping[Candidate, Array], first: int) -> _Alike:
    """The block of candidates with regressors (D, k, n), whose rows begin at the first."""
    grams = [x @ x.transpose(0, 2, 1) for x in regressors.values()]
    ends = np.cumsum([0, *map(len, grams)]).tolist()
    points = {c: slice(*of) for c, of in zip(regressors, pairwise(ends), strict=True)}
    bounds = [np.tile(bounds_of(c), (len(g), 1, 1)) for c, g in zip(regressors, grams, strict=True)]
    low, high = np.concatenate(bounds).swapaxes(0, 1)
    gram = np.concatenate(grams)
    return _Alike(points, slice(first, first + gram[..., 0].size), gram, low, high)
