"""From the best point of a grid of shapes to the best shapes between its points."""

from collections.abc import Mapping
from functools import lru_cache
from typing import Final

import numpy as np
import scipy.optimize
from numpy.typing import NDArray

from edge_ident.diagnosis.fit.candidates import Candidate
from edge_ident.diagnosis.fit.projection import AROUND
from edge_ident.diagnosis.fit.trying import Gap, Shapes, Trial
from edge_ident.model.effects import named

Array = NDArray[np.float64]

_ROUNDS: Final = 3
_CLOSER: Final = (0.25, 0.4)
"""Width of a round over that of the one before; of few shapes, of many."""
_MANY: Final = 2
"""Shapes beyond which points around one are too sparse to end with."""
_DESCENTS: Final = 10
"""Steps downhill from the best of many shapes."""
_BEYOND: Final = 4.0
"""Of the largest value in a shape's grid, up to which a descent may go."""
_STEP: Final = 0.02
"""For derivatives, of a shape's typical size: coarse enough for effects that act in jumps."""
_TINY: Final = float(np.finfo(float).tiny)


def refined(gap: Gap, trial: Trial, grid: Shapes) -> Trial:
    """Close in on the best shapes, all of them together; many of them then go downhill."""
    candidate = trial.found.candidate
    names = candidate.form.nonlinear
    width = {name: _spacing(grid, name, trial.found.shapes) for name in names}
    around = AROUND.get(len(names), AROUND[max(AROUND)])
    many = len(names) > _MANY and len(candidate.form.linear) == 1
    # what was refined before is where points around many shapes are too sparse to help
    rounds = 0 if many and np.isinf(trial.error) else _ROUNDS
    for _ in range(rounds if names else 0):
        shapes = {k: np.full(len(around), v) for k, v in trial.found.shapes.items()}
        for k, name in enumerate(names):
            offsets = width[name] * around[:, k]
            shapes[name] = _within(candidate, name, grid, shapes[name] + offsets)
            width[name] *= _CLOSER[many]
        closer = gap.best(candidate, shapes, gap.columns(candidate, shapes), grid)
        if np.isfinite(closer.error) and closer.error <= trial.error:
            trial = closer
    if many:
        lower = _descended(gap, trial, grid)
        if lower.error < trial.error:
            trial = lower
    return trial


def _descended(gap: Gap, trial: Trial, grid: Shapes) -> Trial:
    """Where a descent from a trial's shapes ends (trust region, after projection)."""
    candidate = trial.found.candidate
    names = candidate.form.nonlinear
    start = np.array([trial.found.shapes[name] for name in names])
    largest = _BEYOND * np.array([float(np.max(np.abs(grid[name]))) for name in names])
    low, high = np.array([named(candidate.effect).bounds[name] for name in names]).T
    low, high = np.maximum(low, -largest), np.minimum(high, np.maximum(largest, low + _TINY))
    scale = np.maximum(np.maximum(np.abs(start), 0.1 * largest), _TINY)

    def shapes_at(points: Array) -> Shapes:
        inside = np.clip(points * scale, low, high)
        fixed = {k: np.full(len(points), v) for k, v in trial.found.shapes.items()}
        return fixed | {name: inside[:, k] for k, name in enumerate(names)}

    steps = _STEP * np.concatenate(
        [np.zeros((1, len(names))), np.eye(len(names)), -np.eye(len(names))]
    )

    @lru_cache(maxsize=2)
    def left(point: tuple[float, ...]) -> Array:
        """Residuals (1 + 2·shapes, n) at a point and a step to all its sides; one batch takes
        hardly longer than one point."""
        rows = gap.columns(candidate, shapes_at(np.array(point) + steps))[:, 0]
        own = rows - (rows @ gap.basis) @ gap.basis.T
        length = np.maximum(np.einsum("dn,dn->d", own, own), _TINY)
        return np.asarray(gap.residual - (own @ gap.residual / length)[:, None] * own)

    def jacobian(point: Array) -> Array:
        forward, backward = np.split(left(tuple(point))[1:], 2)
        return np.asarray((forward - backward).T / (2.0 * _STEP))

    end = scipy.optimize.least_squares(
        lambda point: left(tuple(point))[0],
        np.clip(start, low, high) / scale,
        jacobian,
        bounds=(low / scale - 1e-9, high / scale + 1e-9),
        max_nfev=_DESCENTS,
    )
    shapes = shapes_at(end.x[None])
    return gap.best(candidate, shapes, gap.columns(candidate, shapes), grid)


def _within(candidate: Candidate, name: str, grid: Shapes, points: Array) -> Array:
    """Points inside a shape's grid where that has a width, else inside its bounds."""
    low, high = (float(f(grid[name])) for f in (np.min, np.max))
    if low == high:
        low, high = named(candidate.effect).bounds[name]
    return np.asarray(np.clip(points, low, high))


def _spacing(grid: Shapes, name: str, at: Mapping[str, float]) -> float:
    """Distance to the neighbouring value of a shape, the larger of the two, among the points of a
    grid that are alike in all others."""
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
