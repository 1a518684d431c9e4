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
    the runs find of it has: another model takes its place only where it has an effect more, and the
    criterion prefers it to these terms. What the runs do not find stays to be suspected otherwise.

    Returns
    -------
    SupportedModel
    list of int
        How many of the runs find each of its terms, the undisturbed one among them.
    """
    times = [number + 1 for number in runs.times_found(selected.model)]
    found = [again(number, RUNS + 1).accepted for number in times]
    other = runs.models[0].terms
    if not other or all(found):
        return selected, times
    terms = tuple(t for t, kept in zip(selected.model.terms, found, strict=True) if kept)
    if {t.candidate.effect for t in other} <= {t.candidate.effect for t in terms}:
        return selected, times
    supported = eliminate_backward(search, search.fit(start.base, other))
    other_times = runs.times_found(supported.model)
    all_find = all(again(number, RUNS + 1).accepted for number in other_times)
    preferred = search.gain(search.fit(start.base, terms), supported.model) > 0.0
    if not (other_times and all_find and preferred):
        return selected, times
    undisturbed = runs.of((selected.model,)).times_found(supported.model)
    return supported, [sum(pair) for pair in zip(other_times, undisturbed, strict=True)]
