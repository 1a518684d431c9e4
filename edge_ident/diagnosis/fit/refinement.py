"""Refinement: from the best point of a grid to the best nonlinear parameters between its points."""

from collections.abc import Hashable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Final, Self

import numpy as np
from numpy.typing import NDArray

from edge_ident.diagnosis.fit.candidates import Candidate, cached_effort, cached_regressors
from edge_ident.diagnosis.fit.fitting import FittedModel, FittedTerm, fit
from edge_ident.diagnosis.fit.library import Grid, ResidualSubspace, ScoredCandidate
from edge_ident.diagnosis.fit.linear import around
from edge_ident.diagnosis.prepare.axis_data import AxisData
from edge_ident.model.effect import Effect
from edge_ident.model.effects import catalogue, named
from edge_ident.model.model import AxisModel

Array = NDArray[np.float64]


_ROUNDS: Final = 3
FINE: Final = 6
"""Rounds after which equal formulas leave equal residuals, and a parameter is closer to the best
one than noise lets it be known."""
_NARROWING: Final = (0.25, 0.4)
"""Width of a round over that of the one before; of few nonlinear parameters, of many."""
_BETWEEN: Final = around(1)[[1, 2, 3, 5, 6, 7], 0]
"""Points of a finer line that the one before has not."""
_SETTLED: Final = 1e-7
"""Part of the error that a parabola promises to take away yet, below which no round follows: a
parameter is then within a hundredth of what noise lets be known of it."""


@dataclass(frozen=True)
class Refinements:
    """Candidates that were refined before; the same ones recur in other contexts.

    Attributes
    ----------
    cache : dict
        By what they were refined from, and beside which model.
    """

    cache: dict[Hashable, ScoredCandidate] = field(default_factory=dict)

    def refined(
        self,
        subspace: ResidualSubspace,
        scored: ScoredCandidate,
        grid: Grid,
        most_rounds: int = _ROUNDS,
    ) -> ScoredCandidate:
        """See `refined`."""
        left = float(subspace.residual @ subspace.residual)
        at = scored.term.nonlinear.values()
        key = (most_rounds, scored.candidate, *at, scored.error, left)
        if key not in self.cache:
            self.cache[key] = refined(subspace, scored, grid, most_rounds)
        return self.cache[key]


def refined(
    subspace: ResidualSubspace, scored: ScoredCandidate, grid: Grid, most_rounds: int = _ROUNDS
) -> ScoredCandidate:
    """Refine all nonlinear parameters of a candidate together.

    Up to two are searched on ever finer grids, as many as there are rounds. With more, a descent
    follows.
    """
    candidate = scored.candidate
    names = candidate.form.nonlinear
    if len(names) == 1:
        return _along_line(subspace, scored, grid, most_rounds)
    width = {name: _spacing(grid, name, scored.term.nonlinear) for name in names}
    many = candidate.descends
    # points around many parameters are too sparse to improve on what was refined before
    rounds = 0 if many and np.isinf(scored.error) else most_rounds
    for _ in range(rounds if names else 0):
        tried = around(len(names))
        points = {k: np.full(len(tried), v) for k, v in scored.term.nonlinear.items()}
        for k, name in enumerate(names):
            offsets = width[name] * tried[:, k]
            points[name] = _within(candidate, name, grid, points[name] + offsets)
            width[name] *= _NARROWING[many]
        closer = subspace.score(candidate, points, grid)
        if np.isfinite(closer.error) and closer.error <= scored.error:
            scored = closer
    return descended(subspace, (scored,), grid)[0] if many else scored


def _along_line(
    subspace: ResidualSubspace, scored: ScoredCandidate, grid: Grid, most_rounds: int
) -> ScoredCandidate:
    """The best value of one nonlinear parameter, on ever finer lines between the grid's points.

    The middle of a finer line and its ends were tried before.
    """
    candidate = scored.candidate
    (name,) = candidate.form.nonlinear
    offsets = _spacing(grid, name, scored.term.nonlinear) * around(1)[:, 0]
    for number in range(most_rounds):
        nonlinear = scored.term.nonlinear
        line = np.unique(_within(candidate, name, grid, nonlinear[name] + offsets))
        points = {k: np.full(len(line), v) for k, v in nonlinear.items()} | {name: line}
        # from a point of the grid, the first line is that of other models, too
        closer, errors = subspace.score_all(candidate, points, grid, recurring=number == 0)
        if np.isfinite(closer.error) and closer.error <= scored.error:
            scored = closer
        if _promised(line, errors) < _SETTLED * scored.error:
            break
        offsets = _NARROWING[False] * np.max(np.abs(offsets)) * _BETWEEN
    return scored


def _promised(points: Array, errors: Array) -> float:
    """By how much a parabola through the best of a few points and its neighbours ends below them;
    infinity where they tell of none."""
    place = int(np.argmin(errors))
    if not 0 < place < len(points) - 1:
        return np.inf
    near = slice(place - 1, place + 2)
    (below, above), (fallen, risen) = np.diff(points[near]), np.diff(errors[near])
    bend = (risen / above - fallen / below) / (below + above)
    if not np.isfinite(bend) or bend <= 0.0:
        return np.inf
    slope = fallen / below + bend * below
    return float(0.25 * slope**2 / bend)


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


# Descents: from several sets of a candidate's nonlinear parameters to the best ones near them.
#
# Levenberg and Marquardt's method (1963) with variable projection (Golub and Pereyra 1973), inside
# bounds. All descents go side by side: an effect with memory is computed sample by sample, and that
# takes little longer for a hundred sets of parameters than for ten.


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


# Fits of models with a delay of many samples, whose effect is not linear.


def delay() -> Effect:
    """The effect that shifts the effort."""
    return next(effect for effect in catalogue().values() if effect.effort_delay)


def fit_late(
    data: AxisData,
    template: AxisModel,
    base: NDArray[np.float64],
    terms: Sequence[FittedTerm],
    late_s: float,
) -> FittedModel:
    """Fit a model whose last term is a delay, from about where it is.

    First all else is fitted beside a delay of that size: what it is without a delay says nothing of
    what a longer one changes.

    Parameters
    ----------
    template : AxisModel
        The axis with the effects that it is known to have.
    base : (4,) array
        Base parameters to start from.
    terms : sequence of FittedTerm
        The other terms to add.
    late_s : float
        By about which the effort is late.
    """
    effect = delay()
    (form,) = effect.search.forms
    late = FittedTerm(Candidate(effect.name, form), {}, {effect.effort_delay: late_s})
    held = fit(data, replace(template, terms=(*template.terms, late.model_term)), base, terms)
    return fit(data, template, held.base, (*held.terms, late))


def scored_late(data: AxisData, fitted: FittedModel) -> ScoredCandidate:
    """A delay beside the terms of a model, as fitted: a score of first order says little of it."""
    model = fit_late(data, fitted.template, fitted.base, fitted.terms, data.late_s)
    return ScoredCandidate(model.terms[-1], model.error)


def rows_beside(
    data: AxisData, fitted: FittedModel, term: FittedTerm, of: AxisData
) -> NDArray[np.float64]:
    """Regressors (k, n) of a candidate beside a model; of a delay what it changes, per s.

    Parameters
    ----------
    data : AxisData
        That the model is fitted to.
    fitted : FittedModel
    term : FittedTerm
    of : AxisData
        Whose regressors: the data themselves, or with more noise.
    """
    if not term.candidate.delays:
        return cached_regressors(of, fitted.axis, term.candidate, term.nonlinear)
    model = fit(data, fitted.template, fitted.base, (*fitted.terms, term))
    (late_s,) = model.terms[-1].linear.values()
    in_time = model.axis_without([len(fitted.terms)])
    return (cached_effort(of, model.axis) - cached_effort(of, in_time))[None] / late_s
