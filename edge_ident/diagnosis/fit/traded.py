"""How uncertain base parameters are because they trade places with the causes beside them.

A part of a cause's effort lies in the span of the base model's columns: friction that bends looks
like less viscous and more Coulomb friction over most of its range. There the data cannot tell the
two apart; only the formula of the cause says how much belongs to which. How well the formula is
confirmed shows in the part that the base model cannot express: what is left unexplained, over that
part of the cause, is the relative error that the formula may have. The same relative error of what
the cause takes from a base parameter is added to the parameter's standard deviation. At most it is
all of it, where the interval reaches the parameter of the base model alone.

They also trade places with the shift between effort and position. Along one slow sinusoid a shift
looks like less inertia and more viscous friction, and the fit may end at a limit of the shift. Then
the shift may lie anywhere between its limits.
"""

import numpy as np
from numpy.typing import NDArray

from edge_ident.diagnosis.fit.attenuation import attenuation
from edge_ident.diagnosis.fit.bounded import solve
from edge_ident.diagnosis.fit.fitting import FittedModel, delayed
from edge_ident.diagnosis.fit.held_out import standard_deviations
from edge_ident.diagnosis.fit.summary import nonzero_rms
from edge_ident.diagnosis.fit.term_effort import term_effort
from edge_ident.diagnosis.prepare.axis_data import AxisData
from edge_ident.model.model import PARAMETERS
from edge_ident.signals.metrics import rms

Array = NDArray[np.float64]


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
    data : AxisData
    base : FittedModel
        Fitted without the terms; its Jacobian spans what the base model can express.
    model : FittedModel
        Without external vibrations.
    floor : float
        Rms that noise alone leaves.
    """
    columns = base.jacobian[data.valid]
    left = rms((data.effort - model.predicted)[data.valid])
    unexplained = float(np.sqrt(max(left**2 - floor**2, 0.0)))
    variance = np.zeros(len(PARAMETERS))
    for k in range(len(model.terms)):
        effort = term_effort(data, model, k)[data.valid]
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
