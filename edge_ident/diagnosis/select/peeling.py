"""The set of causes: peeled one after the other, several ways at once, refitted together, pruned.

A greedy choice can be wrong when two causes act together: a few of the best first choices are
followed to their ends, and the criterion decides between the finished models.
"""

from collections.abc import Iterable
from typing import Final

from edge_ident.diagnosis.fit.fitting import Fitted
from edge_ident.diagnosis.select.judging import gain
from edge_ident.diagnosis.select.search import DECISIVE, Search, present

_WIDTH: Final = 3
"""Models that are followed at once."""
_FOLLOWED: Final = 2.5
"""Error over the least at which a model, or a trial, is still followed."""
_COLOURED: Final = 0.8
"""Share of the samples that must be independent for all of them to count."""
_DEEPEST: Final = 6
"""Terms that may be added."""
_ACCUSING: Final = 2.5 * DECISIVE
"""Difference that a cause has to make: most machines have none of them, and twenty are tried."""


def peel(search: Search, start: Fitted) -> Fitted:
    """Add causes until none explains more than it costs.

    What is left may be coloured, its samples worth less than their number: then it is done again
    with as many as they are worth, and held against what of the first attempt is worth it still:
    of two large causes, neither explains much alone.
    """
    model = _peel(search, start)
    independent = search.independent(model)
    if model.found and independent < _COLOURED * search.samples:
        search.samples = independent
        again, pruned = _peel(search, start), prune(search, model)
        model = pruned if search.gain(again, pruned) > 0.0 else again
    return model


def _peel(search: Search, start: Fitted) -> Fitted:
    best = start
    beam = [start]
    for _ in range(_DEEPEST):
        grown = _distinct(model for parent in beam for model in _children(search, parent))
        if not grown:
            break
        leader = min(model.error for model in grown)
        grown = [model for model in grown if model.error < _FOLLOWED * leader]
        beam = sorted(grown, key=search.criterion)[:_WIDTH]
        beam[0] = search.polished(beam[0])
        for model in beam:
            if search.gain(best, model) > 0.0:
                best = model
    return prune(search, best)


def _children(search: Search, parent: Fitted) -> Iterable[Fitted]:
    trials = [t for t in search.trials(parent, present(parent)) if not t.on_edge]
    least = min((trial.error for trial in trials), default=0.0)
    for trial in [t for t in trials if t.error < _FOLLOWED * least][:_WIDTH]:
        if search.promised(trial, parent) > _ACCUSING:
            child = search.fit(parent.base, (*parent.found, trial.found))
            if search.gain(parent, child) > _ACCUSING and gain(search.view, parent, child).certain:
                yield child


def prune(search: Search, model: Fitted) -> Fitted:
    """Take out what the others make superfluous."""
    while model.found:
        smaller = [search.fit(model.base, model.without(k)) for k in range(len(model.found))]
        best = min(smaller, key=search.criterion)
        if search.gain(best, model) > _ACCUSING:
            return model
        model = best
    return model


def _distinct(models: Iterable[Fitted]) -> list[Fitted]:
    """One model for each set of effects, the best."""
    kept: dict[tuple[str, ...], Fitted] = {}
    for model in models:
        key = tuple(sorted(f.candidate.effect for f in model.found))
        if key not in kept or model.error < kept[key].error:
            kept[key] = model
    return list(kept.values())
