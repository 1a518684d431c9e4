"""Cross-validation of causes: whether they reduce the residual where they were not fitted.

The residual is coloured, so intervals come from a bootstrap of whole blocks of time (Künsch, Annals
of Statistics 17 (1989) 1217).
"""

from dataclasses import dataclass
from functools import cache
from itertools import chain
from typing import Final

import numpy as np
from numpy.typing import NDArray

from edge_ident.diagnosis.fit.fitting import FittedModel
from edge_ident.diagnosis.fit.held_out import (
    deviations_by_term,
    held_out_residuals,
    joint_deviation,
    standard_deviations,
)
from edge_ident.diagnosis.prepare.axis_data import AxisData
from edge_ident.diagnosis.select.causes_in_time import overlapping
from edge_ident.diagnosis.select.thresholds import (
    BOOTSTRAP_SEED,
    NONZERO,
    ONE_OFF_BLOCKS,
    ONE_OFF_ENERGY,
    RESAMPLES,
    SIZED,
)
from edge_ident.model.effects import named

Array = NDArray[np.float64]

_TINY: Final = float(np.finfo(float).tiny)


@dataclass(frozen=True)
class HeldOutGain:
    """Relative reduction of the held-out residual's rms by a model against a smaller one.

    Attributes
    ----------
    value : float
    interval : (float, float)
        95 % of the bootstrap resamples.
    supported : float
        Share of the resamples in which it is positive.
    one_off : bool
        Computed from the fitted residual instead: what happens once cannot be predicted.
    """

    value: float
    interval: tuple[float, float]
    supported: float
    one_off: bool


def held_out_gain(
    data: AxisData, before: FittedModel, after: FittedModel, after_held_out: Array | None = None
) -> HeldOutGain:
    """Compute the gain of a model over a smaller one.

    Parameters
    ----------
    after_held_out : (n,) array, optional
        Held-out residuals of `after`, where they are known.
    """
    if is_one_off(data, after.predicted - before.predicted):
        old, new = data.effort - before.predicted, data.effort - after.predicted
        return HeldOutGain(*_bootstrap(data, old, new), one_off=True)
    new = held_out_residuals(data, after) if after_held_out is None else after_held_out
    return HeldOutGain(*_bootstrap(data, held_out_residuals(data, before), new), one_off=False)


def near_zero(data: AxisData, fitted: FittedModel) -> list[tuple[str, ...]]:
    """Essential parameters of each term that lie within a few deviations of zero."""
    essential = [named(t.candidate.effect).search.essential for t in fitted.terms]
    if not any(essential):
        return [() for _ in fitted.terms]
    found = []
    stds = deviations_by_term(fitted, standard_deviations(data, fitted))
    for t, names, std in zip(fitted.terms, essential, stds, strict=True):
        values = {**t.linear, **t.nonlinear}
        near = [name for name in std if abs(values[name]) < NONZERO.value * std[name]]
        found.append(tuple(name for name in near if name in names))
    return found


def unsized(data: AxisData, fitted: FittedModel) -> list[bool]:
    """Whether each linear parameter of a term is as uncertain as it is large, for each term.

    Of what is tied to time, the size counts at the shape that was found: a high short pulse may be
    as good as a low long one. Pulses that overlap are one event of a shape that no single one has.
    How it is divided among them may be uncertain where its size is not; noise gives it a size with
    each of them.
    """
    stds = deviations_by_term(fitted, standard_deviations(data, fitted))
    unknown = [
        bool(t.linear)
        and all(abs(value) < SIZED.value * std[name] for name, value in t.linear.items())
        for t, std in zip(fitted.terms, stds, strict=True)
    ]
    for event in chain.from_iterable(overlapping(fitted).values()):
        count = sum(len(fitted.terms[k].linear) for k in event)
        if any(unknown[k] for k in event) and (len(event) > 1 or count == 1):
            share = joint_deviation(data, fitted, event)
            unsure = bool(SIZED.value * np.sqrt(count) * share > 1.0)
            unknown = [unsure if k in event else was for k, was in enumerate(unknown)]
    return unknown


def is_one_off(data: AxisData, effort: Array) -> bool:
    """Whether nearly all energy of an effort (n,) lies in a few blocks of time."""
    energy = np.bincount(data.block[data.valid], effort[data.valid] ** 2)
    present = np.bincount(data.block[data.valid]) > 0
    energy = np.sort(energy[present])[::-1]
    most = max(2, int(ONE_OFF_BLOCKS.value * len(energy)))
    return bool(np.sum(energy[:most]) > ONE_OFF_ENERGY.value * np.sum(energy))


def _bootstrap(data: AxisData, old: Array, new: Array) -> tuple[float, tuple[float, float], float]:
    """1 - rms(new)/rms(old), its 95 % interval, and the share of resamples above zero."""
    blocks = data.block[data.valid]
    sums = np.array([np.bincount(blocks, r[data.valid] ** 2) for r in (old, new)])
    sums = sums[:, np.bincount(blocks) > 0]
    before, after = sums @ _drawn(sums.shape[1])
    gains = 1.0 - np.sqrt(after / np.maximum(before, _TINY))
    value = 1.0 - np.sqrt(np.sum(sums[1]) / max(float(np.sum(sums[0])), _TINY))
    low, high = np.percentile(gains, [2.5, 97.5])
    return float(value), (float(low), float(high)), float(np.mean(gains > 0.0))


@cache
def _drawn(blocks: int) -> Array:
    """How often each resample holds each block, (B, R)."""
    rng = np.random.default_rng(BOOTSTRAP_SEED.value)
    drawn = rng.integers(0, blocks, (RESAMPLES.value, blocks))
    counts = [np.bincount(sample, minlength=blocks) for sample in drawn]
    return np.array(counts, dtype=np.float64).T
