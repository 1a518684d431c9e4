"""Curves beside the causes of a model: what agrees in all parts of the recordings, and in another.

A law says more than a curve: it has few parameters, and holds beyond what was recorded. So curves
take what the base model and the causes leave. Where another recording judges, a curve stays if it
certainly makes the prediction of that one better.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from edge_ident.diagnosis.budget.agreement import agreeing_curves
from edge_ident.diagnosis.budget.prepared import missed
from edge_ident.diagnosis.error_budget import AgreeingCurve
from edge_ident.diagnosis.fit.block_gain import gain_of
from edge_ident.diagnosis.fit.fitting import FittedModel, fit
from edge_ident.diagnosis.fit.noise_floor import NoiseFloor
from edge_ident.diagnosis.fit.summary import nonzero_rms
from edge_ident.diagnosis.model_elsewhere import fitted_anew, residual_elsewhere
from edge_ident.diagnosis.prepare.axis_data import AxisData
from edge_ident.diagnosis.validation import Judged
from edge_ident.model.inverse import left_by_terms
from edge_ident.signals.metrics import rms


def with_curves(
    data: AxisData, other: AxisData | None, judged: Judged, floor: NoiseFloor
) -> tuple[Judged, tuple[AgreeingCurve, ...]]:
    """A judged model with the curves that hold, and these.

    Parameters
    ----------
    data : AxisData
        That the model was fitted to.
    other : AxisData or None
        Another recording of the axis, in step beside the model.
    judged : Judged
    floor : NoiseFloor
    """
    model = judged.supported.model
    found = [
        replace(curve, term=replace(curve.term, supported=data.supported))
        for curve in agreeing_curves(missed(data, model, floor, model.axis.units, {}))
    ]
    if other is not None:
        found = [curve for curve in found if _holds(data, other, model, found, curve)]
    while found and not _fits(model, _beside(data, model, found)):
        found = found[:-1]
    if not found:
        return judged, ()
    extended = _beside(data, model, found)
    judged = replace(judged, supported=replace(judged.supported, model=extended))
    if other is not None and judged.validation is not None:
        left = rms(residual_elsewhere(other, extended, fitted_anew(extended)))
        scale = nonzero_rms(other.effort[other.valid])
        judged = replace(judged, validation=replace(judged.validation, extended=left / scale))
    return judged, tuple(found)


def _fits(model: FittedModel, extended: FittedModel) -> bool:
    """Whether curves leave a physical axis, and its bounds do not undo what they gain."""
    return left_by_terms(extended.axis).physical and extended.error < model.error


def _beside(data: AxisData, model: FittedModel, curves: Sequence[AgreeingCurve]) -> FittedModel:
    """The model fitted beside curves."""
    terms = (*model.template.terms, *(curve.term for curve in curves))
    return fit(data, replace(model.template, terms=terms), model.base, model.terms)


def _holds(
    data: AxisData,
    other: AxisData,
    model: FittedModel,
    curves: Sequence[AgreeingCurve],
    curve: AgreeingCurve,
) -> bool:
    """Whether a curve certainly reduces what the model leaves of another recording."""
    fewer = [one for one in curves if one is not curve]
    without, left = (
        residual_elsewhere(other, m, fitted_anew(m))
        for m in (_beside(data, model, some) for some in (fewer, curves))
    )
    return bool(gain_of(np.asarray(other.block[other.valid]), without, left).certain)
