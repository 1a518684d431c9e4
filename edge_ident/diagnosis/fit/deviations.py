"""How well parameters are known: noise in the motion, what trades places, friction as a line."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from edge_ident.diagnosis.fit.candidates import base_regressor, cached_effort, own_columns
from edge_ident.diagnosis.fit.fitting import FittedModel, delayed, jacobian_of, term_effort
from edge_ident.diagnosis.fit.held_out import (
    deviations_of,
    nonlinear_derivatives,
    standard_deviations,
)
from edge_ident.diagnosis.fit.linear import solve
from edge_ident.diagnosis.fit.summary import nonzero_rms
from edge_ident.diagnosis.prepare.axis_data import AxisData, Segment
from edge_ident.model.effects import named
from edge_ident.model.model import PARAMETERS, AxisModel, Estimate, regressor
from edge_ident.signals.metrics import rms

Array = NDArray[np.float64]


# What encoder noise in the regressor takes from the parameters of a model (errors in variables).
#
# Noise in the acceleration makes the inertia too small, the more so the less of the acceleration no
# other column has: along one sinusoid it is nearly that of a spring. So the same noise is added
# once more, and what that takes tells what the first took. With k times as much energy in the noise
# as in what the column has of its own, the inertia comes out as J/(1 + k), and as J/(1 + 2·k) with
# twice the noise. The other parameters move along with it. Source: simulation and extrapolation
# (Cook and Stefanski, JASA 89, 1994, 1314).

_MOST_TAKEN: Final = 0.45
"""Of the inertia, by noise that is added: near half of it, nothing tells how much there was."""


def attenuation(data: AxisData, model: FittedModel) -> Array:
    """Sizes (P,) of what encoder noise takes from the parameters of a model, or adds to them.

    Parameters
    ----------
    model : FittedModel
        Its parameters and their order are those of `edge_ident.diagnosis.fit.held_out`.
    """
    moved = _step(data.noise_replica, model) - _step(data, model)
    inertia = float(model.base[0])
    ratio = np.clip(-moved[0] / inertia, 0.0, _MOST_TAKEN) if inertia > 0.0 else 0.0
    return np.asarray(np.abs(moved) / (1.0 - 2.0 * ratio))


def _step(data: AxisData, model: FittedModel) -> Array:
    """What least squares without bounds adds to the parameters (P,) of a model, to first order."""
    columns = np.hstack([jacobian_of(data, model), nonlinear_derivatives(data, model)])
    columns[:, len(PARAMETERS) : len(PARAMETERS) + len(model.own)] = 0.0  # shifts have limits
    made = cached_effort(data, model.axis) + own_columns(data) @ model.own
    return solve(columns[data.valid], (data.effort - made)[data.valid])


# How uncertain base parameters are because they trade places with the causes beside them.
#
# A part of a cause's effort lies in the span of the base model's columns: friction that bends looks
# like less viscous and more Coulomb friction over most of its range. There the data cannot tell the
# two apart; only the formula of the cause says how much belongs to which. How well the formula is
# confirmed shows in the part that the base model cannot express: what is left unexplained, over
# that part of the cause, is the relative error that the formula may have. The same relative error
# of what the cause takes from a base parameter is added to the parameter's standard deviation. At
# most it is all of it, where the interval reaches the parameter of the base model alone. Laws of
# one curve count together: what two of them add that cancels confirms neither.
#
# They also trade places with the shift between effort and position. Along one slow sinusoid a shift
# looks like less inertia and more viscous friction, and the fit may end at a limit of the shift.
# Then the shift may lie anywhere between its limits.


def with_trades(data: AxisData, base: FittedModel, model: FittedModel, floor: float) -> Array:
    """Standard deviations (P,) of a model's parameters, trading and encoder noise included.

    The parameters and their order are those of `edge_ident.diagnosis.fit.held_out`.
    """
    deviations, known = standard_deviations(data, model), len(PARAMETERS)
    traded = traded_deviations(data, base, model, floor)
    shifted = shifted_deviations(data, model)
    deviations[:known] = np.sqrt(deviations[:known] ** 2 + traded**2 + shifted**2)
    return np.hypot(deviations, attenuation(data, model))


def traded_deviations(data: AxisData, base: FittedModel, model: FittedModel, floor: float) -> Array:
    """Standard deviations (4,) of the base parameters from trading with a model's terms.

    Parameters
    ----------
    base : FittedModel
        Fitted without the terms; its Jacobian spans what the base model can express.
    floor : float
        Rms that noise alone leaves.
    """
    columns = base.jacobian[data.valid]
    left = rms((data.effort - model.predicted)[data.valid])
    unexplained = float(np.sqrt(max(left**2 - floor**2, 0.0)))
    variance = np.zeros(len(PARAMETERS))
    for places in {model.of_law(t) for t in model.terms}:
        parts = [term_effort(data, model, k) for k in places]
        effort = np.sum(parts, axis=0)[data.valid]
        taken = solve(columns, effort)
        own = nonzero_rms(effort - columns @ taken)
        error = min(1.0, unexplained / own)
        variance += (error * taken[: len(PARAMETERS)]) ** 2
    return np.sqrt(variance)


def shifted_deviations(data: AxisData, model: FittedModel) -> Array:
    """Standard deviations (4,) of the base parameters from shifts that a limit holds.

    Such a shift may lie anywhere between its limits; the fit has it at one of them.
    """
    variance = np.zeros(len(PARAMETERS))
    if delayed(model.axis):
        return variance
    columns = model.jacobian[data.valid]
    early, late = data.timing_limits
    for place, range_s in enumerate(late - early, start=len(PARAMETERS)):
        if not model.free[place]:
            moves = solve(columns, model.derivatives[data.valid, place])
            variance += (range_s * moves[: len(PARAMETERS)]) ** 2 / 3.0
    return np.sqrt(variance)


# The straight line through the friction curve of a model, and how well it is known.
#
# Friction that bends is made up of base parameters and causes, and these trade places: a recording
# may not tell how much of the friction is viscous. Their sum it shows. Its line is the least-
# squares fit of viscous friction, Coulomb friction and offset to that sum, over all samples of the
# motion whose direction is known: so it is the line over the speeds that were visited, each as
# often as it was.
#
# The model's friction is the line and what each cause has beside it. Written so, the coefficients
# of the line are parameters of the same fit, and get their deviations in the same way as those of
# the physical model (`edge_ident.diagnosis.fit.deviations`): to first order, with the covariance of
# all parameters. What trades places between friction and a cause is no uncertainty of their sum.


_LINE: Final = slice(1, len(PARAMETERS))
"""Viscous friction, Coulomb friction and offset."""
_STEP: Final = 1e-4
"""Of a parameter, for derivatives."""


def friction_line(
    data: AxisData, base: FittedModel, model: FittedModel, floor: float
) -> Estimate | None:
    """Base parameters with the line through the friction curve in place of the model's own
    friction; None where the curve is a line.

    Parameters
    ----------
    base : FittedModel
        Fitted without the terms.
    floor : float
        Rms that noise alone leaves.
    """
    friction = _friction(model.axis)
    if len(friction.terms) == 1:
        return None
    motion = _Motion.of(data)
    parameters = np.array([model.base[0], *motion.line(friction)])
    turned, shapes = _turned(data, model, motion)
    by_noise = deviations_of(data, model, np.hstack([turned.jacobian, shapes]))
    parts = [by_noise, traded_deviations(data, base, turned, floor)]
    parts += [shifted_deviations(data, turned), attenuation(data, model)]
    variance = sum(part[: len(PARAMETERS)] ** 2 for part in parts)
    return Estimate(parameters, np.sqrt(variance))


def _shares(effect: str) -> bool:
    return named(effect).search.shares_friction


def _friction(axis: AxisModel) -> AxisModel:
    """The base term, and what makes up the friction together with it."""
    base, *others = axis.terms
    return replace(axis, terms=(base, *(t for t in others if _shares(t.effect))))


@dataclass(frozen=True)
class _Motion:
    """All samples of known direction.

    Attributes
    ----------
    columns : (N, 3) array
        Velocity, direction and one.
    """

    segments: tuple[Segment, ...]
    columns: Array
    acceleration: Array

    @classmethod
    def of(cls, data: AxisData) -> "_Motion":
        parts = [
            regressor(s.motion.velocity, s.motion.acceleration)[s.direction_known]
            for s in data.segments
        ]
        columns = np.concatenate(parts)
        return cls(data.segments, columns[:, _LINE], columns[:, 0])

    def line(self, axis: AxisModel) -> Array:
        """Viscous friction, Coulomb friction and offset of the line (3,) through what an axis
        resists with beside its inertia."""
        efforts = [s.obeyed_effort(axis)[s.direction_known] for s in self.segments]
        inertia = float(axis.parameters[0])
        return solve(self.columns, np.concatenate(efforts) - inertia * self.acceleration)

    def slopes(self, axis: AxisModel, place: int, names: Sequence[str]) -> Array:
        """Derivatives (3, P) of the line by parameters of one term."""
        term = axis.terms[place]
        found = np.zeros((self.columns.shape[1], len(names)))

        def moved(name: str, by: float) -> Array:
            side = replace(term, values={**term.values, name: float(term.values[name]) + by})
            terms = (side if k == place else one for k, one in enumerate(axis.terms))
            return self.line(replace(axis, terms=tuple(terms)))

        for column, name in enumerate(names):
            step = _STEP * (abs(float(term.values[name])) or 1.0)
            found[:, column] = (moved(name, step) - moved(name, -step)) / (2.0 * step)
        return found


def _turned(data: AxisData, model: FittedModel, motion: _Motion) -> tuple[FittedModel, Array]:
    """The model with its derivatives by linear and by nonlinear parameters (n, S), those of
    friction beside the line.

    Bounds hold single parameters of friction and not the line.
    """
    columns, derivatives = base_regressor(data)[:, _LINE], model.derivatives.copy()
    shapes, free = nonlinear_derivatives(data, model), model.free.copy()
    free[_LINE] = True
    friction = _friction(model.axis)
    place = len(friction.terms) - sum(_shares(t.candidate.effect) for t in model.terms)
    first = 0
    for k, t in enumerate(model.terms):
        last = first + len(t.candidate.form.nonlinear)
        if _shares(t.candidate.effect):
            at = model.columns_of(k)
            derivatives[:, at] -= columns @ motion.slopes(friction, place, list(t.linear))
            names = t.candidate.form.nonlinear
            shapes[:, first:last] -= columns @ motion.slopes(friction, place, names)
            free[at] = True
            place += 1
        first = last
    return replace(model, rows=(derivatives.T,), free=free), shapes
