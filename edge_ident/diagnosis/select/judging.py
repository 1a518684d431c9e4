"""Whether a cause holds where it was not fitted, and which others might be it.

The residual is coloured, so intervals come from resampling whole blocks of time (Künsch, Annals of
Statistics 17 (1989) 1217).
"""

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from edge_ident.diagnosis.fit.candidates import Candidate
from edge_ident.diagnosis.fit.fitting import Fitted, deviations, held_out, shape_derivatives
from edge_ident.diagnosis.fit.trying import Trial
from edge_ident.diagnosis.fit.vibrations import VIBRATION
from edge_ident.diagnosis.prepare.view import View
from edge_ident.diagnosis.result import Rival
from edge_ident.diagnosis.select.search import DECISIVE, Search, present
from edge_ident.model.effects import named

Array = NDArray[np.float64]

_RESAMPLES: Final = 1000
_SEED: Final = 1
_ONE_OFF_BLOCKS: Final = 0.15
"""Share of the blocks that hold nine tenths of what happens only once."""
_CERTAIN: Final = 0.95
"""Share of the resamples in which a cause has to pay."""
_FROM_ZERO: Final = 3.0
"""Standard deviations at which an amplitude is not zero."""
_TRIED_RIVALS: Final = 3
_TINY: Final = float(np.finfo(float).tiny)


@dataclass(frozen=True)
class Gain:
    """Share of the residual's rms that a model takes off another's, with its interval.

    Attributes
    ----------
    above : float
        Share of the resamples in which it is more than nothing.
    one_off : bool
        Judged where it was fitted: what happens once cannot be foreseen from the rest.
    """

    value: float
    interval: tuple[float, float]
    above: float
    one_off: bool

    @property
    def certain(self) -> bool:
        """Whether it is hardly by chance; what happens once has paid for itself."""
        return self.one_off or self.above > _CERTAIN


def gain(view: View, before: Fitted, after: Fitted) -> Gain:
    """What a model gains over a smaller one, on samples that neither was fitted to."""
    return _gain(view, before, after, residuals_held_out(view, after))


def gains(search: Search, model: Fitted) -> list[Gain]:
    """What each cause of a model gains over all the others."""
    held_out_residual = residuals_held_out(search.view, model)
    smaller = [search.fit(model.base, model.without(k)) for k in range(len(model.found))]
    return [_gain(search.view, less, model, held_out_residual) for less in smaller]


def _gain(view: View, before: Fitted, after: Fitted, after_held_out: Array) -> Gain:
    if one_off(view, after.predicted - before.predicted):
        old, new = view.effort - before.predicted, view.effort - after.predicted
        return Gain(*_resampled(view, old, new), one_off=True)
    old = residuals_held_out(view, before)
    return Gain(*_resampled(view, old, after_held_out), one_off=False)


def unclear(view: View, fitted: Fitted) -> list[int]:
    """Places of what was found of which an essential amplitude may be zero."""
    essential = [named(f.candidate.effect).search.essential for f in fitted.found]
    if not any(essential):
        return []
    near_zero = np.abs(fitted.linear) < _FROM_ZERO * deviations(view, fitted)[: len(fitted.linear)]
    return [
        k
        for k, f in enumerate(fitted.found)
        for name, near in zip(f.amplitudes, near_zero[fitted.columns_of(k)], strict=True)
        if near and name in essential[k]
    ]


def residuals_held_out(view: View, fitted: Fitted) -> Array:
    """Residuals (n,) of samples that did not take part in the fit."""
    return held_out(view, fitted, shape_derivatives(view, fitted))


def one_off(view: View, effort: Array) -> bool:
    """Whether nine tenths of an effort's energy lie in a few blocks of time."""
    energy = np.bincount(view.block[view.clear], effort[view.clear] ** 2)
    present = np.bincount(view.block[view.clear]) > 0
    energy = np.sort(energy[present])[::-1]
    most = max(2, int(_ONE_OFF_BLOCKS * len(energy)))
    return bool(np.sum(energy[:most]) > 0.9 * np.sum(energy))


def _resampled(view: View, old: Array, new: Array) -> tuple[float, tuple[float, float], float]:
    """1 - rms of the new over that of the old residual, 95 % of its resamples by blocks, and the
    share of them above nothing."""
    blocks = view.block[view.clear]
    sums = np.array([np.bincount(blocks, r[view.clear] ** 2) for r in (old, new)])
    sums = sums[:, np.bincount(blocks) > 0]
    rng = np.random.default_rng(_SEED)
    drawn = rng.integers(0, sums.shape[1], (_RESAMPLES, sums.shape[1]))
    before, after = sums[:, drawn].sum(axis=2)
    gains = 1.0 - np.sqrt(after / np.maximum(before, _TINY))
    value = 1.0 - np.sqrt(np.sum(sums[1]) / max(float(np.sum(sums[0])), _TINY))
    low, high = np.percentile(gains, [2.5, 97.5])
    return float(value), (float(low), float(high)), float(np.mean(gains > 0.0))


@dataclass(frozen=True)
class Contest:
    """The rivals of a cause, and the model in which the best of them takes its place."""

    rivals: tuple[Rival, ...]
    better: Fitted | None


def contest(search: Search, model: Fitted, index: int) -> Contest:
    """Put every other effect in the place of one that was found."""
    found = model.found[index]
    rest = search.fit(model.base, model.without(index))
    trials = search.trials(rest, present(rest) | {found.candidate.effect})
    models = [(t, search.fit(rest.base, (*rest.found, t.found))) for t in trials[:_TRIED_RIVALS]]
    rivals = [
        _rival(search, model, trial.found.candidate, other)
        for trial, other in models
        if trial.found.candidate != VIBRATION
    ]
    # another kind of fault, beside one that is there already, has to be decisive
    better = [
        (search.gain(model, other) + DECISIVE * (len(_kinds(model)) - len(_kinds(other))), other)
        for trial, other in models
        if not trial.on_edge or trial.found.candidate.effect in _kinds(rest)
    ]
    gained, best = max(better, key=lambda pair: pair[0], default=(0.0, None))
    tried = {r.effect for r in rivals}
    for name in named(found.candidate.effect).search.alternatives:
        if name not in tried:
            rivals.append(_declared(name, trials, rest, model))
    return Contest(_once(rivals), best if gained > 0.0 else None)


def _kinds(model: Fitted) -> set[str]:
    return {f.candidate.effect for f in model.found}


def _rival(search: Search, model: Fitted, candidate: Candidate, other: Fitted) -> Rival:
    distance = search.gain(other, model)
    larger = np.sqrt(other.error / max(model.error, _TINY)) - 1.0
    if distance < DECISIVE:
        evidence = f"in its place it leaves as little residual ({larger:+.1%})"
    else:
        evidence = f"in its place it leaves {larger:.1%} more residual"
    experiment = named(candidate.effect).search.experiment
    return Rival(candidate.effect, bool(distance >= DECISIVE), evidence, experiment)


def _declared(name: str, trials: list[Trial], rest: Fitted, model: Fitted) -> Rival:
    errors = [t.error for t in trials if t.found.candidate.effect == name]
    experiment = named(name).search.experiment
    if not errors:
        return Rival(name, True, "in its place it explains next to nothing", experiment)
    larger = np.sqrt(min(errors) / max(model.error, _TINY)) - 1.0
    evidence = f"in its place it leaves {larger:.0%} more residual"
    return Rival(name, True, evidence, experiment)


def _once(rivals: list[Rival]) -> tuple[Rival, ...]:
    kept: dict[str, Rival] = {}
    for rival in rivals:
        kept.setdefault(rival.effect, rival)
    return tuple(kept.values())
