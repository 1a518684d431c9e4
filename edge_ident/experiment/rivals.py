"""Rivals: explanations of one axis that its recordings do not tell apart.

A cause and its inseparable alternatives are rivals of each other. A suspected cause is a rival of
its absence, and so is an effect that the recordings could not have shown. The latter has no fitted
size. It is taken at the size from which the diagnosis calls it not testable.
"""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import combinations
from typing import Final

import numpy as np
from scipy.stats import norm

from edge_ident.diagnosis.fit.candidates import Candidate, grid, term
from edge_ident.diagnosis.result import AxisDiagnosis, Cause
from edge_ident.diagnosis.select.thresholds import ADDED_TERM, DECISIVE, NOT_TESTABLE
from edge_ident.experiment.compared import BaseColumns, Columns, Compared, Key, key, term_effort
from edge_ident.experiment.result import LeftOut, Why
from edge_ident.model.effects import catalogue, named
from edge_ident.model.model import BASE, Array, AxisModel, Term
from edge_ident.model.search import Excitation, Form
from edge_ident.signals.metrics import rms

_SMALL: Final = 1e-6  # amplitude at which all effects are nearly linear
_NO_SECOND_AXIS: Final = "the recordings have no second axis, whose motion would show it"
_NOT_ALONE: Final = "no motion of this drive alone shows it"
_TIED: Final = "it belongs to the time of its recording: repeat the recording"


@dataclass(frozen=True)
class Pair:
    """Two explanations beside the terms that both have.

    Attributes
    ----------
    first : Term
    second : Term or None
        None for the absence of the first.
    others : tuple of Term
        Accepted causes, and effects that the axis is known to have.
    why : Why
    """

    first: Term
    second: Term | None
    others: tuple[Term, ...]
    why: Why

    @property
    def terms(self) -> tuple[Term, ...]:
        """Its own one or two."""
        return (self.first,) if self.second is None else (self.first, self.second)


@dataclass(frozen=True)
class Rivals:
    """All pairs of one axis, and what no motion can test.

    Attributes
    ----------
    pairs : tuple of Pair
    left_out : mapping of effect to reason
    """

    pairs: tuple[Pair, ...]
    left_out: Mapping[str, str]

    def reported(self, axis: str) -> tuple[LeftOut, ...]:
        """What was left out, for the result."""
        return tuple(LeftOut(axis, effect, reason) for effect, reason in self.left_out.items())


@dataclass(frozen=True)
class Typical:
    """At which size an effect is tested that no recording has shown.

    Attributes
    ----------
    base : AxisModel
        The base term alone.
    excitation : Excitation
    reference : Compared
        A lively motion, along which the effect has this size.
    effort : float
        Rms of the base model's effort along it.
    source : str or None
        Another axis that moves, and is in the recordings.
    """

    base: AxisModel
    excitation: Excitation
    reference: Compared
    effort: float
    source: str | None

    def term_of(self, name: str) -> Term | None:
        """The effect with typical nonlinear parameters; None where this motion shows none of it."""
        for form in named(name).search.forms:
            if form.coupled and self.source is None:
                continue
            if form.rotary and self.base.position_unit != "rad":
                continue
            return self._sized(Candidate(name, form, self.source if form.coupled else None))
        return None

    def _sized(self, candidate: Candidate) -> Term | None:
        """All linear parameters contribute alike, as the diagnosis tests for it."""
        points = grid(candidate, self.excitation)
        middle = {name: float(np.sort(values)[len(values) // 2]) for name, values in points.items()}
        if not candidate.form.linear:
            return term(candidate, middle, {})
        lengths = {
            name: self._length(term(candidate, middle, {name: _SMALL}))
            for name in candidate.form.linear
        }
        if min(lengths.values()) <= np.finfo(float).eps * self.effort:
            return None
        linear = {name: _SMALL / length for name, length in lengths.items()}
        together = self._length(term(candidate, middle, {n: _SMALL * v for n, v in linear.items()}))
        scale = NOT_TESTABLE * self.effort * _SMALL / together
        bounds = named(candidate.effect).bounds
        sized = {n: float(np.clip(scale * v, *bounds[n])) for n, v in linear.items()}
        return term(candidate, middle, sized)

    def _length(self, small: Term) -> float:
        return rms(term_effort(self.reference, self.base, small))


def rivals(axis: AxisDiagnosis, typical: Typical) -> Rivals:
    """What the diagnosis of an axis leaves open."""
    left_out: dict[str, str] = {}
    pairs: list[Pair] = []
    for cause in axis.causes:
        others = _without(axis.model.terms[1:], cause.term)
        pairs += _apart(cause, others, left_out)
    known = axis.model.terms[1:]
    for cause in axis.suspected:
        if named(cause.term.effect).tied_to_time:
            left_out[cause.term.effect] = _TIED
            continue
        pairs += _apart(cause, known, left_out)
        pairs.append(Pair(cause.term, None, known, Why.SUSPECTED))
    seen = {t.effect for pair in pairs for t in pair.terms}
    for missing in axis.not_testable:
        if missing.effect in seen:
            continue
        if named(missing.effect).tied_to_time:
            left_out[missing.effect] = _TIED
            continue
        found = typical.term_of(missing.effect)
        if found is None:
            alone = typical.source is None and named(missing.effect).needs_source
            left_out[missing.effect] = _NO_SECOND_AXIS if alone else _NOT_ALONE
        else:
            pairs.append(Pair(found, None, known, Why.UNTESTED))
    return Rivals(tuple(pairs), left_out)


def _apart(cause: Cause, others: tuple[Term, ...], left_out: dict[str, str]) -> Iterator[Pair]:
    """Pairs of a cause and its inseparable alternatives.

    What is tied to time does not come back with the motion: there its absence is the rival.
    """
    found = [a.term for a in cause.inseparable if a.term is not None]
    if not found:
        return
    lasting = [t for t in (cause.term, *found) if not named(t.effect).tied_to_time]
    if not lasting:
        left_out[cause.term.effect] = _TIED
    if len(lasting) <= len(found):
        yield from (Pair(t, None, others, Why.ALTERNATIVE) for t in lasting)
    for first, second in combinations(lasting, 2):
        yield Pair(first, second, others, Why.ALTERNATIVE)


def _without(terms: tuple[Term, ...], left: Term) -> tuple[Term, ...]:
    """Terms but the one of this effect that is nearest in its values."""
    same = [t for t in terms if (t.effect, t.source_axis) == (left.effect, left.source_axis)]
    if not same:
        return terms
    nearest = min(same, key=lambda t: _difference(t, left))
    return tuple(t for t in terms if t is not nearest)


def _difference(one: Term, other: Term) -> float:
    names = other.values.keys() & one.values.keys()
    return float(sum(abs(float(one.values[n]) - float(other.values[n])) for n in names))


def form_of(found: Term) -> Form:
    """The simplest form of its effect that has all nonzero parameters of a term."""
    nonzero = {name for name, value in found.values.items() if float(value) != 0.0}
    forms = [
        form
        for form in named(found.effect).search.forms
        if nonzero <= {*form.linear, *form.nonlinear}
        and form.coupled == (found.source_axis is not None)
    ]
    every = named(found.effect).search.forms
    return min(forms or every, key=lambda form: len(form.linear) + len(form.nonlinear))


# How far apart the predictions of two rivals are, and how far they have to be.
#
# One rival is taken for true, at its fitted size. The other is fitted to it: what the base model,
# the accepted causes and the other's own parameters (linearised) can imitate is projected out. The
# rest is the distance, as in T-optimal designs (Atkinson and Fedorov, Biometrika 62 (1975) 57). The
# worse direction counts. In standard deviations of the noise it is
#
# d = √(Σ difference² / noise²), noise² = floor² + discrepancy²,
#
# over the compared samples, where the discrepancy is what the formulas may be off. The probability
# of taking the wrong one of two known predictions is Q(d/2) (Kay, Detection Theory, 1998, section
# 4.3).
#
# The diagnosis asks for more: its criterion has to gain g units, n·log(1 + d²/n) of n samples.
# About d² its gain spreads with a standard deviation of 2·d. So in 99 of 100 records it is enough
# from
#
# d₀ = z + √(z² + n·(exp(g/n) - 1)), z = 2.33.

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
            return _needed(ADDED_TERM + costs[0], samples)
        return _needed(DECISIVE + abs(costs[0] - costs[1]), samples)

    def _cost(self, term: Term, samples: int) -> float:
        """Penalty of a term (`edge_ident.diagnosis.select.search`)."""
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
