"""Other forms of an effect in a term's place, or in the place of one that has left.

A term enters in the form that explains most of what was left then. Beside terms that came later,
another form of the effect may do with fewer parameters, or fit better.
"""

from dataclasses import replace

from edge_ident.diagnosis.fit.candidates import Candidate
from edge_ident.diagnosis.fit.external_vibrations import VIBRATION
from edge_ident.diagnosis.fit.fitting import FittedModel, FittedTerm
from edge_ident.diagnosis.fit.scoring import ScoredCandidate
from edge_ident.diagnosis.select.acceptance import Evidence, decide, separable
from edge_ident.diagnosis.select.cross_validation import near_zero
from edge_ident.diagnosis.select.search import Search
from edge_ident.model.effects import catalogue
from edge_ident.model.model import acting, turned


def in_best_forms(search: Search, model: FittedModel) -> FittedModel:
    """A model whose terms have their best forms, one term after the other: each the one that is
    decisively better beside all the others, where there is one.

    A form with a known parameter, as the period of a turn, is preferred where no other is
    decisively better.

    Parameters
    ----------
    search : Search
    model : FittedModel
    """
    model = _in_best_senses(search, model)
    for place, term in enumerate(model.terms):
        rest = search.fit(model.base, model.without(place))
        before, after = model.terms[:place], model.terms[place + 1 :]
        forms = [s.term for s in _others(search, rest, term.candidate) if not s.on_edge]
        models = [search.fit(model.base, (*before, form, *after)) for form in forms]
        better = [other for other in models if _preferred(search, model, other, place)]
        model = min(better, key=search.criterion.value, default=model)
    return model


def _in_best_senses(search: Search, model: FittedModel) -> FittedModel:
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


def _preferred(search: Search, model: FittedModel, other: FittedModel, place: int) -> bool:
    """Whether another model, with another form of one term, takes the place of a model."""
    known = [m.terms[place].candidate.form.known for m in (model, other)]
    if known[1] and not known[0]:
        preferred = not separable(search.gain(other, model))
    else:
        preferred = separable(search.gain(model, other))
    # one whose essential parameters nothing tells would leave again in the next round
    return preferred and not near_zero(search.data, other)[place]


def with_another_form(search: Search, rest: FittedModel, candidate: Candidate) -> FittedModel:
    """A model with another form of an effect that has left, where that is accepted: a wave over the
    stroke, so long that nothing tells its period, is a parabola.

    Parameters
    ----------
    search : Search
    rest : FittedModel
        The other terms.
    candidate : Candidate
        That has left.
    """
    for scored in _others(search, rest, candidate):
        form = search.fit(rest.base, (*rest.terms, scored.term))
        if decide(rest.terms, form.terms, Evidence(search.gain(rest, form))).accepted:
            return form
    return rest


def _others(search: Search, rest: FittedModel, candidate: Candidate) -> list[ScoredCandidate]:
    """Other forms of a candidate's effect that are promising on top of a model."""
    found = search.score(rest, frozenset(catalogue()) - {candidate.effect})
    return [scored for scored in found if scored.candidate not in (candidate, VIBRATION)]
