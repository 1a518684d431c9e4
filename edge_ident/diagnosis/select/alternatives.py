"""Other effects and other forms in the place of a cause, and which of them its motion separates."""

from collections.abc import Callable, Sequence, Set
from dataclasses import dataclass, replace
from functools import cached_property, partial
from typing import Final

import numpy as np

from edge_ident.diagnosis.fit.external_vibrations import VIBRATION
from edge_ident.diagnosis.fit.fitting import FittedModel, FittedTerm
from edge_ident.diagnosis.fit.library import ResidualSubspace, ScoredCandidate
from edge_ident.diagnosis.fit.refinement import refined
from edge_ident.diagnosis.result import Alternative
from edge_ident.diagnosis.select.acceptance import Decision, Evidence, decide, separable
from edge_ident.diagnosis.select.cross_validation import near_zero
from edge_ident.diagnosis.select.search import LeftOut, Search
from edge_ident.diagnosis.select.thresholds import DECISIVE, MOST_FITTED
from edge_ident.model.effects import catalogue, named
from edge_ident.model.model import acting, turned

_TINY: Final = float(np.finfo(float).tiny)


@dataclass(frozen=True)
class ComparedAlternatives:
    """A cause and its alternatives.

    Attributes
    ----------
    replacement : FittedModel or None
        The model with the best alternative in the place of the cause, where that is accepted.
    decision : Decision or None
        On the best alternative.
    """

    replacement: FittedModel | None
    decision: Decision | None
    described: Callable[[], tuple[Alternative, ...]]

    @cached_property
    def alternatives(self) -> tuple[Alternative, ...]:
        """The nearest first; those that these recordings cannot test are left out.

        They are fitted when somebody asks: only those of the causes that are named are shown.
        """
        return self.described()


def compare_alternatives(
    search: Search, model: FittedModel, index: int, gone: LeftOut = frozenset()
) -> ComparedAlternatives:
    """Fit the best alternatives in the place of one term of a model, other forms of its effect
    among them.

    Parameters
    ----------
    index : int
        Place of the term.
    gone : frozenset of str or Candidate
        What left the model, and does not return.
    """
    term = model.terms[index]
    rest = search.fit(model.base, model.without(index))
    scored = search.score(rest, frozenset({term.candidate.effect}))[:MOST_FITTED]
    forms = search.score(rest, gone | frozenset(catalogue()) - {term.candidate.effect})
    forms = [s for s in forms if s.candidate not in (term.candidate, VIBRATION)]
    models = [(s, search.fit(rest.base, (*rest.terms, s.term))) for s in (*scored, *forms)]
    decisions = [
        (_decision(search, model, index, other), other)
        for s, other in models
        if (not s.on_edge or s.candidate.effect in rest.effects)
        and not gone & {s.candidate, s.candidate.effect}
        and _enters(search, rest, other)
    ]
    decision, best = max(decisions, key=lambda pair: pair[0].margin, default=(None, None))
    accepted = decision is not None and decision.accepted
    described = partial(_described, search, model, rest, index, models[: len(scored)])
    return ComparedAlternatives(best if accepted else None, decision, described)


def _decision(search: Search, model: FittedModel, index: int, other: FittedModel) -> Decision:
    """Whether the last term of another model may take the place of one of a model.

    Another form of the same effect has to be decisively better; but one with a known parameter, as
    the period of a turn, is preferred where it is not decisively worse.
    """
    gain = search.gain(model, other)
    here, there = model.terms[index].candidate, other.terms[-1].candidate
    if here.effect != there.effect:
        return decide(model.terms, other.terms, Evidence(gain))
    if near_zero(search.data, other)[-1]:
        return Decision(False, "its essential parameters are not determined", -np.inf)
    margin = gain + DECISIVE * (bool(there.form.known) - bool(here.form.known) or -1)
    return Decision(margin > 0.0, f"another form of it gains {gain:.0f} units", margin)


def _described(
    search: Search,
    model: FittedModel,
    rest: FittedModel,
    index: int,
    models: Sequence[tuple[ScoredCandidate, FittedModel]],
) -> tuple[Alternative, ...]:
    """The alternatives that were fitted beside the rest, then what is declared and was not."""
    subspace = ResidualSubspace.of(search.data, rest)
    found = [
        _fitted_alternative(search, model, rest, _closest(search, subspace, rest, s, other))
        for s, other in models
        if s.candidate != VIBRATION
    ]
    declared = set(named(model.terms[index].candidate.effect).search.alternatives)
    untried = declared - {alternative.effect for alternative in found}
    found += [_scored_alternative(s, model) for s in _on_grid(search, subspace, untried)]
    return _first_of_each(found)


def _enters(search: Search, rest: FittedModel, other: FittedModel) -> bool:
    """Whether a model would be accepted without the term that is to be replaced."""
    return decide(rest.terms, other.terms, Evidence(search.gain(rest, other))).accepted


def _closest(
    search: Search,
    subspace: ResidualSubspace,
    rest: FittedModel,
    scored: ScoredCandidate,
    other: FittedModel,
) -> FittedModel:
    """The other model, at nonlinear parameters that are as near to the best ones as those of a
    cause that was refined again and again: a wave along the stroke may be a load or a ripple."""
    candidate = scored.candidate
    if not candidate.form.nonlinear or candidate.descends:
        return other
    term = refined(subspace, scored, search.grids[candidate]).term
    return min(other, search.fit(rest.base, (*rest.terms, term)), key=lambda fitted: fitted.error)


def _fitted_alternative(
    search: Search, model: FittedModel, rest: FittedModel, other: FittedModel
) -> Alternative:
    """The alternative is the last term of the other model.

    Where neither explains all but noise, the two differ by more than what both leave, or the motion
    does not separate them: what is missing may be what makes the difference.
    """
    added = other.terms[-1].model_term
    term = replace(added, values={name: float(np.asarray(v)) for name, v in added.values.items()})
    decided = separable(search.gain(other, model))
    hidden = other.error - model.error < model.error - search.noise
    apart = (decided and not hidden) or search.gain(rest, other) < 0.0
    larger = np.sqrt(other.error / max(model.error, _TINY)) - 1.0
    if apart or decided:
        than = "smaller" if larger < 0.0 else "larger"
        evidence = f"in its place the residual is {abs(larger):.1%} {than}"
        evidence += "" if apart else ", and both leave more than that"
    else:
        evidence = f"in its place the residual is as small ({larger:+.1%})"
    return Alternative(term.effect, apart, evidence, named(term.effect).search.experiment, term)


def _on_grid(
    search: Search, subspace: ResidualSubspace, effects: Set[str]
) -> list[ScoredCandidate]:
    """Candidates of these effects on the residual of a model, at the best points of their grids."""
    others = frozenset(candidate.effect for candidate in search.library.points) - effects
    scored = subspace.score_library(search.library, search.grids, others)
    return sorted(scored, key=lambda s: s.error)


def _scored_alternative(scored: ScoredCandidate, model: FittedModel) -> Alternative:
    """An alternative that the effect's file declares, and that was not worth a fit: it explains
    little, or what explains more is not physical or follows the noise of the encoder."""
    effect = scored.candidate.effect
    larger = np.sqrt(scored.error / max(model.error, _TINY)) - 1.0
    if larger > 0.0:
        evidence = f"in its place the residual is {larger:.0%} larger, at the best values tried"
    else:
        evidence = "what fits in its place is not physical, or follows the noise of the encoder"
    return Alternative(effect, True, evidence, named(effect).search.experiment)


def _first_of_each(alternatives: list[Alternative]) -> tuple[Alternative, ...]:
    kept: dict[str, Alternative] = {}
    for alternative in alternatives:
        kept.setdefault(alternative.effect, alternative)
    return tuple(kept.values())


def in_best_senses(search: Search, model: FittedModel) -> FittedModel:
    """A model in which each joint counts its angle in the better sense, in all terms at once: a
    model keeps to the sense of the term that entered first, when it had no other beside it."""
    senses = [t.candidate.source for t in model.terms if t.candidate.form.senses]
    for axis in sorted({one.axis for source in senses for one in acting(source, ())}):
        terms = tuple(_turned(term, axis) for term in model.terms)
        other = search.fit(model.base, terms)
        if separable(search.gain(model, other)):
            model = other
    return model


def _turned(term: FittedTerm, axis: str) -> FittedTerm:
    candidate = term.candidate
    if candidate.source is None or not candidate.form.senses:
        return term
    return replace(term, candidate=replace(candidate, source=turned(candidate.source, axis)))
