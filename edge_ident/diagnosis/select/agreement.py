"""Agreement: a model that all disturbed runs lead to, and the undisturbed data do not."""

from edge_ident.diagnosis.fit.fitting import FittedModel
from edge_ident.diagnosis.select.acceptance import again
from edge_ident.diagnosis.select.backward_elimination import SupportedModel, eliminate_backward
from edge_ident.diagnosis.select.search import Search
from edge_ident.diagnosis.select.stability import RUNS, DisturbedRuns


def agreed(
    search: Search, start: FittedModel, selected: SupportedModel, runs: DisturbedRuns
) -> SupportedModel:
    """The selected model or, where the disturbed runs do not find it, one that they agree on.

    The undisturbed data are one sample of many, so what they alone lead to has no precedence.
    """
    other = runs.models[0].terms
    if not other or all(again(times + 1, RUNS + 1).accepted for times in _found(runs, selected)):
        return selected
    supported = eliminate_backward(search, search.fit(start.base, other))
    all_find = all(again(times, RUNS + 1).accepted for times in _found(runs, supported))
    return supported if supported.model.terms and all_find else selected


def _found(runs: DisturbedRuns, supported: SupportedModel) -> list[int]:
    """How many of the disturbed runs find each term of a model."""
    return runs.times_found(supported.model)
