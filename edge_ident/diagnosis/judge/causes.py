"""The terms of a model as causes: values, deviations, gains, decisions, evidence."""

from collections.abc import Iterable, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from edge_ident.diagnosis.fit.external_vibrations import VIBRATION
from edge_ident.diagnosis.fit.held_out import deviations_by_term
from edge_ident.diagnosis.result import Cause
from edge_ident.diagnosis.select.backward_elimination import SupportedModel, SupportedTerm
from edge_ident.model.effects import named
from edge_ident.model.model import Term

Array = NDArray[np.float64]


def causes(
    supported: SupportedModel, shares: Sequence[float], deviations: Array
) -> tuple[Cause, ...]:
    """Terms of a model as causes, in the order of the terms.

    Parameters
    ----------
    supported : SupportedModel
    shares : sequence of float
        Of each term (`edge_ident.diagnosis.fit.own_effort`).
    deviations : (P,) array
        Standard deviations of linear and nonlinear parameters.
    """
    model = supported.model
    found = []
    stds = deviations_by_term(model, deviations)
    for t, support, share, std in zip(model.terms, supported.support, shares, stds, strict=True):
        term = t.model_term
        values = {name: float(np.asarray(value)) for name, value in term.values.items()}
        found.append(_cause(replace(term, values=values, std=std), share, support))
    return tuple(found)


def strongest_first(causes: Iterable[Cause]) -> tuple[Cause, ...]:
    """Causes in the order of their shares."""
    return tuple(sorted(causes, key=lambda cause: -cause.share))


def _cause(term: Term, share: float, support: SupportedTerm) -> Cause:
    gain = support.gain
    where = "where it acts" if gain.one_off else "in segments that it was not fitted to"
    evidence = (
        f"{_signature(term)}; the part that the base model cannot express is {share:.1%} of the "
        "effort"
    )
    if gain.value > 0.0:
        evidence += f", and it reduces the residual by {gain.value:.0%} {where}"
    return Cause(
        term=term,
        held_out_gain=gain.value,
        held_out_gain_interval=gain.interval,
        share=share,
        alternatives=support.comparison.alternatives,
        evidence=evidence,
        decision=support.decision.reason,
    )


def _signature(term: Term) -> str:
    if term.effect == VIBRATION.effect:
        return "a sinusoid in time"
    return named(term.effect).search.signature
