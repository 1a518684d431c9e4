"""How far a hidden fault shows in a recording beyond what the base model leaves of its noise."""

from typing import Final

import numpy as np
from numpy.typing import NDArray

from edge_ident.signals.conditioning import choose_cutoff, filtered_regressor
from edge_ident.signals.filters import lowpass
from firmware_interface.plant import SAMPLE_S, Recordings

Array = NDArray[np.float64]

ABOVE_BAND: Final = ("fast_vibration", "fast_chirp")
"""Disturbances of the measured effort alone, above any band that a position can show."""
# Cut-off periods around a reversal in which the filtered sign of the velocity is not judged.
_SMEARED_PERIODS: Final = 0.7


def variance_ratio(made: Recordings, sound: Recordings, row: int, axis: int) -> float:
    """Variance that the base model leaves outside reversals with the fault, over that without.

    Parameters
    ----------
    made, sound : Recordings
        With and without the fault.
    row, axis : int
        Drive and axis.
    """
    cutoff_hz = choose_cutoff(sound.position[row, axis], SAMPLE_S)
    left = [
        unexplained_variance(
            one.position[row, axis],
            one.effort[row, axis],
            SAMPLE_S,
            float(one.effort_shift_s[row]),
            cutoff_hz,
        )
        for one in (made, sound)
    ]
    return left[0] / left[1]


def added_share(made: Recordings, row: int, axis: int) -> float:
    """Rms of what a fault of the measurement adds to the effort, over the rms effort."""
    command = made.true_command[row, axis]
    added = made.quiet_effort[row, axis] - command
    return float(np.sqrt(np.mean(np.square(added)) / np.mean(np.square(command))))


def unexplained_variance(
    position: Array,
    effort: Array,
    period_s: float,
    shift_s: float,
    cutoff_hz: float,
) -> float:
    """Variance of what a base model, fitted by least squares, leaves outside reversals.

    Parameters
    ----------
    position, effort : (N,) arrays
    shift_s : float
        From a stamp to the middle of the interval in which its effort acted.
    """
    columns = filtered_regressor(position, cutoff_hz, period_s)
    smooth = lowpass(effort, cutoff_hz, period_s, delay_s=shift_s)
    turns = np.diff(np.sign(columns[:, 1])) != 0
    width = int(np.ceil(_SMEARED_PERIODS / (cutoff_hz * period_s)))
    clear = np.convolve(turns, np.ones(2 * width + 1), "same")[: len(effort) - 1] < 0.5
    clear[:width] = clear[-width:] = False
    kept, wanted = columns[:-1][clear], smooth[:-1][clear]
    solved = np.linalg.lstsq(kept, wanted, rcond=None)[0]
    return float(np.mean((wanted - kept @ solved) ** 2))
