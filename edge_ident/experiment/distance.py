"""How far apart the predictions of two rivals are, and how far they have to be.

One rival is taken for true, at its fitted size. The other is fitted to it: what the base model, the
accepted causes and the other's own parameters (linearised) can imitate is projected out. The rest
is the distance, as in T-optimal designs (Atkinson and Fedorov, Biometrika 62 (1975) 57). The worse
direction counts. In standard deviations of the noise it is

d = √(Σ difference² / noise²),  noise² = floor² + discrepancy²,

over the compared samples, where the discrepancy is what the formulas may be off. The probability of
taking the wrong one of two known predictions is Q(d/2) (Kay, Detection Theory, 1998, section 4.3).

The diagnosis asks for more: its criterion has to gain g units, n·log(1 + d²/n) of n samples. About
d² its gain spreads with a standard deviation of 2·d. So in 99 of 100 records it is enough from

d₀ = z + √(z² + n·(exp(g/n) - 1)),  z = 2.33.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Final

import numpy as np
from numpy.typing import NDArray
from scipy.stats import norm

from edge_ident.diagnosis.fit.candidates import Candidate, grid
from edge_ident.diagnosis.select.thresholds import ADDED_TERM, DECISIVE
from edge_ident.experiment.columns import BaseColumns, Columns, Key, key
from edge_ident.experiment.rivals import Pair, form_of
from edge_ident.model.effects import catalogue, named
from edge_ident.model.model import BASE, Term
from edge_ident.model.search import Excitation

Array = NDArray[np.float64]

DECIDED: Final = 0.99
"""Share of the records in which the diagnosis is to decide for the true one: its own level for what
is very strong evidence."""
_QUANTILE: Final = float(norm.ppf(DECIDED))
_RANK: Final = 1e-10


@dataclass(frozen=True)
class Judge:
    """What the distances of one axis are measured by.

    Attributes
    ----------
    excitation : Excitation
        Of the recordings: it tells how many points of each effect the diagnosis tries.
    cache : dict
        Numbers of parameters, and penalties for those points, of terms asked for before.
    """

    excitation: Excitation
    cache: dict[Key, tuple[int, float]] = field(default_factory=dict, compare=False)

    def needed(self, pair: Pair, samples: int) -> float:
        """Distance that a pair needs: the larger of both directions."""
        costs = [self._cost(t, samples) for t in pair.terms]
        if pair.second is None:
            return _needed(ADDED_TERM.value + costs[0], samples)
        return _needed(DECISIVE.value + abs(costs[0] - costs[1]), samples)

    def _cost(self, term: Term, samples: int) -> float:
        """Penalty of a term (`edge_ident.diagnosis.select.criterion`)."""
        name = key(term)
        if name not in self.cache:
            candidate = Candidate(term.effect, form_of(term), term.source_axis)
            points = grid(candidate, self.excitation).values()
            tried = max((len(values) for values in points), default=1) or 1
            penalty = 2.0 * math.log(len(catalogue()) * tried)
            self.cache[name] = (candidate.parameter_count, penalty)
        parameters, penalty = self.cache[name]
        return parameters * math.log(samples) + penalty


def error_probability(distance: float) -> float:
    """Probability of taking the wrong one of two predictions for the true one."""
    return float(norm.sf(0.5 * distance))


def distance(pair: Pair, base: BaseColumns, columns: Mapping[Key, Columns], noise: float) -> float:
    """Distance of a pair of rivals, in standard deviations of the noise; the worse direction.

    Parameters
    ----------
    pair : Pair
    base : BaseColumns
    columns : mapping of Key to Columns
        Of every term of the pair, and of those that both rivals have.
    noise : float
        Noise floor.
    """
    common = _orthonormal([base.columns, *(columns[key(t)].derivatives for t in pair.others)])
    parts = [_beside(columns[key(t)], common) for t in pair.terms]
    known = _discrepancy(BASE, base.effort - np.mean(base.effort))
    known += sum(_discrepancy(t.effect, _left(columns[key(t)].effort, common)) for t in pair.others)
    allowed = len(base.effort) * noise**2 + known
    if pair.second is None:
        apart = float(parts[0].effort @ parts[0].effort)
        return _distance(apart, allowed + _discrepancy(pair.first.effect, parts[0].effort), base)
    first, second = parts
    own = max(
        _discrepancy(t.effect, part.effort) for t, part in zip(pair.terms, parts, strict=True)
    )
    difference = first.effort - second.effort
    ways = [_left(difference, _orthonormal([other.derivatives])) for other in (second, first)]
    return _distance(min(float(way @ way) for way in ways), allowed + own, base)


def _distance(apart: float, allowed: float, base: BaseColumns) -> float:
    found = math.sqrt(len(base.effort) * apart / allowed)
    # a prediction that is no number separates nothing
    return found if math.isfinite(found) else 0.0


def _needed(gain: float, samples: int) -> float:
    """Distance for a gain of the criterion, whose unit is n·log(error)."""
    z = _QUANTILE
    return z + math.sqrt(z**2 + samples * math.expm1(gain / samples))


def _beside(columns: Columns, basis: Array) -> Columns:
    """Columns without what a basis (n, R) spans."""
    return Columns(_left(columns.effort, basis), _left(columns.derivatives, basis), columns.raw)


def _left(rows: Array, basis: Array) -> Array:
    return np.asarray(rows - (rows @ basis) @ basis.T)


def _discrepancy(effect: str, effort: Array) -> float:
    """Sum of squares by which an effect's formula may be off."""
    return named(effect).search.discrepancy ** 2 * float(effort @ effort)


def _orthonormal(rows: Sequence[Array]) -> Array:
    """Orthonormal basis (n, R) of rows (P, n), those that hardly differ left out."""
    stacked = np.vstack([*rows])
    length = np.linalg.norm(stacked, axis=1)
    stacked = stacked[length > 0.0] / length[length > 0.0, None]
    # the eigenvectors of the small Gram matrix take a tenth of the time of a decomposition
    values, vectors = np.linalg.eigh(stacked @ stacked.T)
    kept = values > _RANK * max(float(values[-1]) if len(values) else 0.0, 1e-300)
    return np.asarray((vectors[:, kept] / np.sqrt(values[kept])).T @ stacked).T
