"""Backward elimination and replacement: from the selected model to one that every rule supports."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from edge_ident.diagnosis.fit.external_vibrations import VIBRATION
from edge_ident.diagnosis.fit.fitting import FittedModel, build
from edge_ident.diagnosis.fit.own_columns import own_columns
from edge_ident.diagnosis.prepare.axis_data import AxisData
from edge_ident.diagnosis.result import Refused
from edge_ident.diagnosis.select.acceptance import Decision
from edge_ident.diagnosis.select.alternatives import ComparedAlternatives, compare_alternatives
from edge_ident.diagnosis.select.cross_validation import HeldOutGain, near_zero
from edge_ident.diagnosis.select.evidence import evidence_for_terms, staying
from edge_ident.diagnosis.select.forms import in_best_forms, with_another_form
from edge_ident.diagnosis.select.polishing import polished
from edge_ident.diagnosis.select.search import Search
from edge_ident.diagnosis.select.thresholds import MOST_ROUNDS
from edge_ident.model.model import Term


@dataclass(frozen=True)
class SupportedTerm:
    """What the last round says of one term of the model; `minor` where it is not worth naming."""

    gain: HeldOutGain
    decision: Decision
    comparison: ComparedAlternatives
    minor: bool = False


@dataclass(frozen=True)
class SupportedModel:
    """The result of backward elimination.

    Attributes
    ----------
    model : FittedModel
    support : tuple of SupportedTerm
        One for each term of the model.
    refused : tuple of Refused
        Effects that left the model.
    converged : bool
        Whether the last round left the model as it was.
    """

    model: FittedModel
    support: tuple[SupportedTerm, ...]
    refused: tuple[Refused, ...]
    converged: bool

    @property
    def vibrations(self) -> tuple[Term, ...]:
        """External vibrations, the strongest first."""
        found = [t for t in self.model.terms if t.candidate == VIBRATION]
        found.sort(key=lambda t: -math.hypot(*t.linear.values()))
        return tuple(t.model_term for t in found)

    def of(self, model: FittedModel, places: Sequence[int]) -> "SupportedModel":
        """The same for a model with some of the terms, by their places."""
        return replace(self, model=model, support=tuple(self.support[k] for k in places))

    def without_vibrations(self, data: AxisData) -> "SupportedModel":
        """The model of the axis itself; parameters stay as they were fitted beside vibrations."""
        own = [t.candidate != VIBRATION for t in self.model.terms]
        support = tuple(s for s, mine in zip(self.support, own, strict=True) if mine)
        return replace(self, model=without_vibrations(data, self.model), support=support)


def without_vibrations(data: AxisData, model: FittedModel) -> FittedModel:
    """A model without external vibrations; parameters stay as they were fitted beside them."""
    own = [t.candidate != VIBRATION for t in model.terms]
    return model if all(own) else _without_terms(data, model, own)


def _without_terms(data: AxisData, fitted: FittedModel, kept: Sequence[bool]) -> FittedModel:
    """A fitted model with only some of its terms; all parameters stay as they are."""
    terms = tuple(t for t, keep in zip(fitted.terms, kept, strict=True) if keep)
    sizes = [fitted.base_columns.stop, *(len(t.linear) for t in fitted.terms)]
    columns = np.repeat([True, *kept], sizes)
    axis = build(fitted.template, fitted.base, terms)
    predicted = data.predicted(axis) + own_columns(data) @ fitted.own
    residual = (data.effort - predicted)[data.valid]
    return replace(
        fitted,
        axis=axis,
        terms=terms,
        predicted=predicted,
        derivatives=fitted.derivatives[:, columns],
        free=fitted.free[columns],
        error=float(residual @ residual),
    )


@dataclass(frozen=True)
class _Round:
    """One look at all terms of a model; `change` is the better model, or None."""

    gains: Sequence[HeldOutGain]
    decisions: Sequence[Decision]
    comparisons: Sequence[ComparedAlternatives]
    change: FittedModel | None
    refused: Refused | None


def eliminate_backward(search: Search, model: FittedModel) -> SupportedModel:
    """Drop terms that the rule does not accept; replace terms by better alternatives.

    Parameters
    ----------
    search : Search
    model : FittedModel
        The selected model.
    """
    refused: list[Refused] = []
    model = polished(search, in_best_forms(search, model))
    for remaining in reversed(range(MOST_ROUNDS.value + 1)):
        seen = _look(search, model)
        if seen.change is None or not remaining:
            break
        refused += [seen.refused] if seen.refused else []
        model = polished(search, in_best_forms(search, seen.change))
    comparisons = seen.comparisons or [
        compare_alternatives(search, model, k) for k in range(len(model.terms))
    ]
    support = map(SupportedTerm, seen.gains, seen.decisions, comparisons)
    left = [r for r in refused if r.effect not in model.effects | {VIBRATION.effect}]
    return SupportedModel(
        model, tuple(support), tuple(dict.fromkeys(left)), converged=seen.change is None
    )


def _look(search: Search, model: FittedModel) -> _Round:
    """Decide on every term; find what to change first.

    What cross-validation does not support leaves before alternatives are compared, and a better
    alternative comes before a term with an essential parameter near zero leaves.
    """
    smaller, evidence, gains = evidence_for_terms(search, model)
    decisions = staying(smaller, model, evidence)
    if all(d.accepted for d in decisions):
        comparisons = [compare_alternatives(search, model, k) for k in range(len(model.terms))]
        better = [k for k, c in enumerate(comparisons) if c.replacement is not None]
        if better:
            return _replaced(search, model, gains, decisions, comparisons)
        close = near_zero(search.data, model)
        evidence = [replace(e, near_zero=n) for e, n in zip(evidence, close, strict=True)]
        decisions = staying(smaller, model, evidence)
    else:
        comparisons, close = [], [()] * len(decisions)
    doubtful = [k for k, d in enumerate(decisions) if not d.accepted]
    if not doubtful:
        return _Round(gains, decisions, comparisons, None, None)
    weakest = min(doubtful, key=lambda k: gains[k].interval[0])
    refused = Refused(model.terms[weakest].candidate.effect, decisions[weakest].reason)
    change = search.fit(model.base, model.without(weakest))
    if set(close[weakest]) & set(model.terms[weakest].nonlinear):
        change = with_another_form(search, change, model.terms[weakest].candidate)
    return _Round(gains, decisions, comparisons, change, refused)


def _replaced(
    search: Search,
    model: FittedModel,
    gains: Sequence[HeldOutGain],
    decisions: Sequence[Decision],
    comparisons: Sequence[ComparedAlternatives],
) -> _Round:
    """The round in which the best alternative takes the place of a term."""
    ranked = [
        (search.criterion.value(c.replacement), k, c)
        for k, c in enumerate(comparisons)
        if c.replacement is not None and c.decision is not None
    ]
    _, place, best = min(ranked, key=lambda entry: entry[0])
    assert best.replacement is not None
    assert best.decision is not None
    new = best.replacement.terms[-1].candidate.effect
    reason = f"{new.replace('_', ' ')} in its place is preferred: {best.decision.reason}"
    refused = Refused(model.terms[place].candidate.effect, reason, new)
    return _Round(gains, decisions, comparisons, best.replacement, refused)
