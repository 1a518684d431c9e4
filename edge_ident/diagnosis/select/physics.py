"""Whether the extended model's own optimum, without bounds, is a machine.

A controller's law that is fitted as a machine has friction that drives the motion.
"""

from typing import Final

import numpy as np
from numpy.typing import NDArray

from edge_ident.diagnosis.fit.deviations import attenuation
from edge_ident.diagnosis.fit.fitting import FittedModel, bounds, jacobian_of
from edge_ident.diagnosis.fit.held_out import standard_deviations
from edge_ident.diagnosis.fit.linear import solve_within
from edge_ident.diagnosis.fit.summary import base_space, own_efforts
from edge_ident.diagnosis.prepare.axis_data import AxisData
from edge_ident.diagnosis.select.thresholds import NEGATIVE
from edge_ident.estimation.least_squares import coloured_std
from edge_ident.model.effects import named
from edge_ident.model.model import PARAMETERS
from edge_ident.signals.conditioning import unit_length
from edge_ident.signals.metrics import rms

Array = NDArray[np.float64]

FRICTION: Final = ("viscous_friction", "coulomb_friction")
"""Base parameters that take power."""


def unphysical(
    data: AxisData, start: FittedModel, model: FittedModel, tolerance: float
) -> str | None:
    """What is unphysical about the unbounded optimum of a model, in words; None where nothing is.

    Parameters
    ----------
    model : FittedModel
        Its nonlinear parameters stay as they are.
    tolerance : float
        Rms of an effort that is not worth naming.
    """
    if model.base[0] <= 0.0 and _shows_inertia(data, start):
        return "with it the best fit has no inertia, which no machine has"
    jacobian = jacobian_of(data, model)[data.valid]
    left, present = (data.effort - model.predicted)[data.valid], model.linear_parameters
    # a shift beyond its limits is a delay, and takes from the inertia
    low, high = np.array(bounds(data, model.template, model.terms)) - present
    shifts = slice(len(PARAMETERS), len(PARAMETERS) + len(model.own))
    free = np.full(len(present), np.inf)
    free[shifts] = 0.0
    step = solve_within(jacobian, left, low - free, high + free).solution
    optimum = present + step
    unit, length = unit_length(jacobian)
    residual = left - jacobian @ step
    taken = attenuation(data, model)[: len(length)]
    deviations = np.hypot(coloured_std(unit, residual) / length, taken)
    shared = any(named(effect).search.shares_friction for effect in model.effects)
    sizes = np.abs(optimum) * [rms(column) for column in jacobian.T]
    for name, value, std, size in zip(PARAMETERS[:3], optimum, deviations, sizes, strict=False):
        certain = value < -NEGATIVE * std and size > tolerance
        if certain and not (shared and name in FRICTION):
            return (
                f"with it the best fit has a negative {name.replace('_', ' ')}, "
                f"{value:.3g} ± {std:.2g}, which no machine has"
            )
    if _shows_inertia(data, start, tolerance) and _lacks_inertia(data, start, model):
        return (
            f"it takes the place of the inertia: {model.base[0]:.3g} of {start.base[0]:.3g} is left"
        )
    return _driving_friction(data, model, optimum, jacobian) if shared else None


def _shows_inertia(data: AxisData, model: FittedModel, least: float = 0.0) -> bool:
    """Whether a model has a certain inertia, and one whose effort has more than a least rms."""
    inertia, column = float(model.base[0]), model.jacobian[data.valid, 0]
    parts = standard_deviations(data, model)[0], attenuation(data, model)[0]
    return inertia > NEGATIVE * np.hypot(*parts) and inertia * rms(column) > least


def _lacks_inertia(data: AxisData, start: FittedModel, model: FittedModel) -> bool:
    """Whether a model may as well have no inertia, or a spring took more than half of it.

    Along one sinusoid a spring differs from an inertia by what the position has beside the
    sinusoid. If the encoder made that, the inertia is too small, and its deviation says nothing of
    it. What else a load does, no inertia does, and no encoder.
    """
    left, taken = model.base[0], start.base[0] - model.base[0]
    instead = left < taken and not data.several_speeds and _springs(data, start, model)
    return instead or not _shows_inertia(data, model)


def _springs(data: AxisData, start: FittedModel, model: FittedModel) -> bool:
    """Whether more than half of the own effort of a term is that of a spring."""
    space = base_space(data, start)
    filtered = np.concatenate([s.filter(s.motion.position) for s in data.segments])
    position = filtered[data.valid, np.newaxis]
    spring, _ = unit_length(position - space @ (space.T @ position))
    efforts = own_efforts(data, model, space)
    shared = np.sum(np.square(efforts @ spring), axis=1)
    return bool(np.any(shared > np.sum(np.square(efforts), axis=1) - shared))


def _driving_friction(
    data: AxisData, model: FittedModel, optimum: Array, jacobian: Array
) -> str | None:
    """Whether friction as a whole drives the motion, slow or fast."""
    columns = [PARAMETERS.index(name) for name in FRICTION]
    for k, t in enumerate(model.terms):
        if named(t.candidate.effect).search.shares_friction:
            columns += range(*model.columns_of(k).indices(jacobian.shape[1]))
    velocity = data.of_motion("velocity")[data.valid]
    power = (jacobian[:, columns] @ optimum[columns]) * velocity
    fast = np.abs(velocity) > np.median(np.abs(velocity))
    for word, samples in (("fast", fast), ("slow", ~fast)):
        if np.sum(power[samples]) < 0.0:
            return f"with it the best fit has friction that drives the {word} motion"
    return None
