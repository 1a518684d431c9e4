"""Refinement: from points of a grid to the best nonlinear parameters near them.

Levenberg and Marquardt's method (1963) with variable projection (Golub and Pereyra 1973), inside
bounds. Descents go side by side: an effect with memory is computed sample by sample, and that takes
little longer for a hundred sets of parameters than for ten.
"""

from collections.abc import Hashable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Final, Self

import numpy as np
from numpy.typing import NDArray

from edge_ident.diagnosis.fit.candidates import Candidate, cached_effort, cached_regressors
from edge_ident.diagnosis.fit.fitting import FittedModel, FittedTerm, fit
from edge_ident.diagnosis.fit.library import Grid, ResidualSubspace, ScoredCandidate
from edge_ident.diagnosis.prepare.axis_data import AxisData
from edge_ident.model.effect import Effect
from edge_ident.model.effects import catalogue, named
from edge_ident.model.model import AxisModel

Array = NDArray[np.float64]


_EVALUATIONS: Final = 10
_BEYOND: Final = 4.0
"""Farthest that a descent of many parameters may go, over the largest value of the grid."""
_STEP: Final = 0.02
"""Step of the derivatives, of a parameter's value: coarse enough for effects that act in jumps."""
_BETWEEN: Final = 0.25
"""The same of the distance to the next point of a grid."""
_FINER: Final = 0.1
"""Step of a second descent, over that of the first: a coarse one finds the valley, and a fine one
its bottom."""
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
        self, subspace: ResidualSubspace, scored: ScoredCandidate, grid: Grid
    ) -> ScoredCandidate:
        """See `refined`."""
        left = float(subspace.residual @ subspace.residual)
        key = (scored.candidate, *scored.term.nonlinear.values(), scored.error, left)
        if key not in self.cache:
            self.cache[key] = refined(subspace, scored, grid)
        return self.cache[key]


def refined(subspace: ResidualSubspace, scored: ScoredCandidate, grid: Grid) -> ScoredCandidate:
    """A candidate at the best nonlinear parameters near those of a point of its grid."""
    if not scored.candidate.form.nonlinear:
        return scored
    (found,) = descended(subspace, (scored,), grid)
    if scored.candidate.descends:
        return found
    return descended(subspace, (found,), grid, _FINER)[0]


def descended(
    subspace: ResidualSubspace, starts: Sequence[ScoredCandidate], grid: Grid, finer: float = 1.0
) -> list[ScoredCandidate]:
    """Descend from each of D starts.

    Parameters
    ----------
    subspace : ResidualSubspace
        Of the model that the candidate is added to.
    starts : sequence of ScoredCandidate
        One candidate, at different values.
    grid : mapping of parameter name to array
        The whole range that is searched.
    finer : float, optional
        Factor on the step of the derivatives.

    Returns
    -------
    list of ScoredCandidate
        Where each descent ends: the start itself where nothing near it is better.
    """
    space = _Space.of(subspace, starts, grid, finer)
    points = space.begin.copy()
    rows, residuals, physical = space.around(points, recurring=finer == 1.0)
    damping, ended = np.full(len(points), _DAMPING), np.zeros(len(points), dtype=np.bool_)
    for more in reversed(range(_EVALUATIONS - 1)):
        moved = space.inside(points + space.moves(points, residuals, damping))
        rows_there, residuals_there, possible = space.around(moved, slopes=more > 0)
        ratio = _energy(residuals_there) / _energy(residuals)
        lower = (ratio < 1.0) & (possible | ~physical)
        points[lower], rows[lower] = moved[lower], rows_there[lower]
        physical |= lower & possible
        residuals[lower, : residuals_there.shape[1]] = residuals_there[lower]
        damping *= np.where(lower, _LESS, _MORE)
        ended |= np.where(lower, ratio > 1.0 - _WORTH, damping > _MOST_DAMPING)
        if np.all(ended):
            break
    sets = space.nonlinear(points[:, None])
    ends = [
        subspace.score_at(space.candidate, {k: v[d : d + 1] for k, v in sets.items()}, row, grid)
        for d, row in enumerate(rows[:, None])
    ]
    return [min(pair, key=lambda s: s.error) for pair in zip(starts, ends, strict=True)]


@dataclass(frozen=True)
class _Space:
    """The S nonlinear parameters of D descents, each in units of a step.

    Attributes
    ----------
    others : dict
        Parameters that the form does not search.
    step : (D, S) array
        Of the derivatives.
    low, high : (D, S) arrays
        Limits, in these units.
    """

    subspace: ResidualSubspace
    candidate: Candidate
    others: Mapping[str, float]
    begin: Array
    step: Array
    low: Array
    high: Array

    @classmethod
    def of(
        cls,
        subspace: ResidualSubspace,
        starts: Sequence[ScoredCandidate],
        grid: Grid,
        finer: float,
    ) -> Self:
        """Limits are the ends of the grid, and of a sparse one of many parameters those of the
        effect; open ones lie a few times beyond the grid.

        The step is a part of the distance to the next point; of a sparse grid, of the value. One
        that may be zero is at least a tenth of the range; a rate never is, and of a slow resonance
        that would be many times the width.
        """
        candidate = starts[0].candidate
        names = candidate.form.nonlinear
        values = np.array([[s.term.nonlinear[name] for name in names] for s in starts])
        least, most = np.array([[f(grid[name]) for name in names] for f in (np.min, np.max)])
        low, high = np.array([named(candidate.effect).bounds[name] for name in names]).T
        if candidate.descends:
            largest = _BEYOND * np.maximum(np.abs(least), np.abs(most))
            low, high = (
                np.maximum(low, -largest),
                np.minimum(high, np.maximum(largest, low + _TINY)),
            )
            tenth = np.where(low > 0.0, 0.0, 0.1 * largest)
            step = _STEP * np.maximum(np.abs(values), tenth)
        else:
            wide = least < most
            low, high = np.where(wide, least, low), np.where(wide, most, high)
            apart = [[_spacing(grid, name, s.term.nonlinear) for name in names] for s in starts]
            step = _BETWEEN * np.array(apart)
        others = {k: v for k, v in starts[0].term.nonlinear.items() if k not in names}
        step = np.maximum(finer * step, _TINY)
        begin = np.clip(values, low, high) / step
        return cls(subspace, candidate, others, begin, step, low / step, high / step)

    def around(
        self, points: Array, *, slopes: bool = True, recurring: bool = False
    ) -> tuple[Array, Array, NDArray[np.bool_]]:
        """Regressors (D, k, n) at points (D, S); residuals (D, 1 + 2·S, n) there, a step to the
        upper side of each parameter, and a step to the lower side of each; and whether the points
        are physical, (D,). Without slopes, only the residuals at the points, (D, 1, n)."""
        aside = np.eye(points.shape[1])
        steps = [*aside, *-aside] if slopes else []
        sets = np.stack([points, *(self.inside(points + step) for step in steps)], axis=1)
        nonlinear = self.nonlinear(sets)
        rows = self.subspace.regressors(self.candidate, nonlinear, recurring=recurring)
        residuals, physical = self.subspace.residuals(self.candidate, nonlinear, rows)
        count = sets.shape[1]
        residuals = residuals.reshape(len(points), count, -1)
        return rows[::count].copy(), residuals, physical[::count].copy()

    def moves(self, points: Array, residuals: Array, damping: Array) -> Array:
        """Damped Gauss-Newton steps (D, S) from points (D, S) with residuals around them."""
        upper, lower = np.split(residuals[:, 1:], 2, axis=1)
        apart = self.inside(points + 1.0) - self.inside(points - 1.0)
        slopes = (upper - lower) / np.maximum(apart, _TINY)[..., None]
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
        """Values (D·K,) by name from points (D, K, S)."""
        values = (points * self.step[:, None]).reshape(-1, points.shape[2]).T
        found = {name: np.full(values.shape[1], value) for name, value in self.others.items()}
        return found | dict(zip(self.candidate.form.nonlinear, values, strict=True))

    def inside(self, points: Array) -> Array:
        """Points (D, S) moved to the limits where they are beyond."""
        return np.asarray(np.clip(points, self.low, self.high))


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
    of : AxisData
        Whose regressors: the data themselves, or with more noise.
    """
    if not term.candidate.delays:
        return cached_regressors(of, fitted.axis, term.candidate, term.nonlinear)
    model = fit(data, fitted.template, fitted.base, (*fitted.terms, term))
    (late_s,) = model.terms[-1].linear.values()
    in_time = model.axis_without([len(fitted.terms)])
    return (cached_effort(of, model.axis) - cached_effort(of, in_time))[None] / late_s
