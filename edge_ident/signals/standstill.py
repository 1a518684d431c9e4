"""Samples that tell nothing of a motion: standstills, and what a filter mixes with unknown ones."""

from typing import Final

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

_DECAY_PERIODS: Final = 1.5
"""Cut-off periods after which 3 % of the filter's response are left."""
_STANDSTILL_NOISE: Final = 8.0
"""Range of the position, in standard deviations of its noise, up to which the axis stands."""
_CREEPING: Final = 0.005
"""Share of an axis's typical speed. A judgement: what friction does at low speed, it does at ten
times that."""


def shortest_move_s(cutoff_hz: float) -> float:
    """Duration of a move between two rests of which hardly a sample is left."""
    return 2.0 * _DECAY_PERIODS / cutoff_hz


def standing(
    position: Array, noise: float, cutoff_hz: float, period_s: float, speed: float = 0.0
) -> Mask:
    """Samples in or near a standstill of at least one cut-off period.

    In a standstill the encoder shows nothing but its own noise, of the standard deviation `noise`,
    or the axis creeps, compared with its typical speed (`crept`). It spoils filtered signals to
    either side until the filter's response has decayed. A shorter reversal stays in: there the
    filtered sign of the velocity describes what the filter leaves of the friction.

    Returns
    -------
    (N,) array of bool
    """
    width = int(np.ceil(1.0 / (cutoff_hz * period_s)))
    margin = int(np.ceil(_DECAY_PERIODS * width))
    most = max(_STANDSTILL_NOISE * noise, crept(speed, width * period_s))
    return at_rest(position, most, width, margin)


def crept(speed: float, duration_s: float) -> float:
    """Distance up to which an axis of a typical speed creeps in a time, and does not slide.

    A controller that holds its place moves it so little, by what bearings, seals and belts give
    way. Friction then is whatever holds the axis, and not that of its direction.
    """
    return _CREEPING * speed * duration_s


def at_rest(position: Array, most: float, width: int, margin: int = 0) -> Mask:
    """Samples (N,) of windows in which a position (N,) hardly changes.

    Parameters
    ----------
    position : (N,) array
    most : float
        Range of the position in such a window.
    width : int
        Samples in a window.
    margin : int
        Samples to both sides of a window that count with it.
    """
    if width >= len(position):
        return np.zeros(len(position), dtype=np.bool_)
    still = _range_within(position, width) <= most
    # from the windows' first samples to all of their samples and the margins at both sides
    return _spread(still, width + 2 * margin)[margin : margin + len(position)]


def near_unknown(unknown: Mask, cutoff_hz: float, period_s: float) -> Mask:
    """Samples that the filter mixes with unknown ones."""
    if not np.any(unknown):
        return unknown
    margin = min(int(np.ceil(_DECAY_PERIODS / (cutoff_hz * period_s))), len(unknown) // 2 - 1)
    return widened(unknown, margin)


def widened(mask: Mask, by: int) -> Mask:
    """Extend a mask (N,) by a number of samples to either side."""
    return _spread(mask, 2 * by + 1)[by : by + len(mask)]


def bridge(signal: Array, moving: Mask) -> Array:
    """Replace (..., N) signals by straight lines where the axis does not move."""
    if moving.all() or not moving.any():
        return signal
    bridged, changes = signal.copy(), np.flatnonzero(np.diff(moving, prepend=True, append=True))
    for begin, end in changes.reshape(-1, 2):
        known = [at for at in (begin - 1, end) if 0 <= at < len(moving)]
        first, last = signal[..., known[0], None], signal[..., known[-1], None]
        slope = (last - first) / max(known[-1] - known[0], 1)
        bridged[..., begin:end] = first + slope * np.arange(begin - known[0], end - known[0])
    return bridged


def _spread(mask: Mask, width: int) -> Mask:
    """Samples (N + width - 1,) up to `width` - 1 after one of a mask (N,), by doubling."""
    spread = np.zeros(len(mask) + width - 1, dtype=np.bool_)
    spread[: len(mask)] = mask
    reached = 1
    while reached < width:
        step = min(reached, width - reached)
        spread[step:] |= spread[:-step].copy()
        reached += step
    return spread


def _range_within(signal: Array, width: int) -> Array:
    """Range of every `width` neighbours (N - width + 1,) in a signal (N,), by doubling."""
    largest = smallest = signal
    reached = 1
    while reached < width:
        step = min(reached, width - reached)
        largest = np.maximum(largest[:-step], largest[step:])
        smallest = np.minimum(smallest[:-step], smallest[step:])
        reached += step
    return np.asarray(largest - smallest)
