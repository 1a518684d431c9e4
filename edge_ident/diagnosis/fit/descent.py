"""Descents: from several sets of a candidate's nonlinear parameters to the best ones near them.

Levenberg and Marquardt's method (1963) with variable projection (Golub and Pereyra 1973), inside
bounds. All descents go side by side: an effect with memory is computed sample by sample, and that
takes little longer for a hundred sets of parameters than for ten.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final, Self

import numpy as np
from numpy.typing import NDArray

from edge_ident.diagnosis.fit.candidates import Candidate
from edge_ident.diagnosis.fit.library import Grid
from edge_ident.diagnosis.fit.scoring import ResidualSubspace, ScoredCandidate
from edge_ident.model.effects import named

Array = NDArray[np.float64]

_EVALUATIONS: Final = 10
_BEYOND: Final = 4.0
"""Farthest that a descent may go, over the largest value of the grid."""
_STEP: Final = 0.02
"""Step of the derivatives, of a parameter's scale: coarse enough for effects that act in jumps."""
_DAMPING: Final = 0.1
_MOST_DAMPING: Final = 100.0
"""At the start, and where a step is too short to matter; over the squared length of a slope."""
_LESS: Final = 0.1
_MORE: Final = 10.0
"""Factors on the damping after a step that led down, and after one that did not."""
_IDLE: Final = 1e-9
"""Of the largest squared slope: a parameter with less changes nothing, and stays."""
_WORTH: Final = 1e-3
"""Least part of the error that a step has to take away for another one to follow."""
_TINY: Final = float(np.finfo(float).tiny)


def descended(
    subspace: ResidualSubspace, starts: Sequence[ScoredCandidate], grid: Grid
) -> list[ScoredCandidate]:
    """Descend from each of D starts.

    Parameters
    ----------
    subspace : ResidualSubspace
        Of the model that the candidate is added to.
    starts : sequence of ScoredCandidate
        One candidate, which has one linear parameter.
    grid : mapping of parameter name to array
        The whole range that is searched.

    Returns
    -------
    list of ScoredCandidate
        Where each descent ends: the start itself where nothing near it is better.
    """
    space = _Space.of(subspace, starts, grid)
    points = space.begin.copy()
    rows, residuals = space.around(points)
    damping, ended = np.full(len(points), _DAMPING), np.zeros(len(points), dtype=np.bool_)
    for more in reversed(range(_EVALUATIONS - 1)):
        moved = space.inside(points + space.moves(points, residuals, damping))
        rows_there, residuals_there = space.around(moved, slopes=more > 0)
        ratio = _energy(residuals_there) / _energy(residuals)
        lower = ratio < 1.0
        points[lower], rows[lower] = moved[lower], rows_there[lower]
        residuals[lower, : residuals_there.shape[1]] = residuals_there[lower]
        damping *= np.where(lower, _LESS, _MORE)
        ended |= np.where(lower, ratio > 1.0 - _WORTH, damping > _MOST_DAMPING)
        if np.all(ended):
            break
    sets = space.nonlinear(points)
    ends = [
        subspace.score_at(space.candidate, {k: v[d : d + 1] for k, v in sets.items()}, row, grid)
        for d, row in enumerate(rows[:, None, None])
    ]
    return [min(pair, key=lambda s: s.error) for pair in zip(starts, ends, strict=True)]


@dataclass(frozen=True)
class _Space:
    """The S nonlinear parameters of D descents, each in units of its scale.

    Attributes
    ----------
    subspace : ResidualSubspace
    candidate : Candidate
    begin : (D, S) array
    scale : (D, S) array
    low, high : (D, S) arrays
        Limits, in these units.
    """

    subspace: ResidualSubspace
    candidate: Candidate
    begin: Array
    scale: Array
    low: Array
    high: Array

    @classmethod
    def of(cls, subspace: ResidualSubspace, starts: Sequence[ScoredCandidate], grid: Grid) -> Self:
        """Limits are those of the effect; open ones lie a few times beyond the grid.

        A parameter is measured by its value. One that may be zero is at least a tenth of the range;
        a rate never is, and of a slow resonance that would be many times the width.
        """
        candidate = starts[0].candidate
        names = candidate.form.nonlinear
        values = np.array([[s.term.nonlinear[name] for name in names] for s in starts])
        largest = _BEYOND * np.array([float(np.max(np.abs(grid[name]))) for name in names])
        low, high = np.array([named(candidate.effect).bounds[name] for name in names]).T
        low, high = np.maximum(low, -largest), np.minimum(high, np.maximum(largest, low + _TINY))
        least = np.where(low > 0.0, 0.0, 0.1 * largest)
        scale = np.maximum(np.maximum(np.abs(values), least), _TINY)
        begin = np.clip(values, low, high) / scale
        return cls(subspace, candidate, begin, scale, low / scale, high / scale)

    def around(self, points: Array, *, slopes: bool = True) -> tuple[Array, Array]:
        """Regressors (D, n) at points (D, S); and residuals (D, 1 + 2·S, n) there, a step to the
        upper side of each parameter, and a step to the lower side of each. Without slopes, only
        those at the points, (D, 1, n)."""
        aside = _STEP * np.eye(points.shape[1])
        steps = [*aside, *-aside] if slopes else []
        near = [points, *(self.inside(points + step) for step in steps)]
        sets = self.nonlinear(np.stack(near, axis=1))
        rows = self.subspace.regressors(self.candidate, sets)[:, 0]
        residuals = _residuals(self.subspace, rows).reshape(len(points), len(near), -1)
        return rows[:: len(near)].copy(), residuals

    def moves(self, points: Array, residuals: Array, damping: Array) -> Array:
        """Damped Gauss-Newton steps (D, S) from points (D, S) with residuals around them."""
        upper, lower = np.split(residuals[:, 1:], 2, axis=1)
        slopes = (upper - lower) / (2.0 * _STEP)
        gradient = np.einsum("dsn,dn->ds", slopes, residuals[:, 0])
        free = np.where(gradient > 0.0, points > self.low, points < self.high)
        slopes, gradient = slopes * free[..., None], gradient * free
        normal = slopes @ slopes.transpose(0, 2, 1)
        energy = np.einsum("dss->ds", normal)
        least = _IDLE * np.max(energy, axis=1, keepdims=True) + _TINY
        added = np.maximum(damping[:, None] * energy, least)
        normal += added[..., None] * np.eye(points.shape[1])
        return np.asarray(-np.linalg.solve(normal, gradient[..., None])[..., 0])

    def nonlinear(self, points: Array) -> Grid:
        """Values (D·K,) by name from points (D, K, S), or (D,) from (D, S)."""
        scale = self.scale.reshape(len(points), *(1,) * (points.ndim - 2), -1)
        values = (points * scale).reshape(-1, scale.shape[-1]).T
        return dict(zip(self.candidate.form.nonlinear, values, strict=True))

    def inside(self, points: Array) -> Array:
        """Points (D, S) moved to the limits where they are beyond."""
        return np.asarray(np.clip(points, self.low, self.high))


def _residuals(subspace: ResidualSubspace, rows: Array) -> Array:
    """Residuals (D, n) beside one regressor each, from (D, n) regressors."""
    orthogonal = rows - (rows @ subspace.basis) @ subspace.basis.T
    length = np.maximum(np.einsum("dn,dn->d", orthogonal, orthogonal), _TINY)
    amplitude = orthogonal @ subspace.residual / length
    return np.asarray(subspace.residual - amplitude[:, None] * orthogonal)


def _energy(residuals: Array) -> Array:
    """Sums of squares (D,) at the points themselves."""
    energy = np.einsum("dn,dn->d", residuals[:, 0], residuals[:, 0])
    return np.asarray(np.maximum(energy, _TINY))
