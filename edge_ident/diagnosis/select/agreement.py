"""Agreement: a model that all disturbed runs lead to, and the undisturbed data do not."""

from edge_ident.diagnosis.fit.fitting import FittedModel
from edge_ident.diagnosis.select.acceptance import again
from edge_ident.diagnosis.select.backward_elimination import SupportedModel, eliminate_backward
from edge_ident.diagnosis.select.search import Search
from edge_ident.diagnosis.select.stability import RUNS, DisturbedRuns


def agreed(
    search: Search, start: FittedModel, selected: SupportedModel, runs: DisturbedRuns
) -> tuple[SupportedModel, list[int]]:
    """The selected model or, where the disturbed runs do not find it, one that they agree on.

    The undisturbed data are one sample of many, so what they alone lead to has no precedence.

    Returns
    -------
    SupportedModel
    list of int
        How many of the disturbed runs find each of its terms.
    """
    times = runs.times_found(selected.model)
    other = runs.models[0].terms
    if not other or all(again(found + 1, RUNS + 1).accepted for found in times):
        return selected, times
    supported = eliminate_backward(search, search.fit(start.base, other))
    other_times = runs.times_found(supported.model)
    all_find = all(again(found, RUNS + 1).accepted for found in other_times)
    return (supported, other_times) if other_times and all_find else (selected, times)
