"""The straight line through the friction curve of a model, and how well it is known.

Friction that bends is made up of base parameters and causes, and these trade places: a recording
may not tell how much of the friction is viscous. Their sum it shows. Its line is the least-squares
fit of viscous friction, Coulomb friction and offset to that sum, over the samples of the motion: so
it is the line over the speeds that were visited, each as often as it was.

The model's friction is the line and what each cause has beside it. Written so, the coefficients of
the line are parameters of the same fit, and get their deviations in the same way as those of the
physical model (`edge_ident.diagnosis.fit.traded`): to first order, with the covariance of all
parameters. What trades places between friction and a cause is no uncertainty of their sum.
"""

from dataclasses import replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from edge_ident.diagnosis.fit.attenuation import attenuation
from edge_ident.diagnosis.fit.bounded import solve
from edge_ident.diagnosis.fit.candidates import base_regressor, known_effort
from edge_ident.diagnosis.fit.fitting import FittedModel
from edge_ident.diagnosis.fit.held_out import deviations_of, nonlinear_derivatives
from edge_ident.diagnosis.fit.term_effort import contributions
from edge_ident.diagnosis.fit.traded import shifted_deviations, traded_deviations
from edge_ident.diagnosis.prepare.axis_data import AxisData
from edge_ident.model.effects import named
from edge_ident.model.model import PARAMETERS, Estimate

Array = NDArray[np.float64]

_LINE: Final = slice(1, len(PARAMETERS))
"""Viscous friction, Coulomb friction and offset."""


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
    effort = _beside_base(data, model)
    if effort is None:
        return None
    columns = base_regressor(data)[data.valid, _LINE]
    parameters = model.base.copy()
    parameters[_LINE] += solve(columns, effort[data.valid])
    turned, shapes = _turned(data, model)
    by_noise = deviations_of(data, model, np.hstack([turned.jacobian, shapes]))
    parts = [by_noise, traded_deviations(data, base, turned, floor)]
    parts += [shifted_deviations(data, turned), attenuation(data, model)]
    variance = sum(part[: len(PARAMETERS)] ** 2 for part in parts)
    return Estimate(parameters, np.sqrt(variance))


def _of_friction(model: FittedModel) -> list[bool]:
    """Whether each added term makes up the friction together with the base model's."""
    return [named(t.candidate.effect).search.shares_friction for t in model.terms]


def _beside_base(data: AxisData, model: FittedModel) -> Array | None:
    """Friction (n,) beside that of the base term, known or added; None without any."""
    known = [t for t in model.template.terms[1:] if named(t.effect).search.shares_friction]
    added = _of_friction(model)
    if not (known or any(added)):
        return None
    template = replace(model.template, terms=(model.template.terms[0], *known))
    effort = known_effort(data, template) if known else np.zeros(len(data.effort))
    parts = zip(contributions(data, model), added, strict=True)
    return np.asarray(effort + sum(part for part, friction in parts if friction))


def _turned(data: AxisData, model: FittedModel) -> tuple[FittedModel, Array]:
    """The model with its derivatives by linear and by nonlinear parameters (n, S), those of
    friction beside the line.

    Bounds hold single parameters of friction and not the line.
    """
    columns, derivatives = base_regressor(data)[:, _LINE], model.derivatives.copy()
    shapes, free = nonlinear_derivatives(data, model), model.free.copy()
    free[_LINE] = True
    first = 0
    for k, friction in enumerate(_of_friction(model)):
        last = first + len(model.terms[k].candidate.form.nonlinear)
        if friction:
            for values, at in ((derivatives, model.columns_of(k)), (shapes, slice(first, last))):
                along = solve(columns[data.valid], values[data.valid, at])
                values[:, at] -= columns @ along
            free[model.columns_of(k)] = True
        first = last
    return replace(model, derivatives=derivatives, free=free), shapes
