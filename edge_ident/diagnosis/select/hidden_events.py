"""Events in samples that the comparison leaves out.

Aliased encoder rounding explains so much and no more. At the start of a recording, only friction
and play remember what was before it: beside a model in which nothing remembers, an effort that is
far off there is an event as well.
"""

import numpy as np

from edge_ident.diagnosis.fit.fitting import FittedModel, fit
from edge_ident.diagnosis.prepare.axis_data import AxisData
from edge_ident.diagnosis.tolerance import worth_naming
from edge_ident.model.inverse import remembers


def with_hidden_events(data: AxisData, model: FittedModel, inertia: float) -> AxisData:
    """The data with samples valid at which something happened; the data itself where nothing did.

    Parameters
    ----------
    data : AxisData
    model : FittedModel
        That was selected on these data.
    inertia : float
        That turns aliased rounding into effort.
    """
    whole = data if remembers(model.axis.terms) else data.from_start()
    residual = whole.effort - fit(whole, model.template, model.base, model.terms).predicted
    hidden = whole.exceeds_aliasing(residual, inertia)
    if whole.late:
        hidden &= ~whole.near_ends(whole.late_s)
    added = [
        np.arange(len(s.sample_index)) < len(s.sample_index) - len(before.sample_index)
        for s, before in zip(whole.segments, data.segments, strict=True)
    ]
    start = np.concatenate(added)
    if not worth_naming(residual[hidden & start], data.effort[data.valid]):
        hidden &= ~start
    return whole.with_valid(hidden) if np.any(hidden) else data
