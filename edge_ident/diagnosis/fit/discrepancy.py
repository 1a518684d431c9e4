"""Model discrepancy: how far the formulas of a model may be from the machine.

Each effect's file states the share of its effort by which its formula may be off. A difference
within the discrepancy is evidence neither for another cause nor between two models.
"""

import numpy as np
from numpy.typing import NDArray

from edge_ident.diagnosis.fit.candidates import cached_regressors, regressors
from edge_ident.diagnosis.fit.fitting import FittedModel, FittedTerm, additive
from edge_ident.diagnosis.fit.projection import orthonormal
from edge_ident.diagnosis.prepare.axis_data import AxisData
from edge_ident.model.effects import named
from edge_ident.model.model import BASE, PARAMETERS

Array = NDArray[np.float64]


def model_discrepancy(data: AxisData, fitted: FittedModel) -> float:
    """Sum of squares over the valid samples by which a model's formulas may be off.

    Of each added effect only the component orthogonal to the base model counts.
    """
    valid = data.valid
    base = fitted.jacobian[valid, : len(PARAMETERS)]
    varying = base @ fitted.base
    varying = varying - np.mean(varying)
    discrepancy = named(BASE).search.discrepancy ** 2 * float(varying @ varying)
    basis = orthonormal(fitted.jacobian[valid, fitted.base_columns])
    for k, t in enumerate(fitted.terms):
        if t.linear:
            columns = fitted.columns_of(k)
            effort = fitted.jacobian[valid, columns] @ fitted.linear_parameters[columns]
        else:
            effort = _nonlinear_contribution(data, t, fitted)
        orthogonal = effort - basis @ (basis.T @ effort)
        share = named(t.candidate.effect).search.discrepancy
        discrepancy += share**2 * float(orthogonal @ orthogonal)
    return discrepancy


def _nonlinear_contribution(data: AxisData, added: FittedTerm, fitted: FittedModel) -> Array:
    """Effort (n,) of a term without linear parameters, at the valid samples."""
    if additive(fitted.template, fitted.terms):
        rows = cached_regressors(data, fitted.template, added.candidate, added.nonlinear)
    else:
        rows = regressors(data, fitted.axis, added.candidate, added.nonlinear)[0]
    return np.asarray(rows[0, data.valid])
