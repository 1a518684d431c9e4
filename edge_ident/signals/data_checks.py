"""Checks that a recording passes before anything is computed from it.

Each failed check names the file, the row, the column and what to do.
"""

from collections.abc import Mapping
from typing import Final

import numpy as np
from numpy.typing import NDArray

from edge_ident.errors import DataError
from edge_ident.signals.conditioning import position_noise
from edge_ident.signals.recording import Recording

Array = NDArray[np.float64]

MINIMUM_SAMPLES: Final = 200
"""Twice the points that every signal is subsampled to."""
_MINIMUM_COUNTS: Final = 50
"""Travel, in encoder counts, below which a motion cannot be told from quantization."""
_MINIMUM_NOISES: Final = 20.0
"""Travel, in standard deviations of white position noise, below which there is no motion."""
_STUCK_SHARE: Final = 0.25
"""Share of a record that may pass without a count while the drive is told to move."""
_JUMP_RATIO: Final = 8.0
"""How far a step must exceed both its neighbours and nearly all other steps to be a jump."""


def check_table(source: str, columns: Mapping[str, Array], first_row: int) -> None:
    """Check what holds for any column: time there and increasing, all finite, long enough.

    Parameters
    ----------
    source : str
        File name for messages.
    columns : mapping of name to (N,) array
    first_row : int
        Row of the file that holds the first sample.

    Raises
    ------
    DataError
    """
    if "time_s" not in columns:
        raise DataError(
            f"{source}: column time_s is missing (columns: {', '.join(columns)})",
            "name the column of time stamps in seconds time_s, or pass --column NAME=time_s",
        )
    time_s = columns["time_s"]
    _check_length(source, time_s)
    for name, values in columns.items():
        _check_finite(source, name, values, first_row)
    _check_increasing(source, time_s, first_row)


def _check_length(source: str, time_s: Array) -> None:
    if time_s.ndim != 1 or len(time_s) < MINIMUM_SAMPLES:
        raise DataError(
            f"{source}: {len(time_s)} samples are too few",
            f"record at least {MINIMUM_SAMPLES} samples, better one whole period of the motion",
        )


def _check_finite(source: str, name: str, values: Array, first_row: int) -> None:
    bad = np.flatnonzero(~np.isfinite(values))
    if len(bad):
        raise DataError(
            f"{source}, row {first_row + bad[0]}, column {name}: not a finite number "
            f"({len(bad)} in all)",
            "leave such rows out; uneven sampling is allowed",
        )


def _check_increasing(source: str, time_s: Array, first_row: int) -> None:
    back = np.flatnonzero(np.diff(time_s) <= 0)
    if len(back):
        row = first_row + back[0] + 1
        raise DataError(
            f"{source}, row {row}, column time_s: time goes from "
            f"{time_s[back[0]]:.6g} to {time_s[back[0] + 1]:.6g} s",
            "sort the rows by time and drop repeated ones",
        )


def check_recording(recording: Recording, first_row: int = 0) -> None:
    """Check every axis for no motion, a stuck encoder and a jumping encoder.

    Raises
    ------
    DataError
    """
    for name, axis in recording.axes.items():
        where = f"{recording.source}, axis {name}, position"
        position = axis.position
        steps = np.abs(np.diff(position))
        count = np.min(steps, initial=np.inf, where=steps > 1e-9 * np.ptp(position))
        if not np.isfinite(count) or np.ptp(position) < _MINIMUM_COUNTS * count:
            raise DataError(
                f"{where}: no motion, it stays within {np.ptp(position):.3g} {axis.position_unit}",
                "record while the axis moves through at least "
                f"{_MINIMUM_COUNTS} encoder counts; check that the drive was enabled",
            )
        driver = axis.effort if axis.reference is None else axis.reference
        if np.ptp(position) < _MINIMUM_NOISES * position_noise(position):
            raise DataError(
                f"{where}: nothing but noise, {np.ptp(position):.3g} {axis.position_unit} in all",
                "check the sensor and that the drive was enabled",
            )
        _check_stuck(where, driver, position, first_row)
        _check_jump(where, steps, first_row)


def _check_stuck(where: str, driver: Array, position: Array, first_row: int) -> None:
    """No count for a large share of the record although reference or effort went far."""
    edges = np.flatnonzero(np.diff(position) != 0)
    bounds = np.concatenate([[0], edges + 1, [len(position)]])
    longest = int(np.argmax(np.diff(bounds)))
    first, last = int(bounds[longest]), int(bounds[longest + 1])
    driven = np.ptp(driver[first:last]) > 0.5 * np.ptp(driver)
    if driven and last - first > _STUCK_SHARE * len(position):
        raise DataError(
            f"{where}: stuck from row {first_row + first} to row {first_row + last - 1}",
            "check the encoder's cable and counter; cut the file where the axis was at rest",
        )


def _check_jump(where: str, steps: Array, first_row: int) -> None:
    """One step far larger than the steps beside it and than nearly all others: lost counts."""
    around = np.maximum(np.append(steps[1:], 0.0), np.insert(steps[:-1], 0, 0.0))
    moving = steps[steps > 0]
    usual = max(float(np.percentile(moving, 99)), float(np.min(moving)))
    jumps = np.flatnonzero((steps > _JUMP_RATIO * around) & (steps > _JUMP_RATIO * usual))
    if len(jumps):
        row = first_row + jumps[0] + 1
        raise DataError(
            f"{where}, row {row}: jumps by {steps[jumps[0]]:.4g} in one sample "
            f"({usual:.2g} is usual)",
            "check for lost counts or a counter that wraps; unwrap the position, or cut the file",
        )
