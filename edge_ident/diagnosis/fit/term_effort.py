"""What single terms of a fitted model contribute to its effort."""

import numpy as np
from numpy.typing import NDArray

from edge_ident.diagnosis.fit.candidates import cached_regressors
from edge_ident.diagnosis.fit.fitting import FittedModel, additive
from edge_ident.diagnosis.prepare.axis_data import AxisData

Array = NDArray[np.float64]


def term_effort(data: AxisData, model: FittedModel, index: int) -> Array:
    """Effort (n,) of one added term beside the others; to first order where efforts do not add up.

    Parameters
    ----------
    index : int
        Place among the terms that the diagnosis added.
    """
    t, columns = model.terms[index], model.columns_of(index)
    if not t.linear:
        rows = cached_regressors(data, model.template, t.candidate, t.nonlinear)
        return np.asarray(rows[0])
    return np.asarray(model.derivatives[:, columns] @ model.linear_parameters[columns])


def contributions(data: AxisData, model: FittedModel) -> list[Array]:
    """What each added term adds to the prediction of a model, (n,) each."""
    places = range(len(model.terms))
    if additive(model.template, model.terms):
        return [term_effort(data, model, k) for k in places]
    return [_added(data, model, k) for k in places]


def _added(data: AxisData, model: FittedModel, index: int) -> Array:
    return data.predicted(model.axis) - data.predicted(model.axis_without([index]))
