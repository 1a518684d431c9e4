"""Fits of models with a delay of many samples, whose effect is not linear."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from edge_ident.diagnosis.fit.candidates import Candidate, cached_effort, cached_regressors
from edge_ident.diagnosis.fit.fitting import FittedModel, FittedTerm, fit
from edge_ident.diagnosis.fit.scoring import ScoredCandidate
from edge_ident.diagnosis.prepare.axis_data import AxisData
from edge_ident.model.effect import Effect
from edge_ident.model.effects import catalogue
from edge_ident.model.model import AxisModel


def delay() -> Effect:
    """The effect that shifts the effort."""
    return next(effect for effect in catalogue().values() if effect.effort_delay)


def fit_late(
    data: AxisData,
    template: AxisModel,
    base: NDArray[np.float64],
    terms: Sequence[FittedTerm],
    late_s: float,
) -> FittedModel:
    """Fit a model whose last term is a delay, from about where it is.

    First all else is fitted beside a delay of that size: what it is without a delay says nothing of
    what a longer one changes.

    Parameters
    ----------
    template : AxisModel
        The axis with the effects that it is known to have.
    base : (4,) array
        Base parameters to start from.
    terms : sequence of FittedTerm
        The other terms to add.
    late_s : float
        By about which the effort is late.
    """
    effect = delay()
    (form,) = effect.search.forms
    late = FittedTerm(Candidate(effect.name, form), {}, {effect.effort_delay: late_s})
    held = fit(data, replace(template, terms=(*template.terms, late.model_term)), base, terms)
    return fit(data, template, held.base, (*held.terms, late))


def scored_late(data: AxisData, fitted: FittedModel) -> ScoredCandidate:
    """A delay beside the terms of a model, as fitted: a score of first order says little of it."""
    model = fit_late(data, fitted.template, fitted.base, fitted.terms, data.late_s)
    return ScoredCandidate(model.terms[-1], model.error)


def rows_beside(
    data: AxisData, fitted: FittedModel, term: FittedTerm, of: AxisData
) -> NDArray[np.float64]:
    """Regressors (k, n) of a candidate beside a model; of a delay what it changes, per s.

    Parameters
    ----------
    data : AxisData
        That the model is fitted to.
    fitted : FittedModel
    term : FittedTerm
    of : AxisData
        Whose regressors: the data themselves, or with more noise.
    """
    if not term.candidate.delays:
        return cached_regressors(of, fitted.axis, term.candidate, term.nonlinear)
    model = fit(data, fitted.template, fitted.base, (*fitted.terms, term))
    (late_s,) = model.terms[-1].linear.values()
    in_time = model.axis_without([len(fitted.terms)])
    return (cached_effort(of, model.axis) - cached_effort(of, in_time))[None] / late_s
