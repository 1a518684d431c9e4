"""What a model found in one recording is worth on another.

Base and extended model are scored like for like: inside the same physical bounds, on the same
samples of the other recording. The offset is fitted anew for each, because it drifts from one day
to the next. Terms that are tied to the time of their recording are left out.

Each cause is judged by leaving it out: the rest is fitted again to the first recording, and both
models predict the other one. A cause carries over if the residual there is smaller with it. The 95 %
interval is that of sums over blocks of time, because the residual is coloured. What does not carry
over leaves the model, the worst first, until the rest does.
"""

from dataclasses import dataclass, replace
from typing import Final

import numpy as np
import scipy.special
from numpy.typing import NDArray

from edge_ident.diagnosis.fit.fitting import FittedModel, fit, solve
from edge_ident.diagnosis.fit.summary import nonzero_rms
from edge_ident.diagnosis.prepare.axis_data import AxisData
from edge_ident.diagnosis.result import CarriedCause, Validation
from edge_ident.model.effects import named
from edge_ident.model.model import BASE, PARAMETERS, AxisModel, Term
from edge_ident.signals.metrics import rms

Array = NDArray[np.float64]

_LEVEL: Final = 0.975
"""Quantile of the intervals' ends."""
_TINY: Final = float(np.finfo(float).tiny)


@dataclass(frozen=True)
class Gain:
    """Relative reduction of a residual's rms, with its 95 % interval."""

    value: float
    interval: tuple[float, float]

    @property
    def certain(self) -> bool:
        """Whether the residual certainly falls."""
        return self.interval[0] > 0.0


@dataclass(frozen=True)
class Carried:
    """What is left of a model after another recording has judged it.

    Attributes
    ----------
    model : FittedModel
        Fitted to the first recording, with the terms that carry over and those tied to time.
    kept : tuple of int
        Places of its terms in the model that was judged.
    validation : Validation
        Its causes are in the order of that model's terms.
    """

    model: FittedModel
    kept: tuple[int, ...]
    validation: Validation


def carry_over(data: AxisData, other: AxisData, base: FittedModel, model: FittedModel) -> Carried:
    """Let another recording judge the terms of a model.

    Parameters
    ----------
    data : AxisData
        That the models were fitted to.
    other : AxisData
        The same axis in another recording.
    base : FittedModel
        Fitted without any added term.
    model : FittedModel
        Without external vibrations.
    """
    kept = tuple(range(len(model.terms)))
    judged: dict[int, CarriedCause] = {}
    found, left = model, _residual(other, model)
    as_found = left
    while weighed := _weighed(data, other, found, kept, left):
        judged |= {k: cause for k, (cause, _) in weighed.items()}
        doubtful = [k for k, (cause, _) in weighed.items() if not cause.carries_over]
        if not doubtful:
            break
        worst = min(doubtful, key=lambda k: weighed[k][0].interval[0])
        found = weighed[worst][1]
        left = _residual(other, found)
        kept = tuple(k for k in kept if k != worst)
    causes = tuple(
        judged.get(k, _not_judged(t.candidate.effect)) for k, t in enumerate(model.terms)
    )
    start = _residual(other, base)
    scale = nonzero_rms(other.effort[other.valid])
    shares = (rms(residual) / scale for residual in (start, left, as_found))
    return Carried(found, kept, Validation(*shares, causes))


def _weighed(
    data: AxisData, other: AxisData, model: FittedModel, places: tuple[int, ...], left: Array
) -> dict[int, tuple[CarriedCause, FittedModel]]:
    """Each term that is not tied to time, by its place, and the model fitted without it."""
    scale = nonzero_rms(other.effort[other.valid])
    found = {}
    for k, place in enumerate(places):
        effect = model.terms[k].candidate.effect
        if named(effect).tied_to_time:
            continue
        less = fit(data, model.template, model.base, model.without(k))
        without = _residual(other, less)
        gain = gain_of(other.block[other.valid], without, left)
        cause = CarriedCause(
            effect,
            rms(without) / scale,
            gain.value,
            gain.interval,
            gain.certain,
            _reason(gain),
        )
        found[place] = (cause, less)
    return found


def _reason(gain: Gain) -> str:
    low, high = gain.interval
    if gain.certain:
        return f"it reduces the residual of the other recording by {low:.1%} to {high:.1%}"
    if high < 0.0:
        return f"it raises the residual of the other recording by {-high:.1%} to {-low:.1%}"
    return (
        "it does not certainly reduce the residual of the other recording: by "
        f"{low:.1%} to {high:.1%}"
    )


def _not_judged(effect: str) -> CarriedCause:
    reason = "it is tied to the time of its recording, and another one says nothing about it"
    return CarriedCause(effect, None, None, None, None, reason)


def _residual(other: AxisData, model: FittedModel) -> Array:
    """What a model leaves at the valid samples of another recording, its offset fitted anew."""
    residual = (other.effort - other.predicted(_carried_axis(model.axis)))[other.valid]
    one = Term(BASE, {**dict.fromkeys(PARAMETERS, 0.0), "offset": 1.0})
    column = other.predicted(AxisModel((one,)))[other.valid, None]
    return np.asarray(residual - column @ solve(column, residual))


def _carried_axis(axis: AxisModel) -> AxisModel:
    """The physical axis, without the terms that are tied to the time of their recording."""
    base = axis.terms[0]
    values = {
        name: max(float(base.values[name]), low) for name, (low, _) in named(BASE).bounds.items()
    }
    terms = [t for t in axis.terms[1:] if not named(t.effect).tied_to_time]
    return replace(axis, terms=(replace(base, values=values), *terms))


def gain_of(block: NDArray[np.intp], before: Array, after: Array) -> Gain:
    """Relative reduction of the rms from one residual to another.

    The logarithm of the ratio of two sums over B blocks is nearly normal. Its variance is that of
    the blocks' parts of it (the delta method), with B - 1 degrees of freedom.

    Parameters
    ----------
    block : (n,) array of int
        Numbers of the blocks of time.
    before, after : (n,) arrays
    """
    present = np.bincount(block) > 0
    old, new = (np.bincount(block, r**2)[present] for r in (before, after))
    total_old, total_new = max(float(np.sum(old)), _TINY), max(float(np.sum(new)), _TINY)
    ratio = 0.5 * np.log(total_new / total_old)
    blocks = len(old)
    if blocks < 2:
        return Gain(float(1.0 - np.exp(ratio)), (-np.inf, 1.0))
    parts = 0.5 * (new / total_new - old / total_old)
    std = np.sqrt(blocks / (blocks - 1.0) * float(parts @ parts))
    reach = float(scipy.special.stdtrit(blocks - 1, _LEVEL)) * std
    ends = (float(1.0 - np.exp(ratio + reach)), float(1.0 - np.exp(ratio - reach)))
    return Gain(float(1.0 - np.exp(ratio)), ends)


def shown_in(data: AxisData, model: FittedModel, sources: tuple[str, ...]) -> list[tuple[str, ...]]:
    """In which of several recordings each term shows: those whose residual certainly falls.

    Parameters
    ----------
    data : AxisData
        Of all recordings together.
    model : FittedModel
        Fitted to them.
    sources : tuple of str
        Names of the recordings.
    """
    if len(sources) == 1:
        return [sources for _ in model.terms]
    lengths = [len(s.sample_index) for s in data.segments]
    of_file = np.repeat(np.arange(len(sources)), lengths)
    found = []
    for k in range(len(model.terms)):
        less = fit(data, model.template, model.base, model.without(k))
        shows = []
        for number, source in enumerate(sources):
            here = data.valid & (of_file == number)
            before, after = ((data.effort - m.predicted)[here] for m in (less, model))
            if gain_of(data.block[here], before, after).certain:
                shows.append(source)
        found.append(tuple(shows))
    return found
