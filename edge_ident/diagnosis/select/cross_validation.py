"""Cross-validation of causes: whether they reduce the residual where they were not fitted."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from edge_ident.diagnosis.fit.external_vibrations import VIBRATION
from edge_ident.diagnosis.fit.fitting import FittedModel, FittedTerm
from edge_ident.diagnosis.fit.held_out import (
    Gain,
    deviations_by_term,
    gain_of,
    held_out_residuals,
    joint_deviation,
    standard_deviations,
)
from edge_ident.diagnosis.prepare.axis_data import AxisData
from edge_ident.diagnosis.select.acceptance import Decision, Evidence, decide
from edge_ident.diagnosis.select.search import Search
from edge_ident.diagnosis.select.thresholds import (
    NONZERO,
    ONE_OFF_BLOCKS,
    ONE_OFF_ENERGY,
    SIZED,
)
from edge_ident.model.effects import named

Array = NDArray[np.float64]


def held_out_gain(
    data: AxisData, before: FittedModel, after: FittedModel, after_held_out: Array | None = None
) -> Gain:
    """Compute the gain of a model over a smaller one.

    Parameters
    ----------
    after_held_out : (n,) array, optional
        Held-out residuals of `after`, where they are known.
    """
    if is_one_off(data, after.predicted - before.predicted):
        old, new = data.effort - before.predicted, data.effort - after.predicted
        return replace(_by_blocks(data, old, new), one_off=True)
    new = held_out_residuals(data, after) if after_held_out is None else after_held_out
    return _by_blocks(data, held_out_residuals(data, before), new)


def _by_blocks(data: AxisData, old: Array, new: Array) -> Gain:
    return gain_of(data.block[data.valid], old[data.valid], new[data.valid])


def near_zero(data: AxisData, fitted: FittedModel) -> list[tuple[str, ...]]:
    """Essential parameters of each term that lie within a few deviations of zero."""
    essential = [named(t.candidate.effect).search.essential for t in fitted.terms]
    if not any(essential):
        return [() for _ in fitted.terms]
    found = []
    stds = deviations_by_term(fitted, standard_deviations(data, fitted))
    for t, names, std in zip(fitted.terms, essential, stds, strict=True):
        values = {**t.linear, **t.nonlinear}
        near = [name for name in std if abs(values[name]) < NONZERO * std[name]]
        found.append(tuple(name for name in near if name in names))
    return found


def unsized(data: AxisData, fitted: FittedModel) -> list[bool]:
    """Whether a term, together with the others of its law, is as uncertain as it is large.

    How a size is divided among terms that overlap may be uncertain where their sum is not. Noise
    gives it a size with each of them.
    """
    found = [False] * len(fitted.terms)
    for places in {fitted.of_law(t) for t in fitted.terms}:
        count = sum(len(fitted.terms[k].linear) for k in places)
        if count:
            unsure = SIZED * np.sqrt(count) * joint_deviation(data, fitted, places) > 1.0
            for k in places:
                found[k] = bool(unsure)
    return found


def is_one_off(data: AxisData, effort: Array) -> bool:
    """Whether nearly all energy of an effort (n,) lies in a few blocks of time."""
    energy = np.bincount(data.block[data.valid], effort[data.valid] ** 2)
    present = np.bincount(data.block[data.valid]) > 0
    energy = np.sort(energy[present])[::-1]
    most = max(2, int(ONE_OFF_BLOCKS * len(energy)))
    return bool(np.sum(energy[:most]) > ONE_OFF_ENERGY * np.sum(energy))


def tied_to_time(term: FittedTerm) -> bool:
    """Whether a term is a cause in time; a vibration is none, and stands in time alone."""
    return term.candidate != VIBRATION and named(term.candidate.effect).tied_to_time


# The evidence for each term of a model: what the model is worth without it.


def evidence_for_terms(
    search: Search, model: FittedModel, smaller: Sequence[FittedModel]
) -> tuple[list[Evidence], list[Gain]]:
    """The evidence for each term; `smaller` are the models without it."""
    residuals = held_out_residuals(search.data, model)
    gains = [held_out_gain(search.data, less, model, residuals) for less in smaller]
    evidence = [
        Evidence(search.gain(less, model), gain.supported, gain.one_off)
        for less, gain in zip(smaller, gains, strict=True)
    ]
    return evidence, gains


def staying(
    smaller: Sequence[FittedModel], model: FittedModel, evidence: Sequence[Evidence]
) -> list[Decision]:
    """Whether each term may stay in a model; `smaller` are the models without it."""
    return [
        decide(less.terms, model.terms, e, staying=True)
        for less, e in zip(smaller, evidence, strict=True)
    ]
