"""The evidence for each term of a model: what the model is worth without it."""

from collections.abc import Sequence

from edge_ident.diagnosis.fit.fitting import FittedModel
from edge_ident.diagnosis.fit.held_out import held_out_residuals
from edge_ident.diagnosis.select.acceptance import Decision, Evidence, decide
from edge_ident.diagnosis.select.cross_validation import HeldOutGain, held_out_gain
from edge_ident.diagnosis.select.search import Search


def evidence_for_terms(
    search: Search, model: FittedModel
) -> tuple[list[FittedModel], list[Evidence], list[HeldOutGain]]:
    """The models without each term, and the evidence for the term."""
    residuals = held_out_residuals(search.data, model)
    smaller = [search.fit(model.base, model.without(k)) for k in range(len(model.terms))]
    gains = [held_out_gain(search.data, less, model, residuals) for less in smaller]
    evidence = [
        Evidence(search.gain(less, model), gain.supported, gain.one_off)
        for less, gain in zip(smaller, gains, strict=True)
    ]
    return smaller, evidence, gains


def staying(
    smaller: Sequence[FittedModel], model: FittedModel, evidence: Sequence[Evidence]
) -> list[Decision]:
    """Whether each term may stay in a model; `smaller` are the models without it."""
    return [
        decide(less.terms, model.terms, e, staying=True)
        for less, e in zip(smaller, evidence, strict=True)
    ]
