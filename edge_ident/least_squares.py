"""Ordinary least squares on the filtered regressor, with deviations that hold when residuals
are coloured.

Source: IDIM-LS with parallel filtering and decimation (Gautier 1997; Janot et al. 2014).
"""

from typing import Final

import numpy as np
from numpy.typing import NDArray

from edge_ident.covariance import coloured_std
from edge_ident.errors import DataError
from edge_ident.model import Estimate
from edge_ident.signals import Signals

Array = NDArray[np.float64]

_SAMPLES_PER_CUTOFF_PERIOD: Final = 2.5
"""Rate after decimation, in cut-offs: what the filter passes is kept, no more."""
_FEWEST_SAMPLES: Final = 12
"""Three for each parameter."""


def fit(signals: Signals) -> Estimate:
    """Estimate the base model's parameters.

    The inertia's deviation includes its bias by encoder noise in the acceleration.
    """
    part = estimation_part(signals)
    found = solve(signals.regressor[part], signals.effort[part])
    bias = signals.acceleration_noise**2 * abs(found.parameters[0])
    std = found.std.copy()
    std[0] = np.hypot(std[0], bias)
    return Estimate(found.parameters, std)


def estimation_part(signals: Signals) -> NDArray[np.intp]:
    """Samples to estimate from: moving, and decimated to what the filter passes.

    One filter's settling time is left out at both ends, where effort and position are
    continued differently.

    Raises
    ------
    DataError
        Hardly any sample is left.
    """
    rate_hz = 1.0 / signals.period_s
    step = max(1, int(rate_hz / (_SAMPLES_PER_CUTOFF_PERIOD * signals.cutoff_hz)))
    margin = min(int(rate_hz / signals.cutoff_hz), len(signals.effort) // 20)
    part = np.arange(margin, len(signals.effort) - margin, step)
    moving: NDArray[np.intp] = part[signals.moving[part]]
    if len(moving) < _FEWEST_SAMPLES:
        raise DataError(
            f"only {len(moving)} independent samples show the axis in motion",
            "record a longer motion, or one that stands still less",
        )
    return moving


def solve(regressor: Array, effort: Array) -> Estimate:
    """Ordinary least squares.

    Parameters
    ----------
    regressor : (N, 4) array
    effort : (N,) array
    """
    unit, length = _unit_columns(regressor)
    normalized = np.linalg.lstsq(unit, effort, rcond=None)[0]
    std = coloured_std(unit, effort - unit @ normalized)
    return Estimate(normalized / length, std / length)


def condition_number(regressor: Array) -> float:
    """Condition number of an (N, 4) regressor with columns of unit length."""
    return float(np.linalg.cond(_unit_columns(regressor)[0]))


def _unit_columns(regressor: Array) -> tuple[Array, Array]:
    length = np.linalg.norm(regressor, axis=0)
    length = np.where(length > 0, length, 1.0)
    return regressor / length, length
