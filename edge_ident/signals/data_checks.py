"""Checks that a recording passes before anything is computed from it.

Each failed check names the file, the row, the column and what to do.
"""

from collections.abc import Mapping
from typing import Final

import numpy as np
from numpy.typing import NDArray

from edge_ident.errors import DataError
from edge_ident.signals.array_checks import (
    check_arrays,
    check_finite,
    check_increasing,
    check_length,
)
from edge_ident.signals.conditioning import condition
from edge_ident.signals.contract_columns import TIME
from edge_ident.signals.effort_encoding import check_magnitude
from edge_ident.signals.metrics import quantile
from edge_ident.signals.moved_axes import MINIMUM_COUNTS, moves, only_noise
from edge_ident.signals.recording import AxisRecord, Recording
from edge_ident.signals.time_units import TIME_WORDS, likely_unit
from edge_ident.support.limits import SMALLEST

Array = NDArray[np.float64]

_STUCK_SHARE: Final = 0.25
"""Share of a record that may pass without a count while the drive is told to move."""
_SLOWEST_S: Final = 1.0
"""Sampling period from which no friction and no inertia shows: motions last a few periods."""
_SPIKE_RATIO: Final = 8.0
"""How far one sample must leave the line between its neighbours, over nearly all others, to be a
spike."""
_SPIKE_WIDTH: Final = 1.5
"""How much farther than its neighbours do: 1 for a step, 2 for a single sample."""
_SPIKE_LEAN: Final = 0.25
"""How far they leave theirs toward it, at least: 0 beside a corner, 0.5 beside a single sample."""
_MOST_SPIKES: Final = 0.02
"""Share of such samples from which they are usual: an effort of pulses."""
_ROUGHER: Final = 5.0
"""Noise of a position over that of an effort, each over its swing, from which the two columns may
be swapped."""
_SWAPPED_FITS: Final = 0.3
"""Residual that the base model may leave of swapped columns; as they stand it leaves more than
twice as much."""
_JUMP_RATIO: Final = 8.0
"""How far a step must exceed both its neighbours and nearly all other steps to be a jump."""
_TINY: Final = float(np.finfo(float).tiny)


def check_table(
    source: str,
    columns: Mapping[str, Array],
    first_row: int,
    held: str | None = None,
    time_column: tuple[str, float] | None = (TIME, 1.0),
) -> None:
    """Check what holds for any column: time there and increasing, all finite, long enough.

    Parameters
    ----------
    source : str
        File name for messages.
    columns : mapping of name to (N,) array
    first_row : int
        Row of the file that holds the first sample.
    held : str, optional
        Headings of the file, for messages.
    time_column : tuple of str and float, or None
        Heading of the time in the file and its unit in s; None where a sampling period is given.

    Raises
    ------
    DataError
    """
    if "time_s" not in columns:
        raise DataError(
            f"{source}: column time_s is missing (columns: {held or ', '.join(columns)})",
            "name the column of time stamps in seconds time_s, give --column NAME=time_s, or give "
            "the sampling period with --period",
        )
    time_s = columns["time_s"]
    check_length(source, time_s)
    for name, values in columns.items():
        check_finite(source, f"column {name}", values, first_row)
    check_increasing(source, "column time_s", time_s, first_row)
    period_s = quantile(np.diff(time_s), 0.5)
    if not SMALLEST < period_s < _SLOWEST_S:
        paced = "slow" if period_s > SMALLEST else "fast"
        raise DataError(
            f"{source}, column time_s: {period_s:.4g} s from sample to sample is too {paced} for "
            "any drive",
            _time_instead(time_s, time_column),
        )


def _time_instead(time_s: Array, time_column: tuple[str, float] | None) -> str:
    """What to say of a time that is too slow as it was read."""
    if time_column is None:
        return "give the sampling period in seconds: --period"
    from shlex import join

    heading, factor = time_column
    unit = likely_unit(time_s / factor)
    said = join(["--unit", f"{heading}={unit}"])
    return (
        f"give the time in seconds; if it is in {TIME_WORDS[unit]}, say so: {said}; if it counts "
        "samples, give --period"
    )


def check_recording(recording: Recording) -> None:
    """Check every axis: an effort that changes, a motion, and an encoder that follows it.

    Raises
    ------
    DataError
    """
    check_usable(recording)
    check_motions(recording)


def _without(recording: Recording, name: str) -> str:
    """How to read a recording without an axis; nothing where it has no other."""
    others = " ".join(f"--axis {other}" for other in recording.axes if other != name)
    return f"; or leave this axis out: {others}" if others else ""


def check_motions(recording: Recording, first_row: int = 0) -> None:
    """Check that every axis moves, and that its encoder follows it.

    Of the effort only what is there is looked at: a motion to follow needs none.

    Raises
    ------
    DataError
    """
    for name, axis in recording.axes.items():
        _check_swapped(recording, name)
        where = f"{recording.source}, axis {name}, position"
        position = axis.position
        steps = np.abs(np.diff(position))
        if not moves(position):
            raise DataError(
                f"{where}: no motion, it stays within {np.ptp(position):.3g} {axis.position_unit}",
                "record while the axis moves through at least "
                f"{MINIMUM_COUNTS} encoder counts; check that the drive was enabled"
                + _without(recording, name),
            )
        driver = axis.effort if axis.reference is None else axis.reference
        if only_noise(position):
            raise DataError(
                f"{where}: only noise, {np.ptp(position):.3g} {axis.position_unit} in all",
                "check the sensor and that the drive was enabled",
            )
        _check_spike(where, position, axis.position_unit, first_row)
        effort_where = f"{recording.source}, axis {name}, effort"
        _check_spike(effort_where, axis.effort, axis.effort_unit, first_row)
        _check_stuck(where, driver, position, first_row)
        _check_jump(where, steps, np.diff(recording.time_s), first_row)
        check_magnitude(f"{recording.source}, axis {name}", recording.time_s, position, axis.effort)


def check_usable(recording: Recording) -> None:
    """Check what nothing follows from: arrays that are no recording, an effort of one value.

    A recording of a file has passed the first of these; one that is made in memory has not.

    Raises
    ------
    DataError
    """
    check_arrays(recording)
    for name, axis in recording.axes.items():
        _check_effort_changes(recording.source, name, axis)


def _check_effort_changes(source: str, name: str, axis: AxisRecord) -> None:
    if np.ptp(axis.effort) > max(1e-12 * np.max(np.abs(axis.effort)), SMALLEST):
        return
    value = f"{axis.effort[0]:.4g} {axis.effort_unit}" if axis.effort[0] else "zero"
    raise DataError(
        f"{source}, axis {name}: the effort is {value} in every sample, although the axis moves",
        "check that the column holds the drive's effort and that the drive was enabled; of an axis "
        "that no drive moves, leave the column of the effort out",
    )


def _check_swapped(recording: Recording, name: str) -> None:
    """A position that is rougher than the effort, and a model that fits the other way round."""
    axis = recording.axes[name]
    noises = [_noise_of_swing(signal) for signal in (axis.position, axis.effort)]
    if noises[0] < _ROUGHER * noises[1]:
        return
    as_given = _left_by_base(recording.time_s, axis.position, axis.effort)
    swapped = _left_by_base(recording.time_s, axis.effort, axis.position)
    if swapped < _SWAPPED_FITS and as_given > 2.0 * swapped:
        raise DataError(
            f"{recording.source}, axis {name}: position and effort are swapped: the position is "
            "as rough as an effort, and the effort as smooth as a position",
            "exchange the names of the two columns",
        )


def _noise_of_swing(signal: Array) -> float:
    """White noise of a signal over its standard deviation; third differences remove its course."""
    return float(np.std(np.diff(signal, 3)) / (np.sqrt(20.0) * max(float(np.std(signal)), _TINY)))


def _left_by_base(time_s: Array, position: Array, effort: Array) -> float:
    """Relative residual of the base model, with an offset in any case."""
    if np.ptp(position) == 0.0:
        return 1.0
    signals = condition(time_s, position, effort)
    length = np.maximum(np.linalg.norm(signals.regressor, axis=0), _TINY)
    unit = signals.regressor / length
    left = signals.effort - unit @ np.linalg.lstsq(unit, signals.effort, rcond=None)[0]
    return float(np.std(left) / max(float(np.std(signals.effort)), _TINY))


def _check_spike(where: str, values: Array, unit: str, first_row: int) -> None:
    """One sample far from both its neighbours, farther than nearly all others, and large.

    It leaves the line of its neighbours, and theirs lean to it by half of that: not so where an
    effort begins to rise steeply. The first and the last sample have one neighbour, and are none.
    """
    padded = np.concatenate([values[:1], values, values[-1:]])
    off = values - 0.5 * (padded[2:] + padded[:-2])
    size = np.abs(off)
    swing = float(np.std(np.delete(values, int(np.argmax(size)))))
    if np.max(size) <= swing:  # of most recordings; what follows takes longer
        return
    here = size[1:-1]
    toward = -np.sign(off[1:-1]) * np.stack([off[:-2], off[2:]])
    alone = (here > _SPIKE_WIDTH * toward.max(0)) & (toward.min(0) > _SPIKE_LEAN * here)
    alone &= here > swing
    beside = np.convolve(alone, np.ones(3)) > 0.0
    usual = quantile(size[~beside] if np.mean(alone) < _MOST_SPIKES else size, 0.999)
    spikes = 1 + np.flatnonzero(alone & (here > _SPIKE_RATIO * usual))
    if len(spikes):
        raise DataError(
            f"{where}, row {first_row + spikes[0]}: a spike of {off[spikes[0]]:.4g} {unit} in one "
            f"sample ({usual:.2g} is usual; {len(spikes)} in all)",
            "remove these rows; uneven sampling is allowed",
        )


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


def _check_jump(where: str, distances: Array, passed_s: Array, first_row: int) -> None:
    """One step far larger than the steps beside it and than nearly all others: lost counts. Across
    a gap of the time stamps an axis goes farther, and its mean speed counts."""
    steps = distances / np.maximum(passed_s / quantile(passed_s, 0.5), 1.0)
    around = np.maximum(np.append(steps[1:], 0.0), np.insert(steps[:-1], 0, 0.0))
    alone = np.flatnonzero(steps > _JUMP_RATIO * around)
    if not len(alone):
        return
    moving = steps[steps > 0]
    usual = max(quantile(moving, 0.99), float(np.min(moving)))
    jumps = alone[steps[alone] > _JUMP_RATIO * usual]
    if len(jumps):
        row = first_row + jumps[0] + 1
        raise DataError(
            f"{where}, row {row}: jumps by {distances[jumps[0]]:.4g} in one sample "
            f"({usual:.2g} is usual)",
            "check for lost counts or a counter that wraps; unwrap the position, or cut the file",
        )
