"""Cross-validation of a fitted model by blocks of time, and its standard deviations.

Both need derivatives of the prediction by the nonlinear parameters as well.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cache
from typing import Final

import numpy as np
import scipy.special
from numpy.typing import NDArray

from edge_ident.diagnosis.fit.candidates import (
    alone,
    cached_derivatives,
    slopes,
    term,
    to_both_sides,
)
from edge_ident.diagnosis.fit.fitting import FittedModel, additive, term_effort
from edge_ident.diagnosis.fit.linear import orthonormal, solve
from edge_ident.diagnosis.prepare.axis_data import AxisData
from edge_ident.estimation.least_squares import coloured_std
from edge_ident.model.effects import named
from edge_ident.model.model import BASE, PARAMETERS
from edge_ident.signals.conditioning import unit_length

Array = NDArray[np.float64]


_FOLDS: Final = 5
_LEARNED: Final = 0.005
"""Share of a direction's energy in the training blocks, below which they say nothing about it.

Their noise would be in the prediction as that of 200 samples, and a held-out fold has hardly more.
"""
_RANK: Final = 1e-9


def held_out_residuals(data: AxisData, fitted: FittedModel) -> Array:
    """Residuals (n,) of samples that did not take part in the fit that predicts them.

    Every fifth block of time is held out in turn. The fit is repeated to first order: linear
    parameters anew, nonlinear ones by their derivatives. What acts in the held-out blocks only
    stays as it was fitted.
    """
    return data.once(("held out", fitted.key), lambda: _held_out_residuals(data, fitted))


def _held_out_residuals(data: AxisData, fitted: FittedModel) -> Array:
    derivatives = nonlinear_derivatives(data, fitted)
    jacobian = np.hstack([fitted.jacobian, derivatives])
    start = np.concatenate([fitted.linear_parameters, np.zeros(derivatives.shape[1])])
    target: Array = data.effort - fitted.predicted + jacobian @ start
    folds = data.block % _FOLDS
    parts = _parts(jacobian[data.valid], target[data.valid], folds[data.valid])
    unit, length = _orthonormal_directions(np.vstack(parts)[:, :-1])
    prior, directions = _prior_rows(unit, length, derivatives.shape[1]), unit / length[:, None]
    estimates = np.array(
        [_estimate(parts, fold, directions, prior, start) for fold in range(_FOLDS)]
    )
    return np.asarray(target - np.einsum("np,np->n", jacobian, estimates[folds]))


def _parts(jacobian: Array, target: Array, folds: NDArray[np.intp]) -> list[Array]:
    """Jacobian (n, P) and target (n,) of each fold, reduced to as many rows as columns.

    They have the same scalar products: R of the QR decomposition.
    """
    rows = np.column_stack([jacobian, target])
    parts = [np.linalg.qr(rows[folds == fold], mode="r") for fold in range(_FOLDS)]
    return [np.asarray(part, dtype=np.float64) for part in parts]


def _estimate(
    parts: Sequence[Array], fold: int, directions: Array, prior: Array, start: Array
) -> Array:
    """Parameters (P,) from all folds but one; what those say nothing about stays as it was.

    That may be a difference of parameters: dry friction and offset before a payload, where the one
    reversal before it lies in the fold.
    """
    train = np.vstack([*parts[:fold], *parts[fold + 1 :]])
    jacobian, target = train[:, :-1], train[:, -1]
    trained = jacobian @ directions
    known, turned = np.linalg.eigh(trained.T @ trained)
    directions = directions @ turned[:, known > _LEARNED]
    rows = np.vstack([jacobian, prior]) @ directions
    wanted = np.concatenate([target - jacobian @ start, -prior @ start])
    return np.asarray(start + directions @ solve(rows, wanted))


def _orthonormal_directions(jacobian: Array) -> tuple[Array, Array]:
    """Directions (P, R) of the parameters along which a Jacobian (n, P) of unit columns is
    orthonormal, zero for what does nothing; and the lengths (P,) that its columns have."""
    unit, length = unit_length(jacobian)
    _, singular, right = np.linalg.svd(unit, full_matrices=False)
    kept = singular > _RANK * singular[0]
    directions = right[kept].T / singular[kept]
    directions[~np.any(jacobian, axis=0)] = 0.0  # but for rounding they are
    return directions, length


def standard_deviations(data: AxisData, fitted: FittedModel) -> Array:
    """Of linear and nonlinear parameters, in this order; for coloured residuals.

    A parameter that a bound holds has the deviation that it would have without the bound.
    """
    derivatives = nonlinear_derivatives(data, fitted)
    found = deviations_of(data, fitted, np.hstack([fitted.jacobian, derivatives]))
    if np.all(fitted.free):
        return found
    every = deviations_of(data, fitted, np.hstack([fitted.derivatives, derivatives]))
    free = np.concatenate([fitted.free, np.ones(derivatives.shape[1], dtype=np.bool_)])
    return np.where(free, found, every)


def deviations_by_term(fitted: FittedModel, deviations: Array) -> list[dict[str, float]]:
    """Deviations of each added term's parameters by name, linear ones first.

    Parameters
    ----------
    deviations : (P,) array
        As `standard_deviations` gives them.
    """
    _, nonlinear = np.split(deviations, [len(fitted.linear_parameters)])
    found = []
    for k, t in enumerate(fitted.terms):
        names = t.candidate.form.nonlinear
        own, nonlinear = np.split(nonlinear, [len(names)])
        linear = deviations[fitted.columns_of(k)]
        values = np.concatenate([linear, own]).tolist()
        found.append(dict(zip((*t.linear, *names), values, strict=True)))
    return found


def joint_deviation(data: AxisData, fitted: FittedModel, places: Sequence[int]) -> float:
    """Standard deviation of the size of several terms taken as one, whose shape is given; as a
    share of that size, infinite where they do nothing.

    Parameters
    ----------
    places : sequence of int
        Those of `fitted.terms`; their efforts are in proportion to linear parameters.
    """
    columns = np.r_[tuple(fitted.columns_of(k) for k in places)]
    together = fitted.derivatives[:, columns] @ fitted.linear_parameters[columns]
    if not np.any(together):
        return np.inf
    others = np.delete(fitted.jacobian, columns, axis=1)
    rest = [k for k in range(len(fitted.terms)) if k not in places]
    shapes = nonlinear_derivatives(data, fitted, rest)
    return float(deviations_of(data, fitted, np.column_stack([others, shapes, together]))[-1])


def deviations_of(data: AxisData, fitted: FittedModel, jacobian: Array) -> Array:
    """Standard deviations (P,) of the parameters of a Jacobian (n, P), for coloured residuals."""
    unit, length = unit_length(jacobian[data.valid])
    residual = (data.effort - fitted.predicted)[data.valid]
    return np.asarray(coloured_std(unit, residual) / length)


def nonlinear_derivatives(
    data: AxisData, fitted: FittedModel, places: Sequence[int] | None = None
) -> Array:
    """Derivatives (n, S) of the prediction by every nonlinear parameter, or by those of some
    terms."""
    adds = additive(fitted.template, fitted.terms)
    rows = [np.empty((0, len(data.effort)))]
    for k in range(len(fitted.terms)) if places is None else places:
        t = fitted.terms[k]
        if not t.candidate.form.nonlinear:
            continue
        if adds:
            linear = np.array(list(t.linear.values()) or [1.0])
            rows.append(
                linear @ cached_derivatives(data, fitted.template, t.candidate, t.nonlinear)
            )
        else:
            rows.append(_derivatives(data, fitted, k))
    return np.concatenate(rows).T


def _derivatives(data: AxisData, fitted: FittedModel, index: int) -> Array:
    """Derivatives (S, n) of the prediction by the nonlinear parameters of one term."""
    t, at = fitted.terms[index], len(fitted.template.terms) + index
    sides, steps = to_both_sides(t.candidate, t.nonlinear)
    moved = term(t.candidate, sides, t.linear)
    needed = alone(fitted.axis, at)
    terms = tuple(moved if one is fitted.axis.terms[at] else one for one in needed.terms)
    low, high = np.split(data.predicted(replace(needed, terms=terms)), 2)
    return slopes(low, high, steps)


def _prior_rows(unit: Array, length: Array, nonlinear: int) -> Array:
    """Rows (S, P) that hold each nonlinear parameter near its estimate from all samples.

    Nonlinear parameters are the last of those that `_orthonormal_directions` describes.

    A fifth of the samples cannot move it further than its standard deviation. Its derivative can
    be far from constant: that of a step in time is a pulse.
    """
    rows = np.zeros((nonlinear, len(length)))
    for k in range(nonlinear):
        at = len(length) - nonlinear + k
        size = float(np.linalg.norm(unit[at]))
        if size > 0.0:  # else the parameter does nothing
            # standard deviation of the parameter over that of a sample, for white noise
            rows[k, at] = length[at] / size
    return rows


# How much smaller one residual is than another, with an interval from blocks of time.


_LEVEL: Final = 0.975
"""Quantile of the interval's ends."""
_RESAMPLES: Final = 1000
"""Of the blocks of time (Künsch, Annals of Statistics 17 (1989) 1217): 0.95 then has a standard
error of 0.007."""
_SEED: Final = 1
_TINY: Final = float(np.finfo(float).tiny)


@dataclass(frozen=True)
class Gain:
    """Relative reduction of a residual's rms by a model against a smaller one.

    Attributes
    ----------
    interval : (float, float)
        95 %.
    supported : float
        Share of the bootstrap resamples of the blocks in which the residual falls.
    one_off : bool
        Computed from the fitted residual: what happens once cannot be predicted.
    """

    value: float
    interval: tuple[float, float]
    supported: float
    one_off: bool = False

    @property
    def certain(self) -> bool:
        """Whether the residual certainly falls."""
        return self.interval[0] > 0.0


def gain_of(block: NDArray[np.intp], before: Array, after: Array) -> Gain:
    """Relative reduction of the rms from one residual to another.

    The logarithm of the ratio of two sums over B blocks is nearly normal. Its variance is that of
    the blocks' parts of it (the delta method), with B - 1 degrees of freedom.

    Parameters
    ----------
    block : (n,) array of int
        Numbers of the blocks of time.
    """
    present = np.bincount(block) > 0
    old, new = (np.bincount(block, r**2)[present] for r in (before, after))
    total_old, total_new = max(float(np.sum(old)), _TINY), max(float(np.sum(new)), _TINY)
    ratio = 0.5 * np.log(total_new / total_old)
    blocks = len(old)
    if blocks < 2:
        return Gain(float(1.0 - np.exp(ratio)), (-np.inf, 1.0), 0.0)
    parts = 0.5 * (new / total_new - old / total_old)
    std = max(np.sqrt(blocks / (blocks - 1.0) * float(parts @ parts)), _TINY)
    reach = float(scipy.special.stdtrit(blocks - 1, _LEVEL)) * std
    ends = (float(1.0 - np.exp(ratio + reach)), float(1.0 - np.exp(ratio - reach)))
    supported = float(np.mean((old - new) @ _drawn(blocks) > 0.0))
    return Gain(float(1.0 - np.exp(ratio)), ends, supported)


@cache
def _drawn(blocks: int) -> Array:
    """How often each resample holds each block, (B, R).

    Of a residual in which something happens once, a block has most of the squares, and says little
    of the sign: no normal distribution tells that.
    """
    rng = np.random.default_rng(_SEED)
    drawn = rng.integers(0, blocks, (_RESAMPLES, blocks))
    counts = [np.bincount(sample, minlength=blocks) for sample in drawn]
    return np.array(counts, dtype=np.float64).T


# Model discrepancy: how far the formulas of a model may be from the machine.
#
# Each effect's file states the share of its effort by which its formula may be off. A difference
# within the discrepancy is evidence neither for another cause nor between two models.


def model_discrepancy(data: AxisData, fitted: FittedModel) -> float:
    """Sum of squares over the valid samples by which a model's formulas may be off.

    Of each added effect only the component orthogonal to the base model counts. Nothing counts with
    more than the measured effort: a payload that changes after the first samples may have any size,
    and the inertia before stands against it.
    """
    return data.once(("discrepancy", fitted.key), lambda: _discrepancy(data, fitted))


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
    return data.once("base", lambda: orthonormal(columns))
