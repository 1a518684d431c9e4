"""The form of an effect that is decisively better beside all the other terms.

A term enters in the form that explains most of what was left then. Beside terms that came later,
another form of the effect may do with fewer parameters, or fit better.
"""

from collections.abc import Iterable, Iterator

from edge_ident.diagnosis.fit.external_vibrations import VIBRATION
from edge_ident.diagnosis.fit.fitting import FittedModel
from edge_ident.diagnosis.select.acceptance import separable
from edge_ident.diagnosis.select.search import Search
from edge_ident.model.effects import catalogue


def in_best_forms(search: Search, model: FittedModel) -> FittedModel:
    """A model whose terms have their best forms, one term after the other.

    Parameters
    ----------
    search : Search
    model : FittedModel
    """
    for place in range(len(model.terms)):
        model = _best(search, model, _in_other_forms(search, model, place))
    return model


def _in_other_forms(search: Search, model: FittedModel, place: int) -> Iterator[FittedModel]:
    """The model with one of its terms in each other form that is promising there."""
    candidate = model.terms[place].candidate
    rest = search.fit(model.base, model.without(place))
    for scored in search.score(rest, frozenset(catalogue()) - {candidate.effect}):
        if scored.candidate not in (candidate, VIBRATION) and not scored.on_edge:
            terms = (*model.terms[:place], scored.term, *model.terms[place + 1 :])
            yield search.fit(model.base, terms)


def _best(search: Search, model: FittedModel, others: Iterable[FittedModel]) -> FittedModel:
    """The best of the others, where it is decisively better than the model."""
    best = min(others, key=search.criterion.value, default=model)
    return best if separable(search.gain(model, best)) else model
