"""An effort that was smoothed before it was recorded, and the position was not.

An amplifier's measured current often passes a low-pass filter. What then lags behind the motion is
late at each frequency, and the friction turns over gradually where the axis turns. So the base
model behind a filter looks like a spring, a soft coupling or presliding.
"""

import math
from dataclasses import replace
from typing import Final

import numpy as np
import scipy.optimize
import scipy.signal
from numpy.typing import NDArray

from edge_ident.diagnosis.fit.bounded import solve_within
from edge_ident.diagnosis.fit.own_columns import own_columns, own_limits
from edge_ident.diagnosis.fit.summary import nonzero_rms
from edge_ident.diagnosis.prepare.axis_data import AxisData
from edge_ident.diagnosis.prepare.segment import Segment
from edge_ident.diagnosis.prepare.timing import SHARE_OF_DELAY
from edge_ident.diagnosis.select.selection import Selected
from edge_ident.diagnosis.select.thresholds import DECISIVE
from edge_ident.diagnosis.structure_elsewhere import leaves_structure
from edge_ident.estimation.trust import Finding
from edge_ident.model.model import PARAMETERS, POSITIVE, regressor
from edge_ident.signals.timing import REACH_S

Array = NDArray[np.float64]

_ORDERS: Final = (1, 2)
"""Of the filters that are tried; those of amplifiers are hardly steeper."""
_LAGS: Final = 12
"""Time constants that are tried for each, in a geometric series."""
_MORE: Final = 2
"""Parameters beside those of the base model: the time constant and the order."""


def filter_instead(selected: Selected, tolerance: float) -> Finding | None:
    """What forbids to name causes where a low-pass filter of the effort explains, alone, about as
    much: most of what the base model leaves beyond noise.

    Where nothing was selected, it has to explain the effort: else a search goes on.

    Parameters
    ----------
    selected : Selected
    tolerance : float
        Smallest share of the rms effort that is worth naming.
    """
    search, model, data = selected.search, selected.supported.model, selected.search.data
    if selected.late or search.criterion.room(selected.start, search.noise) <= search.added.value:
        return None
    least_s = min(s.raw_period_s for s in data.segments)
    most_s = min(REACH_S, search.excitation.quarter_turn_s)
    error, hz = min(_best(data, order, least_s, max(most_s, 2.0 * least_s)) for order in _ORDERS)
    beyond, of_base = (max(e - search.noise, 0.0) for e in (error, selected.start.error))
    costs = search.criterion.misfit(error) + _MORE * math.log(search.criterion.samples)
    if beyond > (1.0 - SHARE_OF_DELAY) * of_base:
        return None
    if costs > search.criterion.value(model) + DECISIVE.value:
        return None
    filtered = replace(selected.start, error=error)
    if not model.terms and leaves_structure(data, selected.start, filtered, tolerance):
        return None
    left = math.sqrt(error / np.count_nonzero(data.valid)) / nonzero_rms(data.effort[data.valid])
    return Finding(
        "undetermined_filter",
        f"behind a low-pass filter of {hz:.2g} Hz the effort fits the motion about as well without "
        f"any cause: {left:.1%} of it is left. The effort may be smoothed, and the position not",
        "look for a filter of the measured current or torque, and switch it off or give it a "
        "higher frequency; record a motion of several frequencies, such as --motion multisine",
        blocks=True,
    )


def _best(data: AxisData, order: int, least_s: float, most_s: float) -> tuple[float, float]:
    """Sum of squares behind the best filter of an order, and where that falls by 3 dB, in Hz."""
    logs = np.linspace(math.log(least_s), math.log(most_s), _LAGS)
    best = int(np.argmin([_left(data, order, math.exp(log)) for log in logs]))
    around = logs[max(best - 1, 0)], logs[min(best + 1, _LAGS - 1)]
    found = scipy.optimize.minimize_scalar(
        lambda log: _left(data, order, math.exp(log)), bounds=around, options={"xatol": 1e-3}
    )
    falls = math.sqrt(2.0 ** (1.0 / order) - 1.0) / (math.tau * math.exp(found.x))
    return float(found.fun), falls


def _left(data: AxisData, order: int, lag_s: float) -> float:
    """Sum of squares that the base model leaves behind filters of one time constant."""
    columns = np.vstack([_lagging(s, order, lag_s) for s in data.segments])
    columns = np.hstack([columns, own_columns(data)])[data.valid]
    effort = data.effort[data.valid]
    early, late = own_limits(data, shifted=True)
    low = np.append(np.where(POSITIVE, 0.0, -np.inf), early)
    high = np.append(np.full(len(PARAMETERS), np.inf), late)
    found = solve_within(columns, effort, low, high).solution
    return float(np.sum((effort - columns @ found) ** 2))


def _lagging(segment: Segment, order: int, lag_s: float) -> Array:
    """Columns (n, 4) of the base model behind so many first-order filters."""
    rows = regressor(segment.motion.velocity, segment.motion.acceleration).T
    kept = math.exp(-segment.period_s / lag_s)
    for _ in range(order):
        before = kept * rows[:, :1]
        rows = scipy.signal.lfilter([1.0 - kept], [1.0, -kept], rows, zi=before)[0]
    return np.asarray(segment.filter(rows)).T
