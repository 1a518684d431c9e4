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

    Of each added effect only the component orthogonal to the base model counts. Nothing counts with
    more than the measured effort: a payload that changes after the first samples may have any size,
    and the inertia before stands against it.
    """
    key = ("discrepancy", fitted.key)
    if key not in data.results:
        data.results[key] = _discrepancy(data, fitted)
    return float(data.results[key])


def _discrepancy(data: AxisData, fitted: FittedModel) -> float:
    valid = data.valid
    measured = data.effort[valid]
    varying = fitted.derivatives[valid, : len(PARAMETERS)] @ fitted.base
    parts = [(BASE, varying - np.mean(varying))]
    basis = _base_basis(data, fitted)
    for k, t in enumerate(fitted.terms):
        effort = term_effort(data, fitted, k)[valid]
        parts.append((t.candidate.effect, effort - basis @ (basis.T @ effort)))
    most = float(measured @ measured)
    return sum(
        named(effect).search.discrepancy ** 2 * min(float(effort @ effort), most)
        for effect, effort in parts
    )


def _base_basis(data: AxisData, fitted: FittedModel) -> Array:
    """Orthonormal basis (n, R) of the base model's columns, computed once where efforts add up.

    Those of parameters that a bound holds are among them: an effect that took the place of the
    inertia does not err by a share of that.
    """
    columns = fitted.derivatives[data.valid, fitted.base_columns]
    if not additive(fitted.template, fitted.terms):
        return orthonormal(columns)
    key = ("base", data.valid.tobytes())
    if key not in data.cache:
        data.cache[key] = orthonormal(columns)
    return data.cache[key]
