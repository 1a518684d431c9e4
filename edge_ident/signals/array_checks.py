"""Whether the arrays of a recording are what every computation takes for granted.

A file's columns pass these checks when they are read. A recording that a program makes in memory
passes them where it is first used, in a few passes over each array.
"""

from collections.abc import Iterator
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from edge_ident.errors import DataError
from edge_ident.signals.contract_columns import EFFORTS, QUANTITIES, UNITS
from edge_ident.signals.recording import AxisRecord, Recording
from edge_ident.support.given import check_type
from edge_ident.support.limits import LARGEST

Array = NDArray[np.float64]

MINIMUM_SAMPLES: Final = 200
"""Twice the points that every signal is subsampled to."""
_POSITION_UNITS: Final = QUANTITIES["position"]
_EFFORT_UNITS: Final = tuple(UNITS[QUANTITIES[quantity][0]] for quantity in EFFORTS)


def check_arrays(recording: Recording) -> None:
    """Check form, numbers, and the order of time.

    Raises
    ------
    DataError
        As of `check_form`; something is no vector of floating-point numbers; there are too few; a
        number is not finite; time goes back.
    """
    source, time_s = recording.source, recording.time_s
    for axis in recording.axes.values():
        check_type(axis, AxisRecord, "give an AxisRecord for each axis")
    _check_vector(f"{source}, time_s", time_s)
    for name, axis in recording.axes.items():
        for quantity, values in _signals(axis):
            _check_vector(f"{source}, axis {name}, {quantity}", values)
    check_form(recording)
    check_length(source, time_s)
    check_finite(source, "time_s", time_s, 0)
    check_increasing(source, "time_s", time_s, 0)
    for name, axis in recording.axes.items():
        for quantity, values in _signals(axis):
            check_finite(source, f"axis {name}, {quantity}", values, 0)


def check_form(recording: Recording) -> None:
    """Check units and lengths, whatever the numbers are.

    Raises
    ------
    DataError
        There is no axis, a unit is not one that `AxisRecord` names, or a signal is not as long as
        the time.
    """
    source, time_s = recording.source, recording.time_s
    if not recording.axes:
        raise DataError(f"{source}: it has no axis", "give an AxisRecord for each axis")
    for name, axis in recording.axes.items():
        _check_units(f"{source}, axis {name}", axis)
        for quantity, values in _signals(axis):
            if len(values) != len(time_s):
                raise DataError(
                    f"{source}, axis {name}, {quantity}: {len(values)} values, and {len(time_s)} "
                    "time stamps",
                    "give one value per time stamp",
                )
    for name, passive in recording.passive.items():
        if len(passive.position) != len(time_s):
            raise DataError(
                f"{source}, axis {name}: {len(passive.position)} positions, and {len(time_s)} "
                "time stamps",
                "give one value per time stamp",
            )


def check_length(source: str, time_s: Array) -> None:
    """Check that there are samples enough.

    Raises
    ------
    DataError
    """
    if len(time_s) < MINIMUM_SAMPLES:
        raise DataError(
            f"{source}: {len(time_s)} samples are not enough",
            f"record at least {MINIMUM_SAMPLES} samples, better a whole period of the motion",
        )


def check_finite(source: str, what: str, values: Array, first_row: int) -> None:
    """Check that every value is a number, and one that a machine has: its square is one, too.

    Parameters
    ----------
    source, what : str
        File and column, for messages.
    values : (N,) array
    first_row : int
        Row of the file that holds the first value.

    Raises
    ------
    DataError
    """
    sound = (values >= -LARGEST) & (values <= LARGEST)
    if not sound.all():
        bad = np.flatnonzero(~sound)
        value = float(values[bad[0]])
        said = (
            f"{value:.4g} is more than {LARGEST:g}" if np.isfinite(value) else "not a finite number"
        )
        raise DataError(
            f"{source}, row {first_row + bad[0]}, {what}: {said} ({len(bad)} in all)",
            "remove these rows; uneven sampling is allowed",
        )


def check_increasing(source: str, what: str, time_s: Array, first_row: int) -> None:
    """Check that time goes on from every sample to the next; parameters as of `check_finite`.

    Raises
    ------
    DataError
    """
    back = np.flatnonzero(np.diff(time_s) <= 0)
    if len(back):
        row = first_row + back[0] + 1
        again = np.count_nonzero(time_s[back + 1] <= time_s[1])
        if again == len(back) and back[0] + 1 >= MINIMUM_SAMPLES:
            raise DataError(
                f"{source}, row {row}, {what}: time starts again, {again} times in all: several "
                "recordings stand in the file, one after the other",
                "cut the file there, and give the recordings one by one",
            )
        raise DataError(
            f"{source}, row {row}, {what}: time goes from {time_s[back[0]]:.15g} to "
            f"{time_s[back[0] + 1]:.15g} s",
            "sort the rows by time and remove repeated ones",
        )


def _signals(axis: AxisRecord) -> Iterator[tuple[str, Any]]:
    for quantity in ("position", "effort", "reference", "velocity", "temperature_c"):
        values = getattr(axis, quantity)
        if values is not None:
            yield quantity, values


def _check_vector(where: str, values: Any) -> None:
    """One dimension, of floating-point numbers."""
    if not isinstance(values, np.ndarray) or values.ndim != 1 or values.dtype.kind != "f":
        what = f"a {type(values).__name__}"
        if isinstance(values, np.ndarray):
            what = f"an array of shape {values.shape} and type {values.dtype}"
        raise DataError(
            f"{where}: {what}, not a vector of floating-point numbers",
            "convert it: numpy.asarray(values, dtype=float).ravel()",
        )


def _check_units(where: str, axis: AxisRecord) -> None:
    for quantity, unit, known in (
        ("position", axis.position_unit, _POSITION_UNITS),
        ("effort", axis.effort_unit, _EFFORT_UNITS),
    ):
        if unit not in known:
            raise DataError(
                f"{where}: its {quantity} is in {unit!r}",
                f"convert it to one of these, and say which: {', '.join(known)}",
            )
