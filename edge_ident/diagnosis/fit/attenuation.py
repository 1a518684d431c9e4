"""What encoder noise in the regressor takes from the parameters of a model (errors in variables).

Noise in the acceleration makes the inertia too small, the more so the less of the acceleration no
other column has: along one sinusoid it is nearly that of a spring. So the same noise is added once
more, and what that takes tells what the first took. With k times as much energy in the noise as in
what the column has of its own, the inertia comes out as J/(1 + k), and as J/(1 + 2·k) with twice
the noise. The other parameters move along with it.
Source: simulation and extrapolation (Cook and Stefanski, JASA 89, 1994, 1314).
"""

from typing import Final

import numpy as np
from numpy.typing import NDArray

from edge_ident.diagnosis.fit.bounded import solve
from edge_ident.diagnosis.fit.candidates import cached_effort
from edge_ident.diagnosis.fit.fitting import FittedModel, jacobian_of
from edge_ident.diagnosis.fit.held_out import nonlinear_derivatives
from edge_ident.diagnosis.fit.own_columns import own_columns
from edge_ident.diagnosis.prepare.axis_data import AxisData
from edge_ident.model.model import PARAMETERS

Array = NDArray[np.float64]

_MOST_TAKEN: Final = 0.45
"""Of the inertia, by noise that is added: near half of it, nothing tells how much there was."""


def attenuation(data: AxisData, model: FittedModel) -> Array:
    """Sizes (P,) of what encoder noise takes from the parameters of a model, or adds to them.

    Parameters
    ----------
    data : AxisData
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
