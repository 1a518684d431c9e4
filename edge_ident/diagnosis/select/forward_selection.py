"""Forward selection of causes by beam search.

A greedy choice can be wrong where two causes act together. So a few of the best models are followed
at once, and the criterion decides between the finished ones.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from edge_ident.diagnosis.fit.candidates import Candidate
from edge_ident.diagnosis.fit.fitting import FittedModel, FittedTerm
from edge_ident.diagnosis.fit.library import ResidualSubspace, ScoredCandidate
from edge_ident.diagnosis.fit.linear import orthonormal
from edge_ident.diagnosis.fit.refinement import FINE
from edge_ident.diagnosis.select.acceptance import Evidence, decide
from edge_ident.diagnosis.select.cross_validation import evidence_for_terms, held_out_gain, staying
from edge_ident.diagnosis.select.search import Search, independent_samples
from edge_ident.diagnosis.select.thresholds import (
    BEAM_WIDTH,
    FEWEST_INDEPENDENT,
    FOLLOWED,
    MOST_TERMS,
)
from edge_ident.model.model import axes_of


@dataclass(frozen=True)
class Selection:
    """A model that forward selection found.

    Attributes
    ----------
    model : FittedModel
    search : Search
        That it ended with. All later steps of the diagnosis use it: its criterion counts the
        independent samples, so that one criterion decides throughout.
    """

    model: FittedModel
    search: Search


def select_forward(search: Search, start: FittedModel) -> Selection:
    """Add causes to a model until none is accepted.

    A coloured residual is worth fewer independent samples than it has. Then the selection is
    repeated with that number.

    Parameters
    ----------
    search : Search
    start : FittedModel
        The base model.
    """
    model = _grown(search, start)
    samples = search.criterion.samples
    independent = independent_samples(search.data, model)
    if model.terms and independent < FEWEST_INDEPENDENT.value * samples:
        search = search.with_samples(independent)
        model = _better(search, start, model)
    return Selection(model, search)


def grown_on(search: Search, model: FittedModel, without: frozenset[str]) -> FittedModel:
    """Select on from a model, without some effects."""
    return _pruned(search, _largest(search, model, without))


def first_causes(search: Search, start: FittedModel) -> Selection:
    """What a selection from the points of the grids alone begins with, refined at its end.

    It tells how an effort is shifted beside its causes before the search is worth its time.

    Parameters
    ----------
    search : Search
    start : FittedModel
        The base model.
    """
    model = polished(search, _largest(replace(search, refines=False), start, frozenset()))
    samples = min(search.criterion.samples, independent_samples(search.data, model))
    return Selection(model, search.with_samples(samples))


def different_first(scored: Sequence[ScoredCandidate]) -> list[ScoredCandidate]:
    """The best candidate of each kind, and then the others: the beam follows one of each kind.

    Parameters
    ----------
    scored : sequence of ScoredCandidate
        The best first.
    """
    best = {_kind(s.candidate): s for s in reversed(scored)}
    return sorted(scored, key=lambda s: s is not best[_kind(s.candidate)])


def _better(fewer: Search, start: FittedModel, model: FittedModel) -> FittedModel:
    """The selection with fewer samples, or what that number leaves of the first model.

    Both compete, because of two large causes neither explains much alone.
    """
    again, pruned = _grown(fewer, start), _supported(fewer, _pruned(fewer, model))
    return pruned if fewer.gain(again, pruned) > 0.0 else again


def _grown(search: Search, start: FittedModel) -> FittedModel:
    """Grow a model whose terms support each other."""
    return _supported(search, _pruned(search, _largest(search, start, frozenset())))


def _supported(search: Search, model: FittedModel) -> FittedModel:
    """Drop what the others leave without support, and grow on without that.

    A term that entered first may have taken the place of one that was still to come.
    """
    without: frozenset[str] = frozenset()
    while (smaller := _without_weakest(search, model)) is not None:
        gone = model.effects - smaller.effects
        model = smaller
        if gone:  # and not one of several terms of an effect that stays
            without |= gone
            model = grown_on(search, model, without)
    return model


def _without_weakest(search: Search, model: FittedModel) -> FittedModel | None:
    """A model without its least supported term, if there is one that the rule does not accept."""
    smaller, evidence, gains = evidence_for_terms(search, model)
    accepted = [decision.accepted for decision in staying(smaller, model, evidence)]
    doubtful = [k for k, yes in enumerate(accepted) if not yes]
    return smaller[min(doubtful, key=lambda k: gains[k].interval[0])] if doubtful else None


def _largest(search: Search, start: FittedModel, without: frozenset[str]) -> FittedModel:
    """Add one term after the other; of all models on the way the criterion's best."""
    best = start
    beam = [start]
    for _ in range(MOST_TERMS.value - len(start.terms)):
        larger = [model for parent in beam for model in _children(search, parent, without)]
        if not larger:
            break
        least = min(model.error for model in larger)
        larger = [model for model in larger if model.error < FOLLOWED.value * least]
        beam = _distinct(sorted(larger, key=search.criterion.value))[: BEAM_WIDTH.value]
        beam[0] = polished(search, beam[0])
        for model in beam:
            if search.gain(best, model) > 0.0:
                best = model
    return best


def _children(
    search: Search, parent: FittedModel, without: frozenset[str]
) -> Iterable[FittedModel]:
    """Models with one more term that the acceptance rule accepts."""
    scored = [s for s in search.score(parent, without) if not s.on_edge]
    least = min((s.error for s in scored), default=0.0)
    followed = [s for s in scored if s.error < FOLLOWED.value * least]
    for candidate in different_first(followed)[: BEAM_WIDTH.value]:
        child = _child(search, parent, candidate)
        if child is not None:
            yield child


def _kind(candidate: Candidate) -> tuple[str, ...]:
    """What the beam tells apart: the effect, and the other axes that take part in it.

    A weight that follows the own angle, and one that follows the sum of both, leave different
    things for the next cause.
    """
    return candidate.effect, *axes_of(candidate.source, ())


def _child(search: Search, parent: FittedModel, scored: ScoredCandidate) -> FittedModel | None:
    """A model with one more term, or None where that is not accepted.

    The evidence is collected in the order of its cost: score, fit, cross-validation.
    """
    terms = (*parent.terms, scored.term)
    decided = partial(decide, parent.terms)
    expected = Evidence(search.criterion.expected_gain(scored, parent))
    if not decided(terms, expected).accepted:
        return None
    child = search.fit(parent.base, terms)
    gain = search.gain(parent, child)
    if not decided(child.terms, Evidence(gain)).accepted:
        return None
    held_out = held_out_gain(search.data, parent, child)
    evidence = Evidence(gain, held_out.supported, held_out.one_off)
    return child if decided(child.terms, evidence).accepted else None


def _pruned(search: Search, model: FittedModel) -> FittedModel:
    """A model without the terms that the others make superfluous."""
    while model.terms:
        smaller = [search.fit(model.base, model.without(k)) for k in range(len(model.terms))]
        best = min(smaller, key=search.criterion.value)
        evidence = Evidence(search.gain(best, model))
        if decide(best.terms, model.terms, evidence).accepted:
            return model
        model = best
    return model


def _distinct(ranked: Iterable[FittedModel]) -> list[FittedModel]:
    """The first model of each set of kinds."""
    kept: dict[tuple[tuple[str, ...], ...], FittedModel] = {}
    for model in ranked:
        kept.setdefault(tuple(sorted(_kind(t.candidate) for t in model.terms)), model)
    return list(kept.values())


# Nonlinear parameters of a model, each term once more beside all the others.
#
# A term enters at the best values for what was left then. A search that refines nothing
# has the points of its library, among them those of the model that it is to find again.


def polished(search: Search, fitted: FittedModel) -> FittedModel:
    """A model with the nonlinear parameters of each term as they are best beside all the others.

    Parameters
    ----------
    search : Search
    fitted : FittedModel
    """
    for place, term in enumerate(fitted.terms):
        if not (term.candidate.form.nonlinear and _may_change(search, term)):
            continue
        rest = search.fit(fitted.base, fitted.without(place))
        # the inertia may be free beside this term, and not without it
        others = np.delete(fitted.jacobian, fitted.columns_of(place), axis=1)[search.data.valid]
        basis = orthonormal(others)
        subspace = replace(ResidualSubspace.of(search.data, rest), basis=basis, adds_up=False)
        better = _best(search, subspace, term)
        terms = (*fitted.terms[:place], better.term, *fitted.terms[place + 1 :])
        candidate = search.fit(fitted.base, terms)
        if candidate.error < fitted.error:
            fitted = candidate
    return fitted


def _may_change(search: Search, term: FittedTerm) -> bool:
    """Whether there is more than one value to choose from."""
    return search.refines or term.candidate in search.library


def _best(search: Search, subspace: ResidualSubspace, term: FittedTerm) -> ScoredCandidate:
    """A term at its best values: between the points of its grid, or at one of the library."""
    candidate, grid = term.candidate, search.grids[term.candidate]
    if search.refines:
        here = ScoredCandidate(term, np.inf)
        return search.refinements.refined(subspace, here, grid, FINE)
    points, rows = search.library.points[candidate], search.library[candidate]
    return subspace.score_at(candidate, points, rows, grid)
