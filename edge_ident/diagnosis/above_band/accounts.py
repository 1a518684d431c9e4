"""The effort above the band without what the motion explains, and the lines that stand out of it.

Where encoder noise hides the acceleration, nobody knows what the inertia takes of the effort. So
there are three accounts of it: with the acceleration where noise does not hide it, with all of it,
and with none.
"""

from dataclasses import replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from edge_ident.diagnosis.above_band.full_bandwidth import WIDEST, WideSignals
from edge_ident.diagnosis.above_band.spectral_lines import (
    REPEATED,
    Periodogram,
    over_time,
    refined,
)

Array = NDArray[np.float64]

_FEWEST_PERIODS: Final = 5.0
"""Fewest periods of a line in the record."""
_CLIPPED: Final = 5.0
"""Robust standard deviations at which a residual is clipped: a sinusoid does not reach them."""
_MEDIAN_OF_NORMAL: Final = 0.6745
_HIDDEN: Final = 0.5
"""Share of the acceleration that is left at a frequency, below which encoder noise hides it."""
_LEAKED: Final = 0.5
"""Share of the noise about a line that stays without it, below which the line made most of it."""
_TINY: Final = float(np.finfo(float).tiny)


def least_squares(rows: Array, signal: Array) -> Array:
    """Amplitudes (R,) with which rows (R, N) make up a signal (N,)."""
    gram, moment = rows @ rows.T, rows @ signal
    length = np.sqrt(np.maximum(np.diag(gram), _TINY))
    scaled = gram / np.outer(length, length)
    return np.asarray(np.linalg.lstsq(scaled, moment / length, rcond=1e-12)[0] / length)


def inertia(wide: WideSignals, waves: Array) -> float:
    """Inertia by generalized least squares over the whole band, beside waves (W, N)."""
    rows = wide.whitened(np.concatenate([wide.base, waves]))
    return max(float(least_squares(rows, wide.whitened(wide.effort))[0]), 0.0)


def accounts(wide: WideSignals, mass: float, orders: Array) -> Array:
    """Effort above the band without inertia and friction, clipped, (3, N).

    First with the acceleration weighted as by Wiener: the noise that it adds stays below that of
    the effort at every frequency. Then with the whole acceleration, and with none: what weighting
    leaves out of a motion of many frequencies, and the noise that it lets through, look like lines.

    Jolts that the encoder does not resolve are larger than a line that lasts, and would take its
    place in a fit. So all is clipped but the waves of orders (W, N), which may act at high speed
    alone.
    """
    accelerations = np.stack(
        [wide.clean_acceleration, wide.acceleration, np.zeros(len(wide.effort))]
    )
    slow = np.concatenate([wide.friction_above, wide.loads_above])
    above = left_beside(slow, wide.above(wide.effort - mass * accelerations))
    rows = wide.above(orders)
    known = np.stack([least_squares(rows, one) @ rows for one in above])
    return known + np.stack([clipped(wide, one) for one in above - known])


def left_beside(rows: Array, above: Array) -> Array:
    """Efforts above the band (..., N) without what rows (R, N) account for."""
    flat = above.reshape(-1, above.shape[-1])
    left = np.stack([one - least_squares(rows, one) @ rows for one in flat])
    return left.reshape(above.shape)


def clipped(wide: WideSignals, left: Array) -> Array:
    """A residual (N,) without its impacts, which are no lines."""
    seen = np.abs(left[wide.weight > 0.5])
    most = _CLIPPED / _MEDIAN_OF_NORMAL * float(np.median(seen)) if len(seen) else 0.0
    return np.clip(left, -most, most)


def lines_over_time(wide: WideSignals, residual: Array) -> Periodogram:
    """Lines in time of a residual above the band (N,).

    Where directions are often unknown, the weight has gaps, and a line leaks through them over the
    noise that it is to stand out of. So where most of the noise about the highest ordinate goes
    with the line that it would be, what stays is the noise.
    """
    found = _lines(wide, residual)
    if not len(found.rate) or np.any(found.prominence > 1.0):
        return found
    k = int(np.argmax(found.prominence))
    if REPEATED * wide.leakage * found.power[k] < _LEAKED * found.level[k]:
        return found
    rate = refined(wide.weight * residual, wide.time_s, float(found.rate[k]), found.cell)
    line = wide.above(wide.waves(wide.time_s, rate))
    rest = _lines(wide, left_beside(line, residual))
    leaked = (np.abs(found.rate - rate) < found.cell) & (rest.level < _LEAKED * found.level)
    return replace(found, level=np.where(leaked, rest.level, found.level))


def _lines(wide: WideSignals, residual: Array) -> Periodogram:
    lowest = max(wide.cutoff_hz, _FEWEST_PERIODS / (wide.period_s * len(residual)))
    turn = 2.0 * np.pi
    found = over_time(
        residual, wide.weight, wide.period_s, turn * lowest, turn * WIDEST / wide.period_s
    )
    return found.beside_harmonics(turn / wide.lap_s) if wide.lap_s else found


def quietest_lines(wide: WideSignals, weighted: Array, none: Array) -> Periodogram:
    """Lines in time of the account (N,) with the weighted acceleration, or of that with none.

    At a frequency where encoder noise hides the motion, weighting leaves the acceleration out, but
    for what leaks from frequencies that it lets through. There the quieter one counts.
    """
    first, other = lines_over_time(wide, weighted), lines_over_time(wide, none)
    quieter = (wide.known_motion(first.rate) < _HIDDEN) & (other.level < first.level)
    return replace(
        first,
        power=np.where(quieter, other.power, first.power),
        level=np.where(quieter, other.level, first.level),
    )
