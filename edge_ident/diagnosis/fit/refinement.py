"""Refinement: from the best point of a grid to the best nonlinear parameters between its points."""

from collections.abc import Hashable, Mapping
from dataclasses import dataclass, field
from typing import Final

import numpy as np
from numpy.typing import NDArray

from edge_ident.diagnosis.fit.candidates import Candidate
from edge_ident.diagnosis.fit.descent import descended
from edge_ident.diagnosis.fit.fitting import FittedTerm
from edge_ident.diagnosis.fit.library import Grid
from edge_ident.diagnosis.fit.projection import around
from edge_ident.diagnosis.fit.scoring import ResidualSubspace, ScoredCandidate
from edge_ident.model.effects import named

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

    @property
    def terms(self) -> tuple[FittedTerm, ...]:
        """All that were found."""
        return tuple(scored.term for scored in self.cache.values())

    def refined(
        self,
        subspace: ResidualSubspace,
        scored: ScoredCandidate,
        grid: Grid,
        most_rounds: int = _ROUNDS,
    ) -> ScoredCandidate:
        """See `refined`."""
        key = (most_rounds, *_context(subspace, scored))
        if key not in self.cache:
            self.cache[key] = refined(subspace, scored, grid, most_rounds)
        return self.cache[key]

    def descended(
        self, subspace: ResidualSubspace, starts: tuple[ScoredCandidate, ...], grid: Grid
    ) -> list[ScoredCandidate]:
        """See `edge_ident.diagnosis.fit.descent.descended`."""
        keys = [("from", *_context(subspace, start)) for start in starts]
        if not all(key in self.cache for key in keys):
            self.cache.update(zip(keys, descended(subspace, starts, grid), strict=True))
        return [self.cache[key] for key in keys]


def _context(subspace: ResidualSubspace, scored: ScoredCandidate) -> tuple[Hashable, ...]:
    """Of a candidate's refinement: from where, and what the model leaves."""
    left = float(subspace.residual @ subspace.residual)
    return (scored.candidate, *scored.term.nonlinear.values(), scored.error, left)


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
