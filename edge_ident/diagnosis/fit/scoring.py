"""Scores of candidates on the residual of a model."""

from collections.abc import Hashable, Mapping, Set
from dataclasses import dataclass, field
from functools import cached_property
from typing import Self

import numpy as np
from numpy.typing import NDArray

from edge_ident.diagnosis.fit.candidates import Candidate, adds, term
from edge_ident.diagnosis.fit.fitting import FittedModel, FittedTerm, additive
from edge_ident.diagnosis.fit.grid_rows import grid_rows, kept_rows
from edge_ident.diagnosis.fit.ignored_commands import ignored_command_penalty
from edge_ident.diagnosis.fit.library import Grid, Library
from edge_ident.diagnosis.fit.projection import Orthogonal, bounds_of, orthonormal
from edge_ident.diagnosis.prepare.axis_data import AxisData
from edge_ident.model.effects import named
from edge_ident.model.model import PARAMETERS, AxisModel

Array = NDArray[np.float64]


@dataclass(frozen=True)
class ScoredCandidate:
    """A candidate at its best parameters, with the error that adding it leaves.

    Attributes
    ----------
    term : FittedTerm
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
    data : AxisData
    axis : AxisModel
    residual : (n,) array
    jacobian : (n, P) array
    basis : (n, R) array
        Orthonormal; it spans the same.
    key : hashable
        What makes the basis, where the efforts of the model add up; otherwise None.
    """

    data: AxisData
    axis: AxisModel
    residual: Array
    jacobian: Array
    basis: Array
    key: Hashable = None

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
        key = None
        if additive(fitted.template, fitted.terms):
            terms = ((t.candidate, *t.nonlinear.values()) for t in fitted.terms)
            key = (held, fitted.free.tobytes(), *terms)
        return cls(data, fitted.axis, residual, jacobian, orthonormal(jacobian), key)

    @cached_property
    def left(self) -> Array:
        """The residual's component (n,) that is orthogonal to the basis."""
        return np.asarray(self.residual - self.basis @ (self.basis.T @ self.residual))

    def regressors(
        self, candidate: Candidate, nonlinear: Grid, *, recurring: bool = False
    ) -> Array:
        """Regressors (D, k, n) of a candidate at the valid samples.

        Those of an effect that is integrated are kept: searches on several residuals begin around
        the same point of its grid. So are those of points that recur, where efforts add up.
        """
        recurring = recurring and self.key is not None
        kept = adds(candidate) and (recurring or named(candidate.effect).memory_scale)
        rows = kept_rows if kept else grid_rows
        return rows(self.data, self.axis, candidate, nonlinear)

    def score(
        self, candidate: Candidate, nonlinear: Grid, grid: Grid, *, recurring: bool = False
    ) -> ScoredCandidate:
        """The best of D sets of nonlinear parameters.

        Parameters
        ----------
        nonlinear : mapping of parameter name to (D,) array
        grid : mapping of parameter name to array
            The whole range that is searched.
        recurring : bool, optional
            Whether the same few sets are scored on other models, too.
        """
        rows = self.regressors(candidate, nonlinear, recurring=recurring)
        return self.score_at(candidate, nonlinear, rows, grid)

    def score_all(
        self, candidate: Candidate, nonlinear: Grid, grid: Grid, *, recurring: bool
    ) -> tuple[ScoredCandidate, Array]:
        """The best of D sets of nonlinear parameters, and the errors (D,) of all."""
        rows = self.regressors(candidate, nonlinear, recurring=recurring)
        errors, linear = self._fit(candidate, nonlinear, rows)
        return _best(candidate, nonlinear, errors, linear, grid), errors

    def score_library(
        self,
        library: Library,
        grids: Mapping[Candidate, Grid],
        without: Set[str | Candidate],
        starts: int = 1,
    ) -> list[ScoredCandidate]:
        """Each candidate of a library at the best of its points.

        Parameters
        ----------
        library : Library
        grids : mapping of Candidate to Grid
            The whole ranges that are searched.
        without : set of str or Candidate
            Effects and candidates that are left out.
        starts : int, optional
            A candidate that a descent refines comes at the best of so many parts of the range of
            its first nonlinear parameter.
        """
        fits = library.fits(self.basis, self.jacobian, self.left, self.key)
        found = []
        for candidate, points in library.points.items():
            if candidate.effect in without or candidate in without:
                continue
            errors, linear = fits[candidate]
            errors = self._penalized(candidate, points, errors, linear)
            for part in _parts(candidate, points, starts):
                found.append(_best(candidate, points, errors, linear, grids[candidate], part))
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
    candidate: Candidate,
    nonlinear: Grid,
    errors: Array,
    linear: Array,
    grid: Grid,
    among: NDArray[np.bool_] | bool = True,
) -> ScoredCandidate:
    """The best of D sets, from their errors (D,) and linear parameters (D, k)."""
    best = int(np.argmin(np.where(among, errors, np.inf)))
    at = {name: float(array[best]) for name, array in nonlinear.items()}
    values = dict(zip(candidate.form.linear, linear[best].tolist(), strict=False))
    best_term = FittedTerm(candidate, at, values)
    return ScoredCandidate(best_term, float(errors[best]), grid)


def _parts(candidate: Candidate, points: Grid, starts: int) -> list[NDArray[np.bool_] | bool]:
    """Masks (D,) of the points in each part of the range of the first nonlinear parameter."""
    if starts == 1 or not candidate.descends:
        return [True]
    values, place = np.unique(points[candidate.form.nonlinear[0]], return_inverse=True)
    part = starts * place // len(values)
    return [part == one for one in np.unique(part)]


def _released(fitted: FittedModel) -> Array:
    """The Jacobian (n, P) with base parameters free: with one more term their bounds may not hold
    them, and the fit of that model decides. Timing at its bound stays: beyond it is a delay."""
    free = fitted.free.copy()
    free[: len(PARAMETERS)] = True
    return np.where(free, fitted.derivatives, 0.0)
