"""Refinement: from the best point of a grid to the best nonlinear parameters between its points."""

from collections.abc import Mapping
from functools import lru_cache
from typing import Final

import numpy as np
import scipy.optimize
from numpy.typing import NDArray

from edge_ident.diagnosis.fit.candidates import Candidate
from edge_ident.diagnosis.fit.library import Grid
from edge_ident.diagnosis.fit.projection import AROUND
from edge_ident.diagnosis.fit.scoring import ResidualSubspace, ScoredCandidate
from edge_ident.model.effects import named

Array = NDArray[np.float64]

_ROUNDS: Final = 3
TO_COMPARE: Final = 6
"""Rounds after which equal formulas leave equal residuals."""
_NARROWING: Final = (0.25, 0.4)
"""Width of a round over that of the one before; of few nonlinear parameters, of many."""
_DESCENT_STEPS: Final = 10
"""Evaluations of a descent."""
_BEYOND: Final = 4.0
"""Farthest that a descent may go, over the largest value of the grid."""
_STEP: Final = 0.02
"""Step of the derivatives, of a parameter's scale: coarse enough for effects that act in jumps."""
_TINY: Final = float(np.finfo(float).tiny)


def refined(
    subspace: ResidualSubspace, scored: ScoredCandidate, grid: Grid, most_rounds: int = _ROUNDS
) -> ScoredCandidate:
    """Refine all nonlinear parameters of a candidate together.

    Up to two are searched on ever finer grids, as many as there are rounds. With more, a descent
    follows.
    """
    candidate = scored.candidate
    names = candidate.form.nonlinear
    width = {name: _spacing(grid, name, scored.term.nonlinear) for name in names}
    around = AROUND.get(len(names), AROUND[max(AROUND)])
    many = candidate.descends
    # points around many parameters are too sparse to improve on what was refined before
    rounds = 0 if many and np.isinf(scored.error) else most_rounds
    for _ in range(rounds if names else 0):
        points = {k: np.full(len(around), v) for k, v in scored.term.nonlinear.items()}
        for k, name in enumerate(names):
            offsets = width[name] * around[:, k]
            points[name] = _within(candidate, name, grid, points[name] + offsets)
            width[name] *= _NARROWING[many]
        closer = subspace.score(candidate, points, grid)
        if np.isfinite(closer.error) and closer.error <= scored.error:
            scored = closer
    if many:
        lower = _descended(subspace, scored, grid)
        if lower.error < scored.error:
            scored = lower
    return scored


def _descended(subspace: ResidualSubspace, scored: ScoredCandidate, grid: Grid) -> ScoredCandidate:
    """Descend from a candidate's nonlinear parameters (trust region, variable projection)."""
    candidate = scored.candidate
    names = candidate.form.nonlinear
    start = np.array([scored.term.nonlinear[name] for name in names])
    low, high, scale = _descent_limits(candidate, start, grid)
    fixed = scored.term.nonlinear

    def nonlinear_at(points: Array) -> Grid:
        inside = np.clip(points * scale, low, high)
        values = {k: np.full(len(points), v) for k, v in fixed.items()}
        return values | {name: inside[:, k] for k, name in enumerate(names)}

    steps = _STEP * np.concatenate(
        [np.zeros((1, len(names))), np.eye(len(names)), -np.eye(len(names))]
    )

    @lru_cache(maxsize=_DESCENT_STEPS)
    def regressors(point: tuple[float, ...]) -> Array:
        """Regressors (1 + 2·names, 1, n) at a point and a step to all its sides, in one batch."""
        return subspace.regressors(candidate, nonlinear_at(np.array(point) + steps))

    @lru_cache(maxsize=2)
    def residuals(point: tuple[float, ...]) -> Array:
        """Residuals (1 + 2·names, n) there."""
        return _residuals(subspace, regressors(point)[:, 0])

    end = scipy.optimize.least_squares(
        lambda point: residuals(tuple(point))[0],
        np.clip(start, low, high) / scale,
        lambda point: _jacobian(residuals(tuple(point))),
        bounds=(low / scale - 1e-9, high / scale + 1e-9),
        max_nfev=_DESCENT_STEPS,
    )
    rows = regressors(tuple(end.x))[:1]
    return subspace.score_at(candidate, nonlinear_at(end.x[None]), rows, grid)


def _residuals(subspace: ResidualSubspace, rows: Array) -> Array:
    """Residuals (D, n) beside one regressor each, from (D, n) regressors."""
    orthogonal = rows - (rows @ subspace.basis) @ subspace.basis.T
    length = np.maximum(np.einsum("dn,dn->d", orthogonal, orthogonal), _TINY)
    amplitude = orthogonal @ subspace.residual / length
    return np.asarray(subspace.residual - amplitude[:, None] * orthogonal)


def _jacobian(residuals: Array) -> Array:
    """Derivatives (n, S) from residuals (1 + 2·S, n) at a point and a step to all its sides."""
    forward, backward = np.split(residuals[1:], 2)
    return np.asarray((forward - backward).T / (2.0 * _STEP))


def _descent_limits(candidate: Candidate, start: Array, grid: Grid) -> tuple[Array, Array, Array]:
    """Lower and upper limits and scales of the nonlinear parameters, (S,) each."""
    names = candidate.form.nonlinear
    largest = _BEYOND * np.array([float(np.max(np.abs(grid[name]))) for name in names])
    low, high = np.array([named(candidate.effect).bounds[name] for name in names]).T
    low, high = np.maximum(low, -largest), np.minimum(high, np.maximum(largest, low + _TINY))
    scale = np.maximum(np.maximum(np.abs(start), 0.1 * largest), _TINY)
    return low, high, scale


def _within(candidate: Candidate, name: str, grid: Grid, points: Array) -> Array:
    """Points inside a parameter's grid where that has a width, else inside its bounds."""
    low, high = (float(f(grid[name])) for f in (np.min, np.max))
    if low == high:
        low, high = named(candidate.effect).bounds[name]
    return np.asarray(np.clip(points, low, high))


def _spacing(grid: Grid, name: str, at: Mapping[str, float]) -> float:
    """Distance from a parameter's value to its neighbours in the grid, the larger of the two.

    The neighbours are points of the grid that have the same values of all other parameters.
    """
    alike = np.ones(len(grid[name]), dtype=np.bool_)
    for other, values in grid.items():
        if other != name:
            off = np.abs(values - at[other])
            alike &= off == np.min(off)
    here = grid[name][alike] if np.count_nonzero(alike) > 1 else grid[name]
    distinct = np.unique(here)
    index = int(np.argmin(np.abs(distinct - at[name])))
    near = distinct[max(index - 1, 0) : index + 2]
    return float(np.max(np.abs(near - at[name]))) if len(near) > 1 else abs(at[name])
