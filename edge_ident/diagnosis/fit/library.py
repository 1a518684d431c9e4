"""The library of a search: regressors of all candidates at the points of their grids.

They stand below each other. So a few products of matrices score all candidates on a residual. What
does not depend on the model is computed once for every column of one.
"""

import math
from collections.abc import Iterator, Mapping, Set
from dataclasses import dataclass, field
from functools import cached_property
from itertools import groupby
from typing import Final, Self

import numpy as np
from numpy.typing import NDArray

from edge_ident.diagnosis.fit.candidates import (
    Candidate,
    adds,
    beside_key,
    point_key,
    regressors,
    term,
)
from edge_ident.diagnosis.fit.fitting import FittedModel, FittedTerm, additive
from edge_ident.diagnosis.fit.linear import Orthogonal, bounds_of, orthonormal
from edge_ident.diagnosis.prepare.axis_data import AxisData
from edge_ident.model.effect import Effect
from edge_ident.model.effects import named
from edge_ident.model.inverse import along_motion
from edge_ident.model.model import PARAMETERS, AxisModel, Term
from edge_ident.model.motion import Values
from edge_ident.signals.conditioning import unit_length

Array = NDArray[np.float64]


Grid = Mapping[str, Array]
"""Values of a candidate's nonlinear parameters by name, arrays (D,)."""
_RIDGE: Final = 1e-9
"""On the Gram matrix of regressors of unit length."""
_MOST: Final = 1e9
"""Factor on the error of an actuator that follows no command, where a number is needed."""
_TOLD_APART: Final = 1e4
"""Largest condition number of a model's columns with which products with them, and not with a basis
of them, are as good but for rounding."""


@dataclass(frozen=True)
class Library:
    """Regressors of candidates at the points of their grids.

    Attributes
    ----------
    data : AxisData
    axis : AxisModel
        The base model.
    points : mapping of Candidate to Grid
        Nonlinear parameters at D points of each candidate.
    rows : mapping of Candidate to (D, k, n) array
        The regressors there, at the valid samples; candidates with as many linear parameters stand
        together.
    products : dict
        Products with columns that many models have, by column.
    """

    data: AxisData
    axis: AxisModel
    points: Mapping[Candidate, Grid]
    rows: Mapping[Candidate, Array]
    products: dict[bytes, Array] = field(default_factory=dict, compare=False)

    @classmethod
    def of(
        cls,
        data: AxisData,
        axis: AxisModel,
        points: Mapping[Candidate, Grid],
        before: Self | None = None,
    ) -> Self:
        """Of all candidates; what an earlier library has is taken over."""
        rows = {
            c: before.rows[c]
            if before is not None and before._holds(data, axis, c, grid)
            else grid_rows(data, axis, c, grid)
            for c, grid in points.items()
        }
        together = sorted(rows, key=lambda c: len(c.form.linear))
        return cls(data, axis, points, {c: rows[c] for c in together})

    def _holds(self, data: AxisData, axis: AxisModel, candidate: Candidate, grid: Grid) -> bool:
        """Whether the regressors of a candidate follow from the motion, and neither this nor the
        grid, the valid samples or what they depend on changed."""
        if candidate not in self.rows or not named(candidate.effect).additive:
            return False
        before = self.points[candidate]
        alike = before.keys() == grid.keys() and all(
            np.array_equal(before[name], grid[name]) for name in grid
        )
        keys = (beside_key(of, candidate)[0] for of in (self.axis, axis))
        return alike and len(set(keys)) == 1 and _same_motion(self.data, data)

    def __iter__(self) -> Iterator[Candidate]:
        return iter(self.points)

    @cached_property
    def _groups(self) -> list[tuple[list[Candidate], Array, Array]]:
        """Candidates with k linear parameters each, for every k; scalar products (D, k, k) of the
        regressors at all their D points, and the bounds (2, D, k) there."""
        groups = []
        for _, alike in groupby(self.rows, key=lambda c: len(c.form.linear)):
            group = list(alike)
            grams = [x @ x.transpose(0, 2, 1) for x in map(self.rows.__getitem__, group)]
            bounds = [np.repeat(bounds_of(c)[:, None], len(self.rows[c]), axis=1) for c in group]
            groups.append((group, np.concatenate(grams), np.concatenate(bounds, axis=1)))
        return groups

    def fits(self, subspace: "ResidualSubspace") -> dict[Candidate, tuple[Array, Array]]:
        """Errors (D,) and linear parameters (D, k) of every candidate at each of its D points,
        fitted to the residual of a model."""
        found: dict[Candidate, tuple[Array, Array]] = {}
        left, first = subspace.left, 0
        total, (products, known) = float(left @ left), self._products(subspace)
        for group, gram, bounds in self._groups:
            at, shape = slice(first, first + gram[..., 0].size), gram.shape[:2]
            component = Orthogonal.of(gram, known[at].reshape(*shape, -1))
            fits = component.fit(products[at].reshape(shape), total, *bounds)
            ends = np.cumsum([len(self.rows[c]) for c in group])[:-1]
            of_each = zip(*(np.split(part, ends) for part in fits), strict=True)
            found.update(zip(group, of_each, strict=True))
            first = at.stop
        return found

    def _products(self, subspace: "ResidualSubspace") -> tuple[Array, Array]:
        """Products of the L regressors with the residual, (L,), and with a basis, (L, R); where
        efforts add up, the latter follow from those with the columns of the Jacobian, which other
        models have, too."""
        left, basis = subspace.left[:, None], subspace.basis
        unit, _ = unit_length(subspace.jacobian)
        turned = basis.T @ unit
        if not subspace.adds_up or np.linalg.cond(turned) > _TOLD_APART:
            found = self._times(np.hstack([left, basis]))
            return found[:, 0], found[:, 1:]
        keys = [column.tobytes() for column in unit.T]
        each = zip(keys, unit.T, strict=True)
        new = {key: column for key, column in each if key not in self.products}
        found = self._times(np.column_stack([left, *new.values()]))
        self.products.update(zip(new, found[:, 1:].T.copy(), strict=True))
        known = np.stack([self.products[key] for key in keys], axis=1)
        return found[:, 0], np.asarray(known @ np.linalg.pinv(turned))

    def _times(self, columns: Array) -> Array:
        """Products (L, K) of all regressors with columns (n, K), in one pass over the regressors:
        these are many."""
        return np.concatenate([x.reshape(-1, x.shape[-1]) @ columns for x in self.rows.values()])


# What it costs a model that its actuator ignores commands.


_SLIGHT: Final = 1e-6
"""Relative change of a command that tells whether the actuator follows it."""
_MOST_IGNORED: Final = 0.4
"""Share of ignored samples from which the actuator follows no command at all."""
_TINY: Final = float(np.finfo(float).tiny)
_ROUNDING: Final = float(np.finfo(float).eps)


def ignored_command_penalty(data: AxisData, added: Term) -> Array:
    """Factor (D,) on the error of a model whose actuator ignores commands; one for all others.

    The effort that the actuator withholds is read from the effort itself. No motion predicts it.
    So each such sample is a free parameter and is penalized like one; or it may be anything in the
    range of those that are ignored, where any other command has the density of noise. The shorter
    description counts: a narrow deadband leaves little free.

    What is left for the motion to explain is the effort that arrives. The error counts as a share
    of that: a deadband as wide as an effort of two levels would leave nothing, and explain nothing.
    """
    effect = named(added.effect)
    if not effect.overrides("withheld"):
        return np.ones(1)
    share, width, arriving = _ignored(data, effect, along_motion(added))
    noise = min(s.effort_noise for s in data.segments)
    as_wide = math.sqrt(2.0 * math.pi * math.e) * max(noise, _TINY)  # as entropic as noise
    in_range = 2.0 * np.log(np.maximum(width / as_wide, 1.0))
    each = np.minimum(np.log(np.count_nonzero(data.valid)), in_range)
    factor = np.exp(share * each) / np.maximum(arriving, _ROUNDING)
    return np.asarray(np.where(share < _MOST_IGNORED, factor, np.inf))


def _ignored(data: AxisData, effect: Effect, values: Values) -> tuple[Array, Array, Array]:
    """Share (D,) of the samples at which an actuator ignores commands, the width (D,) of the range
    of what it withholds there, and the share (D,) of the variance that arrives, computed once."""
    key = (effect.name, *(value.tobytes() for value in values.values()))

    def found() -> Array:
        parts = [_ignored_in(s.raw_effort, effect, values) for s in data.segments]
        ignores, withheld = (np.concatenate(part, axis=-1) for part in zip(*parts, strict=True))
        low = np.min(np.where(ignores, withheld, np.inf), axis=-1)
        high = np.max(np.where(ignores, withheld, -np.inf), axis=-1)
        commanded = np.concatenate([s.raw_effort for s in data.segments])
        arriving = np.var(commanded - withheld, axis=-1) / max(float(np.var(commanded)), _TINY)
        return np.array(
            [np.mean(ignores, axis=-1), np.maximum(high - low, 0.0), np.minimum(arriving, 1.0)]
        )

    share, width, arriving = data.once(key, found)
    return share, width, arriving


def _ignored_in(raw: Array, effect: Effect, values: Values) -> tuple[NDArray[np.bool_], Array]:
    """Where an actuator ignores a command (M,), and what it withholds, (D, M) each."""
    more = _SLIGHT * raw
    withheld = np.atleast_2d(effect.withheld(raw, values))
    change = effect.withheld(raw + more, values) - withheld
    return np.abs(change) > 0.5 * np.abs(more), withheld


# Regressors at the points of grids, and those that an earlier search or step computed.


def grid_rows(data: AxisData, axis: AxisModel, candidate: Candidate, grid: Grid) -> Array:
    """Regressors (D, k, n) of a candidate at the points of its grid, at the valid samples."""
    return regressors(data, axis, candidate, grid)[..., data.valid]


def kept_rows(data: AxisData, axis: AxisModel, candidate: Candidate, points: Grid) -> Array:
    """Regressors (D, k, n) of a candidate at D points, at the valid samples. Those that are not
    kept yet are computed together, and kept (`cached_regressors`)."""
    beside, needed = beside_key(axis, candidate)
    each = zip(*points.values(), strict=True)
    keys = [point_key(beside, dict(zip(points, point, strict=True))) for point in each]
    new = [place for place, key in enumerate(keys) if key not in data.cache]
    if new:
        found = regressors(data, needed, candidate, {k: v[new] for k, v in points.items()})
        data.cache.update(zip((keys[place] for place in new), found, strict=True))
    return np.stack([data.cache[key] for key in keys])[..., data.valid]


def _same_motion(data: AxisData, other: AxisData) -> bool:
    """Whether two data have the same motions, compared at the same valid samples."""
    motions = zip(data.segments, other.segments, strict=True)
    same = all(a.motion is b.motion and a.filter is b.filter for a, b in motions)
    return same and np.array_equal(data.valid, other.valid)


# Scores of candidates on the residual of a model.


@dataclass(frozen=True)
class ScoredCandidate:
    """A candidate at its best parameters, with the error that adding it leaves.

    Attributes
    ----------
    error : float
        Sum of squared residuals over the valid samples.
    grid : Grid
        The whole range that was searched.
    """

    term: FittedTerm
    error: float
    grid: Grid = field(default_factory=dict, repr=False, compare=False)

    @property
    def candidate(self) -> Candidate:
        """The candidate itself."""
        return self.term.candidate

    @property
    def on_edge(self) -> bool:
        """Whether a nonlinear parameter lies at the end of its grid."""
        spec = named(self.candidate.effect).search
        several = np.ptp(self.grid.get("clock", np.zeros(1))) > 0.0
        closed = set(self.candidate.form.nonlinear) - set(spec.open_ended)
        for name in closed.intersection(self.grid):
            low, high = float(np.min(self.grid[name])), float(np.max(self.grid[name]))
            ends = (high,) if several and name in spec.between_recordings else (low, high)
            if low < high and self.term.nonlinear[name] in ends:
                return True
        return False


@dataclass(frozen=True)
class ResidualSubspace:
    """The residual of a model at the valid samples, and the space that its Jacobian spans.

    Attributes
    ----------
    basis : (n, R) array
        Orthonormal; it spans the same.
    adds_up : bool
        Whether the efforts of the model do, and the basis spans no more than its Jacobian.
    """

    data: AxisData
    axis: AxisModel
    residual: Array
    jacobian: Array
    basis: Array
    adds_up: bool = False

    @classmethod
    def of(cls, data: AxisData, fitted: FittedModel, *, held: bool = False) -> Self:
        """The residual subspace of a fitted model.

        Parameters
        ----------
        held : bool, optional
            Whether what a bound holds stays there.
        """
        residual = (data.effort - fitted.predicted)[data.valid]
        jacobian = (fitted.jacobian if held else _released(fitted))[data.valid]
        adds_up = additive(fitted.template, fitted.terms)
        return cls(data, fitted.axis, residual, jacobian, orthonormal(jacobian), adds_up)

    @cached_property
    def left(self) -> Array:
        """The residual's component (n,) that is orthogonal to the basis."""
        return np.asarray(self.residual - self.basis @ (self.basis.T @ self.residual))

    def regressors(
        self, candidate: Candidate, nonlinear: Grid, *, recurring: bool = False
    ) -> Array:
        """Regressors (D, k, n) of a candidate at the valid samples.

        Those of points that recur are kept, where efforts add up: searches on several residuals
        begin around the same point of a grid.
        """
        rows = kept_rows if recurring and adds(candidate) else grid_rows
        return rows(self.data, self.axis, candidate, nonlinear)

    def residuals(
        self, candidate: Candidate, nonlinear: Grid, rows: Array
    ) -> tuple[Array, NDArray[np.bool_]]:
        """What is left (D, n) beside regressors (D, k, n), as far as it is orthogonal to the basis,
        enlarged by what it costs that an actuator ignores commands; and whether the linear
        parameters are inside their bounds, (D,)."""
        rows = rows - (rows @ self.basis) @ self.basis.T
        if not candidate.form.linear:
            penalty = ignored_command_penalty(self.data, term(candidate, nonlinear, {}))
            root = np.sqrt(np.minimum(penalty, _MOST))[:, None]
            return (self.left - rows[:, 0]) * root, np.isfinite(penalty)
        length = np.maximum(np.linalg.norm(rows, axis=2), _TINY)
        unit = rows / length[..., None]
        gram = unit @ unit.transpose(0, 2, 1) + _RIDGE * np.eye(rows.shape[1])
        sizes = np.linalg.solve(gram, (unit @ self.left)[..., None])[..., 0]
        low, high = bounds_of(candidate)
        physical = np.all((sizes >= low * length) & (sizes <= high * length), axis=1)
        return self.left - np.einsum("dk,dkn->dn", sizes, unit), physical

    def score(
        self, candidate: Candidate, nonlinear: Grid, grid: Grid, *, recurring: bool = False
    ) -> ScoredCandidate:
        """The best of D sets of nonlinear parameters.

        Parameters
        ----------
        grid : mapping of parameter name to array
            The whole range that is searched.
        recurring : bool, optional
            Whether the same few sets are scored on other models, too.
        """
        rows = self.regressors(candidate, nonlinear, recurring=recurring)
        return self.score_at(candidate, nonlinear, rows, grid)

    def score_library(
        self,
        library: Library,
        grids: Mapping[Candidate, Grid],
        without: Set[str | Candidate],
    ) -> list[ScoredCandidate]:
        """Each candidate of a library at the best of its points.

        Parameters
        ----------
        library : Library
        grids : mapping of Candidate to Grid
            The whole ranges that are searched.
        without : set of str or Candidate
            Effects and candidates that are left out.
        """
        fits = library.fits(self)
        found = []
        for candidate, points in library.points.items():
            if candidate.effect in without or candidate in without:
                continue
            errors, linear = fits[candidate]
            errors = self._penalized(candidate, points, errors, linear)
            found.append(_best(candidate, points, errors, linear, grids[candidate]))
        return [scored for scored in found if np.isfinite(scored.error)]

    def score_at(
        self, candidate: Candidate, nonlinear: Grid, rows: Array, grid: Grid
    ) -> ScoredCandidate:
        """The best of D sets of nonlinear parameters, from their regressors (D, k, n)."""
        return _best(candidate, nonlinear, *self._fit(candidate, nonlinear, rows), grid)

    def _fit(self, candidate: Candidate, nonlinear: Grid, rows: Array) -> tuple[Array, Array]:
        """Errors (D,) and linear parameters (D, k) of regressors (D, k, n)."""
        flat = rows.reshape(-1, rows.shape[-1])
        gram = rows @ rows.transpose(0, 2, 1)
        component = Orthogonal.of(gram, (flat @ self.basis).reshape(*rows.shape[:2], -1))
        product = (flat @ self.left).reshape(rows.shape[:2])
        total = float(self.left @ self.left)
        errors, linear = component.fit(product, total, *bounds_of(candidate))
        return self._penalized(candidate, nonlinear, errors, linear), linear

    def _penalized(
        self, candidate: Candidate, nonlinear: Grid, errors: Array, linear: Array
    ) -> Array:
        """Errors (D,) that count what an actuator ignores."""
        if not named(candidate.effect).overrides("withheld"):
            return errors
        fitted = dict(zip(candidate.form.linear, linear.T, strict=True))
        return errors * ignored_command_penalty(self.data, term(candidate, nonlinear, fitted))


def _best(
    candidate: Candidate, nonlinear: Grid, errors: Array, linear: Array, grid: Grid
) -> ScoredCandidate:
    """The best of D sets, from their errors (D,) and linear parameters (D, k)."""
    best = int(np.argmin(errors))
    at = {name: float(array[best]) for name, array in nonlinear.items()}
    values = dict(zip(candidate.form.linear, linear[best].tolist(), strict=False))
    best_term = FittedTerm(candidate, at, values)
    return ScoredCandidate(best_term, float(errors[best]), grid)


def _released(fitted: FittedModel) -> Array:
    """The Jacobian (n, P) with base parameters free: with one more term their bounds may not hold
    them, and the fit of that model decides. Timing at its bound stays: beyond it is a delay."""
    free = fitted.free.copy()
    free[: len(PARAMETERS)] = True
    return np.where(free, fitted.derivatives, 0.0)
