"""Model discrepancy: how far the formulas of a model may be from the machine.

Each effect's file states the share of its effort by which its formula may be off. A difference
within the discrepancy is evidence neither for another cause nor between two models.
"""

import numpy as np
from numpy.typing import NDArray

from edge_ident.diagnosis.fit.fitting import FittedModel, additive
from edge_ident.diagnosis.fit.projection import orthonormal
from edge_ident.diagnosis.fit.term_effort import term_effort
from edge_ident.diagnosis.prepare.axis_data import AxisData
from edge_ident.model.effects import named
from edge_ident.model.model import BASE, PARAMETERS

Array = NDArray[np.float64]


def model_discrepancy(data: AxisData, fitted: FittedModel) -> float:
    """Sum of squares over the valid samples by which a model's formulas may be off.

    Of each added effect only the component orthogonal to the base model counts.
    """
    key = ("discrepancy", fitted.key)
    if key not in data.results:
        data.results[key] = _discrepancy(data, fitted)
    return float(data.results[key])


def _discrepancy(data: AxisData, fitted: FittedModel) -> float:
    valid = data.valid
    base = fitted.jacobian[valid, : len(PARAMETERS)]
    varying = base @ fitted.base
    varying = varying - np.mean(varying)
    discrepancy = named(BASE).search.discrepancy ** 2 * float(varying @ varying)
    basis = _base_basis(data, fitted)
    for k, t in enumerate(fitted.terms):
        effort = term_effort(data, fitted, k)[valid]
        orthogonal = effort - basis @ (basis.T @ effort)
        share = named(t.candidate.effect).search.discrepancy
        discrepancy += share**2 * float(orthogonal @ orthogonal)
    return discrepancy


def _base_basis(data: AxisData, fitted: FittedModel) -> Array:
    """Orthonormal basis (n, R) of the base model's columns, computed once where efforts add up."""
    columns = fitted.jacobian[data.valid, fitted.base_columns]
    if not additive(fitted.template, fitted.terms):
        return orthonormal(columns)
    key = ("base", data.valid.tobytes(), fitted.free[fitted.base_columns].tobytes())
    if key not in data.cache:
        data.cache[key] = orthonormal(columns)
    return data.cache[key]
