"""Samples at which the encoder does not tell the direction, found in few calls."""

from typing import Final

import numpy as np
from numpy.typing import NDArray

from edge_ident.diagnosis.prepare.masks import TURN_NOISE
from edge_ident.estimation.compensated_axis import CompensatedAxis

Array = NDArray[np.float64]

_NEARBY: Final = 128
"""Samples beside a reversal that are looked at first, before twice as many."""


def direction_unknown(
    axis: CompensatedAxis, velocity: Array, noise: float, stride: int
) -> NDArray[np.bool_]:
    """Samples, every stride-th, in standstills or within the encoder noise of a reversal."""
    position = np.ascontiguousarray(axis.position[::stride])
    unknown = ~axis.signals.moving[::stride]
    turns = np.flatnonzero(velocity[1:] * velocity[:-1] <= 0.0)
    first = turns - _first_away(position[::-1], len(position) - 1 - turns, TURN_NOISE * noise)
    last = turns + _first_away(position, turns, TURN_NOISE * noise)
    for begin, end in zip(np.maximum(first, 0).tolist(), (last + 1).tolist(), strict=True):
        unknown[begin:end] = True
    return unknown


def _first_away(position: Array, turns: NDArray[np.intp], least: float) -> NDArray[np.intp]:
    """Samples (T,) from each turn to the first after it that is farther from it than `least`.

    One beyond the end where none is.
    """
    nearby = np.minimum(turns[:, None] + np.arange(_NEARBY), len(position) - 1)
    away = np.abs(position[nearby] - position[turns, None]) > least
    after: NDArray[np.intp] = np.argmax(away, axis=1)
    for number in np.flatnonzero(~away.any(axis=1)):
        after[number] = _first_beyond(position[turns[number] :], least)
    return after


def _first_beyond(position: Array, least: float) -> int:
    """First sample after the nearby ones that is farther from sample 0; their number where none."""
    begin, end = _NEARBY, 2 * _NEARBY
    while begin < len(position):
        away = np.abs(position[begin:end] - position[0]) > least
        if away.any():
            return begin + int(np.argmax(away))
        begin, end = end, 2 * end
    return len(position)
