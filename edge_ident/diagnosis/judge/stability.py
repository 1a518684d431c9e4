"""Stability selection: a cause is supported where disturbed data lead to it again.

The search is repeated on data that are disturbed by less than their noise (Meinshausen and Bühlmann
2010): on every second recorded effort, and with white noise of the floor's rms added to the effort.
That leaves about half of what the recordings say, at the same penalty for every parameter. So a
term enters there where the criterion prefers it at all.
Waveforms are compared and not parameters, because the parameters of one friction curve trade places
freely. So do several waves of one effect, or of loads along the stroke, and what they add up to is
compared as well. The motion is undisturbed. So the regressors of the first search serve all runs.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Final, Self

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from edge_ident.diagnosis.fit.external_vibrations import VIBRATION
from edge_ident.diagnosis.fit.fitting import FittedModel, FittedTerm
from edge_ident.diagnosis.fit.summary import base_space, own_efforts
from edge_ident.diagnosis.prepare.axis_data import AxisData
from edge_ident.diagnosis.select.acceptance import Decision, again, same_size
from edge_ident.diagnosis.select.backward_elimination import SupportedModel, eliminate_backward
from edge_ident.diagnosis.select.cross_validation import tied_to_time
from edge_ident.diagnosis.select.forward_selection import select_again
from edge_ident.diagnosis.select.search import Search
from edge_ident.diagnosis.select.thresholds import DISTURBED, KEPT_TERM, SAME_WAVEFORM
from edge_ident.model.effects import named
from edge_ident.model.search import ChangesWith
from edge_ident.signals.metrics import rms

Array = NDArray[np.float64]


_TINY: Final = float(np.finfo(float).tiny)

RUNS: Final = DISTURBED.value + DISTURBED.value
"""Disturbed runs: every second recorded effort, the others, and the copies with noise."""


@dataclass(frozen=True)
class DisturbedRuns:
    """What the search finds on disturbed data.

    Attributes
    ----------
    data : AxisData
        Undisturbed.
    space : (n, R) array
        Orthonormal basis of what the base model can express.
    models : tuple of FittedModel
        One for each run.
    efforts : tuple of (T, n) array
        Own effort of each term of these models.
    """

    data: AxisData
    space: Array
    models: tuple[FittedModel, ...]
    efforts: tuple[Array, ...]

    def of(self, models: Sequence[FittedModel]) -> Self:
        """The same with what other runs found."""
        efforts = tuple(own_efforts(self.data, model, self.space) for model in models)
        return replace(self, models=tuple(models), efforts=efforts)

    def times_found(self, model: FittedModel) -> list[int]:
        """How many of the runs find each term of a model, or with others that trade places with it
        what they add up to."""
        wanted = own_efforts(self.data, model, self.space)
        found = [
            self._found(model, wanted, run, seen)
            for run, seen in zip(self.models, self.efforts, strict=True)
        ]
        return [int(times) for times in np.sum(found, axis=0)]

    def _found(
        self, model: FittedModel, wanted: Array, run: FittedModel, seen: Array
    ) -> NDArray[np.bool_]:
        """Which terms (T,) of a model, of own efforts (T, n), one run finds."""
        alone = np.array([_among(effort, seen) for effort in wanted], dtype=np.bool_)
        found = alone.copy()
        for place in np.flatnonzero(~alone).tolist():
            alike, theirs = (_alike(of, model.terms[place]) for of in (model, run))
            lost = [k for k in alike if not alone[k]]
            apart = np.sum(wanted[alike], axis=0) - np.sum(seen[theirs], axis=0)
            found[place] = _same(apart, np.sum(wanted[lost], axis=0))
        return found


def disturbed_runs(
    search: Search,
    start: FittedModel,
    model: FittedModel,
    noise: float,
    on_run: Callable[[int], None] = lambda run: None,
) -> DisturbedRuns:
    """Repeat a search on disturbed data, `RUNS` times.

    Parameters
    ----------
    search : Search
    start : FittedModel
        The base model.
    model : FittedModel
        That the search found.
    noise : float
        Rms of the noise of the filtered effort.
    on_run : callable
        Gets the number of runs that are done.
    """
    data = search.data
    points = replace(search.with_refined_points(model), added=KEPT_TERM)
    models = []
    for done, disturbed in enumerate(_disturbed(data, noise)):
        on_run(done)
        run = points.on(disturbed)
        most = float(np.count_nonzero(data.valid))
        models.append(select_again(run, run.fit(start.base, ()), most))
    on_run(RUNS)
    return DisturbedRuns(data, base_space(data, start), (), ()).of(models)


def _disturbed(data: AxisData, noise: float) -> Iterator[AxisData]:
    """The copies: every second recorded effort, the others, and noise from every seed."""
    for first in range(DISTURBED.value):
        efforts = [s.sampled(_every_second(s.raw_effort, first)) for s in data.segments]
        change = np.concatenate(efforts) - data.effort
        # what is fast in the effort folds into the band, and can be more than noise there
        change *= min(1.0, noise / max(rms(change[data.valid]), _TINY))
        yield replace(data, effort=data.effort + change)
    for seed in range(DISTURBED.value):
        rng = np.random.default_rng(seed)
        added = noise * rng.standard_normal(len(data.effort))
        yield replace(data, effort=data.effort + added)


def _every_second(raw: Array, first: int) -> Array:
    """An effort (M,) interpolated between every second of its samples."""
    at = np.arange(len(raw))
    return np.asarray(CubicSpline(at[first::2], raw[first::2])(at))


def _alike(model: FittedModel, term: FittedTerm) -> list[int]:
    """Places of the added terms that trade places freely with a term: those of its effect and, with
    a load along the stroke, all of these."""
    along = _load_along_stroke(term)
    others = [k for k, t in enumerate(model.terms) if along and _load_along_stroke(t)]
    return sorted({*model.of_effect(term), *others})


def _load_along_stroke(term: FittedTerm) -> bool:
    """Whether a term is a sum of waves, bumps or bends over the position, and of nothing else."""
    effect, form = named(term.candidate.effect), term.candidate.form
    more = any(effect.overrides(hook) for hook in ("inertia", "friction"))
    return form.changes is ChangesWith.STROKE and effect.overrides("load") and not more


def _among(effort: Array, seen: Array) -> bool:
    """Whether an effort (n,) has the waveform of one of a run's efforts (T, n)."""
    return any(_same(effort - other, effort) for other in seen)


def _same(apart: Array, effort: Array) -> bool:
    """Whether two efforts (n,) that differ by so much have one waveform."""
    return bool(rms(apart) < SAME_WAVEFORM.value * rms(effort))


# Agreement: a model that all disturbed runs lead to, and the undisturbed data do not.


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


# Whether both halves of the data show a cause with the same size.
#
# A cause is a law of the machine, so it holds throughout: early and late, at low and high speed, at
# small and large acceleration. What only looks like it does not. The loop answers a sweep as a
# delay would, by another delay at every frequency, and a spring that is called a delay is another
# delay at every speed.
#
# Each time the data are divided so that both halves have half of the energy of the cause's own
# effort.

Places = NDArray[np.intp]


def decide_halves(data: AxisData, model: FittedModel, space: Array) -> list[Decision | None]:
    """For each added term, whether the halves agree; None for what is tied to time.

    The decision is that on the two halves that agree least.

    Parameters
    ----------
    data : AxisData
    model : FittedModel
    space : (n, R) array
        Of the base model's columns (`own_effort.base_space`).
    """
    residual, block = (data.effort - model.predicted)[data.valid], data.block[data.valid]
    divisions = _divisions(data)
    decisions: list[Decision | None] = []
    for term, own in zip(model.terms, own_efforts(data, model, space), strict=True):
        if term.candidate == VIBRATION or tied_to_time(term):
            decisions.append(None)
            continue
        each = []
        for parts, order in divisions.items():
            halves = [_scale(own[k], residual[k], block[k]) for k in _halves(own, order)]
            (first, first_std), (second, second_std) = halves
            each.append(same_size(first, second, float(np.hypot(first_std, second_std)), parts))
        decisions.append(min(each, key=lambda decision: decision.margin))
    return decisions


def _divisions(data: AxisData) -> dict[tuple[str, str], Places]:
    """What the halves are called, and the valid samples in the order in which they are divided."""
    speed, acceleration = (
        np.abs(data.of_motion(name)[data.valid]) for name in ("velocity", "acceleration")
    )
    return {
        ("early", "late"): np.arange(len(speed)),
        ("at low speed", "at high speed"): np.argsort(speed, kind="stable"),
        ("at small acceleration", "at large"): np.argsort(acceleration, kind="stable"),
    }


def _halves(own: Array, order: Places) -> tuple[Places, Places]:
    """Samples of either half, from a cause's own effort (n,)."""
    energy = np.cumsum(own[order] ** 2)
    middle = int(np.searchsorted(energy, 0.5 * energy[-1]))
    return order[:middle], order[middle:]


def _scale(own: Array, residual: Array, block: NDArray[np.intp]) -> tuple[float, float]:
    """By what a half would multiply a cause's own effort (n,), and its standard deviation.

    The deviation is robust to coloured residuals: the products of effort and residual are summed
    by blocks of time (Liang and Zeger, Biometrika 73 (1986) 13).

    Parameters
    ----------
    own, residual : (n,) arrays
        Own effort of the cause, and what the model leaves.
    block : (n,) array of int
        Numbers of the blocks of time.
    """
    energy = max(float(own @ own), _TINY)
    change = float(own @ residual) / energy
    scores = np.bincount(block, own * (residual - change * own))
    return 1.0 + change, float(np.linalg.norm(scores)) / energy
