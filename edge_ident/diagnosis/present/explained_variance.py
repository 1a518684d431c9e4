"""How much of a residual's variance each quantity explains."""

from collections.abc import Mapping
from typing import Final

import numpy as np
from numpy.typing import NDArray

from edge_ident.diagnosis.measures import Traces
from edge_ident.diagnosis.result import AxisDiagnosis

Array = NDArray[np.float64]

_BINS: Final = 40
"""Most bins of a quantity, in each direction."""
_PER_BIN: Final = 20
"""Fewest samples of a bin, of both directions."""
_TIME_BINS: Final = 10
"""Few, so that time does not stand for whatever changes slowly."""


def explained_variance(
    name: str, diagnosed: Mapping[str, AxisDiagnosis]
) -> dict[str, dict[str, float]]:
    """Variance of the residual that each quantity explains, as a share (correlation ratio).

    Pearson's correlation ratio η², adjusted for the number of bins: zero where the quantity
    explains nothing, one where it explains all. Each direction of motion has its own bins, except
    for time. Quantities that move together explain the same share.

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
    traces, valid = diagnosed[name].traces, diagnosed[name].traces.valid
    residuals = {"base": traces.base_effort, "extended": traces.extended_effort}
    by = groups(name, diagnosed)
    return {
        model: {
            of: correlation_ratio((traces.effort - effort)[valid], group)
            for of, group in by.items()
        }
        for model, effort in residuals.items()
    }


def groups(name: str, diagnosed: Mapping[str, AxisDiagnosis]) -> dict[str, NDArray[np.intp]]:
    """Numbers of bins of the valid samples, by quantity; each direction has its own, time not."""
    traces = diagnosed[name].traces
    valid, forward = traces.valid, (traces.velocity > 0.0)[traces.valid]
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
    found = {of: 2 * _bins(values[valid], bins) + forward for of, values in quantities.items()}
    return found | {"time": _bins(running_time(traces)[valid], _TIME_BINS)}


def acceleration_at(traces: Traces, other: Traces) -> Array:
    """Acceleration (N,) of another axis at this axis's times, recording by recording; 0 where it
    rests."""
    found = np.zeros_like(traces.time_s)
    for number in np.intersect1d(traces.recording, other.recording):
        here, there = traces.recording == number, other.recording == number
        found[here] = np.interp(traces.time_s[here], other.time_s[there], other.acceleration[there])
    return found


def running_time(traces: Traces) -> Array:
    """Seconds (N,) since the first sample, one recording after the other."""
    steps = np.diff(traces.time_s, prepend=traces.time_s[0])
    first = np.flatnonzero(np.diff(traces.file)) + 1
    steps[first] = np.median(steps)
    return np.asarray(np.cumsum(steps))


def correlation_ratio(residual: Array, group: NDArray[np.intp]) -> float:
    """Share of the variance between groups of samples, adjusted for their number."""
    _, index, count = np.unique(group, return_inverse=True, return_counts=True)
    free = len(residual) - len(count)
    if free <= 0 or np.ptp(residual) == 0.0:
        return 0.0
    means = np.bincount(index, weights=residual) / count
    within = float(np.sum((residual - means[index]) ** 2)) / free
    return round(max(0.0, 1.0 - within / float(np.var(residual, ddof=1))), 4)


def _bins(values: Array, bins: int) -> NDArray[np.intp]:
    """Numbers of bins that hold equally many samples."""
    rank = np.argsort(np.argsort(values, kind="stable"), kind="stable")
    return np.asarray(rank * bins // max(len(values), 1))
