"""The search for causes, from the base model to the model that it ends with."""

from dataclasses import dataclass, replace

import numpy as np

from edge_ident.diagnosis.fit.fitting import FittedModel, fit
from edge_ident.diagnosis.prepare.axis_data import AxisData
from edge_ident.diagnosis.select.backward_elimination import SupportedModel, eliminate_backward
from edge_ident.diagnosis.select.forward_selection import select_forward
from edge_ident.diagnosis.select.search import Search
from edge_ident.model.model import PARAMETERS, AxisModel


@dataclass(frozen=True)
class Selected:
    """The base model of an axis, and the model that the selection ends with."""

    search: Search
    start: FittedModel
    supported: SupportedModel


def fitted_base(data: AxisData, template: AxisModel) -> FittedModel:
    """The base model beside what the axis is known to have; the fit starts from an inertia."""
    return fit(data, template, np.eye(len(PARAMETERS))[0], ())


def selected_model(
    data: AxisData, template: AxisModel, *, deep: bool = False
) -> tuple[AxisData, Selected]:
    """Select a model; repeat it where aliasing hides an event, with those samples valid.

    Parameters
    ----------
    data : AxisData
    template : AxisModel
        The axis with what it is known to have.
    deep : bool
        As `Search` has it.

    Returns
    -------
    data : AxisData
        With the samples that were compared in the end.
    selected : Selected
    """
    selected = _select(data, template, deep)
    residual = data.effort - selected.supported.model.predicted
    hidden = data.exceeds_aliasing(residual, float(selected.start.base[0]))
    if np.any(hidden):
        data = data.with_valid(hidden)
        selected = _select(data, template, deep)
    return data, selected


def _select(data: AxisData, template: AxisModel, deep: bool) -> Selected:
    start = fitted_base(data, template)
    search = replace(Search.of(data, template, start), deep=deep)
    selection = select_forward(search, start)
    supported = eliminate_backward(selection.search, selection.model)
    return Selected(selection.search, start, supported)
