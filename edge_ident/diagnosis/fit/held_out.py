"""Cross-validation of a fitted model by blocks of time, and its standard deviations.

Both need derivatives of the prediction by the nonlinear parameters as well.
"""

from dataclasses import replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from edge_ident.diagnosis.fit.bounded import solve
from edge_ident.diagnosis.fit.candidates import cached_regressors
from edge_ident.diagnosis.fit.fitting import FittedModel, FittedTerm, additive
from edge_ident.diagnosis.prepare.axis_data import AxisData
from edge_ident.estimation.covariance import coloured_std
from edge_ident.estimation.least_squares import unit_length
from edge_ident.model.model import AxisModel

Array = NDArray[np.float64]

_STEP: Final = 1e-3
"""Relative step of the derivatives: coarse enough for effects that act in jumps."""
_FOLDS: Final = 5
_LEARNED: Final = 0.05
"""Share of a column's energy in the training blocks, below which they say nothing about it."""
_RANK: Final = 1e-9
_TINY: Final = float(np.finfo(float).tiny)


def held_out_residuals(data: AxisData, fitted: FittedModel) -> Array:
    """Residuals (n,) of samples that did not take part in the fit that predicts them.

    Every fifth block of time is held out in turn. The fit is repeated to first order: linear
    parameters anew, nonlinear ones by their derivatives. What acts in the held-out blocks only
    stays as it was fitted.
    """
    derivatives = _nonlinear_derivatives(data, fitted)
    jacobian = np.hstack([fitted.jacobian, derivatives])
    start = np.concatenate([fitted.linear_parameters, np.zeros(derivatives.shape[1])])
    target: Array = data.effort - fitted.predicted + jacobian @ start
    prior = _prior_rows(data, jacobian, derivatives.shape[1])
    residual = np.empty_like(target)
    energy = np.sum(jacobian[data.valid] ** 2, axis=0)
    for fold in range(_FOLDS):
        out = data.block % _FOLDS == fold
        train = data.valid & ~out
        learned = np.sum(jacobian[train] ** 2, axis=0) > _LEARNED * energy
        estimate = np.where(learned, 0.0, start)
        rows = np.vstack([jacobian[train], prior])[:, learned]
        wanted = np.concatenate([target[train] - jacobian[train] @ estimate, np.zeros(len(prior))])
        estimate[learned] = solve(rows, wanted)
        residual[out] = target[out] - jacobian[out] @ estimate
    return residual


def standard_deviations(data: AxisData, fitted: FittedModel) -> Array:
    """Of linear and nonlinear parameters, in this order; for coloured residuals.

    A parameter that a bound holds has the deviation that it would have without the bound.
    """
    derivatives = _nonlinear_derivatives(data, fitted)
    found = _deviations(data, fitted, np.hstack([fitted.jacobian, derivatives]))
    if np.all(fitted.free):
        return found
    every = _deviations(data, fitted, np.hstack([fitted.derivatives, derivatives]))
    free = np.concatenate([fitted.free, np.ones(derivatives.shape[1], dtype=np.bool_)])
    return np.where(free, found, every)


def _deviations(data: AxisData, fitted: FittedModel, jacobian: Array) -> Array:
    """Standard deviations (P,) of the parameters of a Jacobian (n, P)."""
    unit, length = unit_length(jacobian[data.valid])
    residual = (data.effort - fitted.predicted)[data.valid]
    return np.asarray(coloured_std(unit, residual) / length)


def _nonlinear_derivatives(data: AxisData, fitted: FittedModel) -> Array:
    """Derivatives (n, S) of the prediction by every nonlinear parameter."""
    rows = []
    template = fitted.template
    known, adds = len(template.terms), additive(template, fitted.terms)
    for k, t in enumerate(fitted.terms):
        for name in t.candidate.form.nonlinear:
            step = _STEP * (abs(t.nonlinear[name]) or 1.0)
            sides = [{**t.nonlinear, name: t.nonlinear[name] + s} for s in (-step, step)]
            if adds:
                linear = np.array(list(t.linear.values()) or [1.0])
                low, high = (
                    linear @ cached_regressors(data, template, t.candidate, side) for side in sides
                )
            else:
                low, high = (
                    data.predicted(_changed(fitted.axis, known + k, replace(t, nonlinear=side)))
                    for side in sides
                )
            rows.append((high - low) / (2.0 * step))
    return np.array(rows).reshape(len(rows), len(data.effort)).T


def _changed(axis: AxisModel, index: int, fitted: FittedTerm) -> AxisModel:
    terms = (*axis.terms[:index], fitted.model_term, *axis.terms[index + 1 :])
    return replace(axis, terms=terms)


def _prior_rows(data: AxisData, jacobian: Array, nonlinear: int) -> Array:
    """Rows (S, P) that hold each nonlinear parameter near its estimate from all samples.

    A fifth of the samples cannot move it further than its standard deviation. Its derivative can
    be far from constant: that of a step in time is a pulse.
    """
    valid = jacobian[data.valid]
    length = np.maximum(np.linalg.norm(valid, axis=0), _TINY)
    _, singular, right = np.linalg.svd(valid / length, full_matrices=False)
    kept = singular > _RANK * singular[0]
    unit = right[kept].T / singular[kept]
    rows = np.zeros((nonlinear, jacobian.shape[1]))
    for k in range(nonlinear):
        at = jacobian.shape[1] - nonlinear + k
        # standard deviation of the parameter over that of a sample, for white noise
        rows[k, at] = length[at] / max(float(np.linalg.norm(unit[at])), _TINY)
    return rows
