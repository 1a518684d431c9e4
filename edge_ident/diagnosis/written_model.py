"""The extended model of an axis as a file keeps it: physical, and with the range of each term."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Final

import numpy as np

from edge_ident.diagnosis.fit.summary import nonzero_rms
from edge_ident.diagnosis.prepare.axis_data import AxisData
from edge_ident.diagnosis.result import Cause
from edge_ident.model.effects import named
from edge_ident.model.inverse import made_physical
from edge_ident.model.model import BASE, PARAMETERS, AxisModel, Estimate, Term

_UNSEEN: Final = 1e-3
"""Share of the effort that an inertia may take which the recording cannot show: a tenth of the
smallest effect worth naming. An axis without inertia cannot be simulated."""


def written_model(
    template: AxisModel, estimate: Estimate, causes: Sequence[Cause], data: AxisData
) -> AxisModel:
    """The model of base parameters and causes.

    Parameters
    ----------
    template : AxisModel
        The axis with the effects that it is known to have; those keep their ranges.
    estimate : Estimate
        Of the base parameters.
    causes : sequence of Cause
    data : AxisData
        What the estimate and the causes come from.
    """
    lowest = [named(BASE).bounds[name][0] for name in PARAMETERS]
    values = dict(zip(PARAMETERS, np.maximum(estimate.parameters, lowest).tolist(), strict=True))
    std = dict(zip(PARAMETERS, estimate.std.tolist(), strict=True))
    supported = data.supported
    added = (replace(cause.term, supported=supported) for cause in causes)
    terms = (Term(BASE, values, std, supported=supported), *template.terms[1:], *added)
    effort, acceleration = (
        nonzero_rms(signal[data.valid]) for signal in (data.effort, data.of_motion("acceleration"))
    )
    return made_physical(replace(template, terms=terms), _UNSEEN * effort / acceleration)
