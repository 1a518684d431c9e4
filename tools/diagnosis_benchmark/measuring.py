"""How far a hidden fault shows in a recording, and how much of the effort it makes."""

from typing import Final

import numpy as np
from numpy.typing import NDArray

from edge_ident.signals.conditioning import choose_cutoff, filtered_regressor
from edge_ident.signals.filters import lowpass
from firmware_interface.plant import COUNT_RAD, SAMPLE_S, Recordings

Array = NDArray[np.float64]

ABOVE_BAND: Final = ("fast_vibration", "fast_chirp")
"""Disturbances of the measured effort alone, above any band that a position can show."""
_SMEARED_PERIODS: Final = 0.7
"""Cut-off periods around a reversal in which the filtered sign of the velocity is not judged."""
_WINDOW: Final = np.hanning(23)[1:-1]
"""Smooths the true signals: half of an amplitude at 18 Hz is left."""
_TURN: Final = 24
"""Samples on both sides of a reversal or standstill that do not count, 60 ms."""
_WOUND_UP: Final = 2.0 * COUNT_RAD
"""Distance from a turning point that does not count either: while its table sticks, a sound chain
winds up by less than a count to either side, and the motor creeps along."""
_BLOCK: Final = 200
"""Samples."""
_LARGEST_SHIFT: Final = 1.5
"""Periods by which any record may be early or late; the shift belongs to the base model."""


def variance_ratio(
    made: Recordings, sound: Recordings, row: int, axis: int, *, sliding: bool = False
) -> float:
    """Variance that the base model leaves outside reversals with the fault, over that without.

    Parameters
    ----------
    made, sound : Recordings
        With and without the fault.
    row, axis : int
        Drive and axis.
    sliding : bool
        Leave out standstills as well.
    """
    cutoff_hz = choose_cutoff(sound.position[row, axis], SAMPLE_S)
    left = [
        unexplained_variance(
            one.position[row, axis],
            one.effort[row, axis],
            SAMPLE_S,
            float(one.effort_shift_s[row]),
            cutoff_hz,
            one.true_velocity[row, axis] == 0.0 if sliding else None,
        )
        for one in (made, sound)
    ]
    return left[0] / left[1]


def orthogonal_share(made: Recordings, sound: Recordings, row: int, axis: int) -> float:
    """Rms of what a fault adds that the base model cannot express, over the rms effort.

    It is taken on the true motion and the effort without noise, so no filter of the diagnosis
    enters: the base model, with a shift of at most 1.5 periods, is fitted with and without the
    fault, and what the sound drive leaves does not count. Reversals do not count: no encoder
    resolves what happens there within a count. While the table sticks, the controller may creep
    along the chain's wind-up for a second; without that, two sound drives would differ by several
    percent.
    """
    effort = made.quiet_effort[row, axis]
    added = _left(made, row, axis) - _left(sound, row, axis)
    return float(np.sqrt(max(added, 0.0) / np.mean(np.square(effort))))


def added_share(made: Recordings, row: int, axis: int) -> float:
    """Rms of what a fault of the measurement adds to the effort, over the rms effort."""
    command = made.true_command[row, axis]
    added = made.quiet_effort[row, axis] - command
    return float(np.sqrt(np.mean(np.square(added)) / np.mean(np.square(command))))


def _left(made: Recordings, row: int, axis: int) -> float:
    """Variance that the base model leaves of the smoothed effort along the true motion."""
    velocity, time_s = made.true_velocity[row, axis], made.time_s
    direction = np.sign(velocity)
    columns = (np.gradient(velocity, SAMPLE_S), velocity, direction, np.ones(len(velocity)))
    regressor = np.stack([_smoothed(column) for column in columns], axis=-1)
    turns = _turning(made.true_angle[row, axis], direction)
    kept = np.convolve(turns, np.ones(2 * _TURN + 1), "same") < 0.5
    kept = kept[len(_WINDOW) // 2 : -(len(_WINDOW) // 2)]
    known = np.linalg.qr(regressor[kept])[0]
    shifts = (made.effort_shift_s[row], -_LARGEST_SHIFT * SAMPLE_S, _LARGEST_SHIFT * SAMPLE_S)
    left = []
    for shift_s in shifts:
        in_step = np.interp(time_s, time_s + shift_s, made.quiet_effort[row, axis])
        wanted = _smoothed(in_step)[kept]
        left.append(float(np.sum(np.square(wanted - known @ (known.T @ wanted))) / len(velocity)))
    return min(left)


def _turning(angle: Array, direction: Array) -> NDArray[np.bool_]:
    """Samples at which the axis stands, or has hardly moved from where it turns."""
    turning = direction == 0.0
    for turn in np.flatnonzero(np.diff(direction)):
        backward, forward = angle[turn::-1], angle[turn:]
        turning[turn - _until_away(backward) + 1 : turn + _until_away(forward)] = True
    return np.asarray(turning)


def _until_away(angle: Array) -> int:
    """Samples until it has left its first value; looked at in blocks, because it soon has."""
    for first in range(0, len(angle), _BLOCK):
        away = np.abs(angle[first : first + _BLOCK] - angle[0]) > _WOUND_UP
        if np.any(away):
            return first + int(np.argmax(away))
    return len(angle)


def _smoothed(values: Array) -> Array:
    return np.convolve(values, _WINDOW / _WINDOW.sum(), "valid")


def unexplained_variance(
    position: Array,
    effort: Array,
    period_s: float,
    shift_s: float,
    cutoff_hz: float,
    stands: NDArray[np.bool_] | None = None,
) -> float:
    """Variance of what a base model, fitted by least squares, leaves outside reversals.

    Parameters
    ----------
    position, effort : (N,) arrays
    shift_s : float
        From a stamp to the middle of the interval in which its effort acted.
    stands : (N,) array of bool, optional
        Standstills, to be left out as well.
    """
    columns = filtered_regressor(position, cutoff_hz, period_s)
    smooth = lowpass(effort, cutoff_hz, period_s, delay_s=shift_s)
    turns = np.diff(np.sign(columns[:, 1])) != 0
    if stands is not None:
        turns |= stands[:-1]
    width = int(np.ceil(_SMEARED_PERIODS / (cutoff_hz * period_s)))
    clear = np.convolve(turns, np.ones(2 * width + 1), "same")[: len(effort) - 1] < 0.5
    clear[:width] = clear[-width:] = False
    kept, wanted = columns[:-1][clear], smooth[:-1][clear]
    solved = np.linalg.lstsq(kept, wanted, rcond=None)[0]
    return float(np.mean((wanted - kept @ solved) ** 2))
