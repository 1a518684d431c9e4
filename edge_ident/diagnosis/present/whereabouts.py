"""Where a residual lives, as numbers: how much of it follows from one quantity alone."""

from collections.abc import Mapping
from typing import Final

import numpy as np
from numpy.typing import NDArray

from edge_ident.diagnosis.result import AxisDiagnosis, Traces

Array = NDArray[np.float64]

_BINS: Final = 40
"""Of a quantity, in each direction, at most."""
_PER_BIN: Final = 20
"""Samples, at least, of both directions."""
_TIME_BINS: Final = 10
"""Few, so that time does not stand for whatever moves slowly."""


def whereabouts(name: str, diagnosed: Mapping[str, AxisDiagnosis]) -> dict[str, dict[str, float]]:
    """For each quantity, the share of the residual's variance that its bins' means have.

    Pearson's correlation ratio, adjusted for the number of bins as R² is for that of parameters:
    zero where the quantity says nothing, one where it says all. Bins are those of one direction,
    but for time. Quantities that move together have their shares together.

    Parameters
    ----------
    name : str
        Of the axis.
    diagnosed : mapping of axis name to AxisDiagnosis
        All axes.

    Returns
    -------
    dict
        By "base" and "extended", then by quantity.
    """
    traces = diagnosed[name].traces
    clear, forward = traces.clear, (traces.velocity > 0.0)[traces.clear]
    quantities = {
        "position": traces.position,
        "velocity": traces.velocity,
        "distance_since_reversal": traces.since_reversal,
    } | {
        f"acceleration_of_{other}": acceleration_at(traces, diagnosed[other].traces)
        for other in diagnosed
        if other != name
    }
    bins = min(_BINS, len(forward) // _PER_BIN)
    groups = {of: 2 * _bins(values[clear], bins) + forward for of, values in quantities.items()}
    groups["time"] = _bins(running_time(traces)[clear], _TIME_BINS)
    residuals = {"base": traces.base_effort, "extended": traces.extended_effort}
    return {
        model: {of: _ratio((traces.effort - effort)[clear], group) for of, group in groups.items()}
        for model, effort in residuals.items()
    }


def acceleration_at(traces: Traces, other: Traces) -> Array:
    """Acceleration (N,) of another axis at the times of this one, recording by recording."""
    found = np.empty_like(traces.time_s)
    for number in np.unique(traces.file):
        here, there = traces.file == number, other.file == number
        found[here] = np.interp(traces.time_s[here], other.time_s[there], other.acceleration[there])
    return found


def running_time(traces: Traces) -> Array:
    """Seconds (N,) since the first sample, one recording after the other."""
    steps = np.diff(traces.time_s, prepend=traces.time_s[0])
    first = np.flatnonzero(np.diff(traces.file)) + 1
    steps[first] = np.median(steps)
    return np.asarray(np.cumsum(steps))


def _bins(values: Array, bins: int) -> NDArray[np.intp]:
    """Numbers of equally filled bins."""
    rank = np.argsort(np.argsort(values, kind="stable"), kind="stable")
    return np.asarray(rank * bins // max(len(values), 1))


def _ratio(residual: Array, group: NDArray[np.intp]) -> float:
    """Share of the variance between the groups."""
    _, index, count = np.unique(group, return_inverse=True, return_counts=True)
    free = len(residual) - len(count)
    if free <= 0 or np.ptp(residual) == 0.0:
        return 0.0
    means = np.bincount(index, weights=residual) / count
    within = float(np.sum((residual - means[index]) ** 2)) / free
    return round(max(0.0, 1.0 - within / float(np.var(residual, ddof=1))), 4)
