"""The terms of a model as causes: values, deviations, gains, decisions, evidence."""

from collections.abc import Iterable, Sequence
from dataclasses import replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from edge_ident.diagnosis.fit.candidates import Candidate
from edge_ident.diagnosis.fit.external_vibrations import VIBRATION
from edge_ident.diagnosis.fit.fitting import FittedModel
from edge_ident.diagnosis.fit.held_out import deviations_by_term
from edge_ident.diagnosis.fit.linear import orthonormal
from edge_ident.diagnosis.result import Cause, NotTestable
from edge_ident.diagnosis.select.search import Search
from edge_ident.diagnosis.select.selection import SupportedModel, SupportedTerm
from edge_ident.diagnosis.select.thresholds import DECISIVE, INDISTINGUISHABLE, NOT_TESTABLE
from edge_ident.model.effects import catalogue, named
from edge_ident.model.model import Term
from edge_ident.signals.metrics import rms

Array = NDArray[np.float64]


def causes(
    supported: SupportedModel, shares: Sequence[float], deviations: Array
) -> tuple[Cause, ...]:
    """Terms of a model as causes, in the order of the terms.

    Parameters
    ----------
    shares : sequence of float
        Of each term (`edge_ident.diagnosis.fit.summary`).
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


# Testability: effects that this motion does not distinguish from the base model.


_TINY: Final = float(np.finfo(float).tiny)


def not_testable(search: Search, model: FittedModel, noise: float) -> tuple[NotTestable, ...]:
    """Effects outside a model that could be large without being noticed.

    Parameters
    ----------
    noise : float
        Rms of the model's residual at the valid samples.
    """
    data = search.data
    effort = rms(data.effort[data.valid])
    basis = orthonormal(model.jacobian[data.valid])
    missing = []
    for name in catalogue():
        if name in model.effects or (_of_angles(name) and search.template.position_unit != "rad"):
            continue
        experiment = named(name).search.experiment
        if named(name).needs_source and not data.other_axes:
            reason = "no other axis moves in this recording"
            missing.append(NotTestable(name, reason, experiment))
            continue
        hidden = min(
            (
                _unnoticed_effort(search, basis, candidate, noise)
                for candidate in search.library
                if candidate.effect == name
            ),
            default=0.0,
        )
        if hidden > NOT_TESTABLE * effort:
            reason = _reason(
                hidden / effort, "beside the causes" if model.terms else "in this motion"
            )
            missing.append(NotTestable(name, reason, experiment))
    return tuple(missing)


def _of_angles(name: str) -> bool:
    """Whether an effect is one of joints alone."""
    return all(form.rotary for form in named(name).search.forms)


def _unnoticed_effort(search: Search, basis: Array, candidate: Candidate, noise: float) -> float:
    """Rms effort that a candidate with typical parameters may have without being noticed."""
    cost = search.penalty(candidate) + DECISIVE
    noticed = noise * np.sqrt(np.expm1(cost / search.samples))
    share = float(np.median(_orthogonal_shares(search.library.rows[candidate], basis)))
    return float(noticed / share) if share > np.finfo(float).eps else np.inf


def _orthogonal_shares(rows: Array, basis: Array) -> Array:
    """Length (D,) of the component of an effort that is orthogonal to a basis (n, R), over its
    whole length.

    All linear parameters contribute alike, with their regressors (D, k, n).
    """
    length = np.linalg.norm(rows, axis=2, keepdims=True)
    effort = np.sum(rows / np.maximum(length, _TINY), axis=1)
    orthogonal = effort - (effort @ basis) @ basis.T
    whole = np.linalg.norm(effort, axis=1)
    return np.asarray(np.linalg.norm(orthogonal, axis=1) / np.maximum(whole, _TINY))


def _reason(hidden: float, where: str) -> str:
    """In words; `hidden` is relative to the effort."""
    if hidden > INDISTINGUISHABLE:
        return f"{where} it looks exactly like the base model's terms"
    return f"{where} it could make up {hidden:.0%} of the effort and not be noticed"
