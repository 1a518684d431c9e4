"""The straight line through the friction curve of a model, and how well it is known.

Friction that bends is made up of base parameters and causes, and these trade places: a recording
may not tell how much of the friction is viscous. Their sum it shows. Its line is the least-squares
fit of viscous friction, Coulomb friction and offset to that sum, over all samples of the motion
whose direction is known: so it is the line over the speeds that were visited, each as often as it
was.

The model's friction is the line and what each cause has beside it. Written so, the coefficients of
the line are parameters of the same fit, and get their deviations in the same way as those of the
physical model (`edge_ident.diagnosis.fit.traded`): to first order, with the covariance of all
parameters. What trades places between friction and a cause is no uncertainty of their sum.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from edge_ident.diagnosis.fit.attenuation import attenuation
from edge_ident.diagnosis.fit.bounded import solve
from edge_ident.diagnosis.fit.candidates import base_regressor
from edge_ident.diagnosis.fit.fitting import FittedModel
from edge_ident.diagnosis.fit.held_out import deviations_of, nonlinear_derivatives
from edge_ident.diagnosis.fit.traded import shifted_deviations, traded_deviations
from edge_ident.diagnosis.prepare.axis_data import AxisData
from edge_ident.diagnosis.prepare.segment import Segment
from edge_ident.model.effects import named
from edge_ident.model.model import PARAMETERS, AxisModel, Estimate, regressor

Array = NDArray[np.float64]

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
    data : AxisData
    base : FittedModel
        Fitted without the terms.
    model : FittedModel
        Without external vibrations.
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
    acceleration : (N,) array
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
    return replace(model, derivatives=derivatives, free=free), shapes
