"""Agreement: a model that all disturbed runs lead to, and the undisturbed data do not."""

from edge_ident.diagnosis.fit.fitting import FittedModel
from edge_ident.diagnosis.judge.stability import RUNS, DisturbedRuns
from edge_ident.diagnosis.select.acceptance import again
from edge_ident.diagnosis.select.backward_elimination import SupportedModel, eliminate_backward
from edge_ident.diagnosis.select.search import Search


def agreed(
    search: Search, start: FittedModel, selected: SupportedModel, runs: DisturbedRuns
) -> tuple[SupportedModel, list[int]]:
    """The selected model or, where the disturbed runs do not find it, one that they agree on.

    The undisturbed data are one sample of many, so what they alone lead to has no precedence. What
    the runs find of it has: another model takes its place only where it has a term that the
    selected one lacks, and where the criterion prefers it to what they find.

    Returns
    -------
    SupportedModel
    list of int
        How many of the runs find each of its terms, the undisturbed one among them.
    """
    times = [number + 1 for number in runs.times_found(selected.model)]
    found = [again(number, RUNS + 1).accepted for number in times]
    other = runs.models[0]
    undisturbed = runs.of((selected.model,))
    if all(found) or all(undisturbed.times_found(other)):
        return selected, times
    supported = eliminate_backward(search, search.fit(start.base, other.terms))
    other_times = runs.times_found(supported.model)
    all_find = all(again(number, RUNS + 1).accepted for number in other_times)
    terms = tuple(t for t, kept in zip(selected.model.terms, found, strict=True) if kept)
    preferred = search.gain(search.fit(start.base, terms), supported.model) > 0.0
    if not (other_times and all_find and preferred):
        return selected, times
    also = undisturbed.times_found(supported.model)
    return supported, [sum(pair) for pair in zip(other_times, also, strict=True)]
