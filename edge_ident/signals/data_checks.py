"""Checks that a recording passes before anything is computed from it.

Each failed check names the file, the row, the column and what to do.
"""

from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from edge_ident.errors import DataError
from edge_ident.signals import conditioning, contract_columns, effort_encoding, metrics
from edge_ident.signals.recording import Array, AxisRecord, PassiveAxis, Recording
from edge_ident.support.documents import LARGEST, SMALLEST
from edge_ident.support.given import check_type

# Share of a record that may pass without a count while the drive is told to move.
_STUCK_SHARE: Final = 0.25
# Sampling period from which no friction and no inertia shows: motions last a few periods.
_SLOWEST_S: Final = 1.0
# How far one sample must leave the line between its neighbours, over nearly all others, to be a
# spike.
_SPIKE_RATIO: Final = 8.0
# How much farther than its neighbours do: 1 for a step, 2 for a single sample.
_SPIKE_WIDTH: Final = 1.5
# How far they leave theirs toward it, at least: 0 beside a corner, 0.5 beside a single sample.
_SPIKE_LEAN: Final = 0.25
_MOST_SPIKES: Final = 0.02  # share of such samples from which they are usual: an effort of pulses
# Noise of a position over that of an effort, each over its swing, from which the two columns may be
# swapped.
_ROUGHER: Final = 5.0
# Residual that the base model may leave of swapped columns; as they stand it leaves more than twice
# as much.
_SWAPPED_FITS: Final = 0.3
# How far a step must exceed both its neighbours and nearly all other steps to be a jump.
_JUMP_RATIO: Final = 8.0
_TINY: Final = float(np.finfo(float).tiny)


def check_table(
    source: str,
    columns: Mapping[str, Array],
    rows: contract_columns.Rows,
    held: str | None = None,
    time_column: tuple[str, float] | None = (contract_columns.TIME, 1.0),
) -> None:
    """Check what holds for any column: time there and increasing, all finite, long enough.

    Parameters
    ----------
    source : str
        File name for messages.
    columns : mapping of name to (N,) array
    rows : range or (N,) array of int
        Row of the file that holds each sample.
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
        check_finite(source, f"column {name}", values, rows)
    check_increasing(source, "column time_s", time_s, rows)
    period_s = metrics.quantile(np.diff(time_s), 0.5)
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
    unit = contract_columns.likely_unit(time_s / factor)
    said = join(["--unit", f"{heading}={unit}"])
    return (
        f"give the time in seconds; if it is in {contract_columns.TIME_WORDS[unit]}, say so: "
        f"{said}; if it counts samples, give --period"
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


def check_motions(recording: Recording, rows: contract_columns.Rows | None = None) -> None:
    """Check that every axis moves, and that its encoder follows it.

    Of the effort only what is there is looked at: a motion to follow needs none.

    Parameters
    ----------
    recording : Recording
    rows : range or (N,) array of int, optional
        Row of the file that holds each sample; counted from 0 without.

    Raises
    ------
    DataError
    """
    rows = range(len(recording.time_s)) if rows is None else rows
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
        _check_spike(where, position, axis.position_unit, rows)
        effort_where = f"{recording.source}, axis {name}, effort"
        _check_spike(effort_where, axis.effort, axis.effort_unit, rows)
        _check_stuck(where, driver, position, rows)
        _check_jump(where, steps, np.diff(recording.time_s), rows)
        effort_encoding.check_magnitude(
            f"{recording.source}, axis {name}", recording.time_s, position, axis.effort
        )


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
    signals = conditioning.condition(time_s, position, effort)
    length = np.maximum(np.linalg.norm(signals.regressor, axis=0), _TINY)
    unit = signals.regressor / length
    left = signals.effort - unit @ np.linalg.lstsq(unit, signals.effort, rcond=None)[0]
    return float(np.std(left) / max(float(np.std(signals.effort)), _TINY))


def _check_spike(where: str, values: Array, unit: str, rows: contract_columns.Rows) -> None:
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
    usual = metrics.quantile(size[~beside] if np.mean(alone) < _MOST_SPIKES else size, 0.999)
    spikes = 1 + np.flatnonzero(alone & (here > _SPIKE_RATIO * usual))
    if len(spikes):
        raise DataError(
            f"{where}, row {rows[spikes[0]]}: a spike of {off[spikes[0]]:.4g} {unit} in one "
            f"sample ({usual:.2g} is usual; {len(spikes)} in all)",
            "remove these rows; uneven sampling is allowed",
        )


def _check_stuck(where: str, driver: Array, position: Array, rows: contract_columns.Rows) -> None:
    """No count for a large share of the record although reference or effort went far."""
    edges = np.flatnonzero(np.diff(position) != 0)
    bounds = np.concatenate([[0], edges + 1, [len(position)]])
    longest = int(np.argmax(np.diff(bounds)))
    first, last = int(bounds[longest]), int(bounds[longest + 1])
    driven = np.ptp(driver[first:last]) > 0.5 * np.ptp(driver)
    if driven and last - first > _STUCK_SHARE * len(position):
        raise DataError(
            f"{where}: stuck from row {rows[first]} to row {rows[last - 1]}",
            "check the encoder's cable and counter; cut the file where the axis was at rest",
        )


def _check_jump(where: str, distances: Array, passed_s: Array, rows: contract_columns.Rows) -> None:
    """One step far larger than the steps beside it and than nearly all others: lost counts. Across
    a gap of the time stamps an axis goes farther, and its mean speed counts."""
    steps = distances / np.maximum(passed_s / metrics.quantile(passed_s, 0.5), 1.0)
    around = np.maximum(np.append(steps[1:], 0.0), np.insert(steps[:-1], 0, 0.0))
    alone = np.flatnonzero(steps > _JUMP_RATIO * around)
    if not len(alone):
        return
    moving = steps[steps > 0]
    usual = max(metrics.quantile(moving, 0.99), float(np.min(moving)))
    jumps = alone[steps[alone] > _JUMP_RATIO * usual]
    if len(jumps):
        row = rows[jumps[0] + 1]
        raise DataError(
            f"{where}, row {row}: jumps by {distances[jumps[0]]:.4g} in one sample "
            f"({usual:.2g} is usual)",
            "check encoder and cable for lost counts; cut the file there",
        )


# Whether the arrays of a recording are what every computation takes for granted.
#
# A file's columns pass these checks when they are read. A recording that a program makes in memory
# passes them where it is first used, in a few passes over each array.

MINIMUM_SAMPLES: Final = 200
"""Twice the points that every signal is subsampled to."""
_POSITION_UNITS: Final = contract_columns.QUANTITIES["position"]
_EFFORT_UNITS: Final = tuple(
    contract_columns.UNITS[contract_columns.QUANTITIES[quantity][0]]
    for quantity in contract_columns.EFFORTS
)


def check_arrays(recording: Recording) -> None:
    """Check form, numbers, and the order of time.

    Raises
    ------
    DataError
        As of `check_form`; something is no vector of floating-point numbers; there are too few; a
        number is not finite; time goes back.
    """
    source, time_s = recording.source, recording.time_s
    rows = range(len(time_s))
    for axis in recording.axes.values():
        check_type(axis, AxisRecord, "give an AxisRecord for each axis")
    _check_vector(f"{source}, time_s", time_s)
    for name, axis in recording.axes.items():
        for quantity, values in _signals(axis):
            _check_vector(f"{source}, axis {name}, {quantity}", values)
    check_form(recording)
    check_length(source, time_s)
    check_finite(source, "time_s", time_s, rows)
    check_increasing(source, "time_s", time_s, rows)
    for name, axis in recording.axes.items():
        for quantity, values in _signals(axis):
            check_finite(source, f"axis {name}, {quantity}", values, rows)


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


def check_finite(source: str, what: str, values: Array, rows: contract_columns.Rows) -> None:
    """Check that every value is a number, and one that a machine has: its square is one, too.

    Parameters
    ----------
    source, what : str
        File and column, for messages.
    values : (N,) array
    rows : range or (N,) array of int
        Row of the file that holds each value.

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
            f"{source}, row {rows[bad[0]]}, {what}: {said} ({len(bad)} in all)",
            "remove these rows; uneven sampling is allowed",
        )


def check_increasing(source: str, what: str, time_s: Array, rows: contract_columns.Rows) -> None:
    """Check that time goes on from every sample to the next; parameters as of `check_finite`.

    Raises
    ------
    DataError
    """
    back = np.flatnonzero(np.diff(time_s) <= 0)
    if len(back):
        row = rows[back[0] + 1]
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


# Which axes of a recording move, and which rest.

MINIMUM_COUNTS: Final = 50
"""Travel, in encoder counts, below which a motion cannot be told from quantization."""
MINIMUM_NOISES: Final = 20.0
"""Travel, in standard deviations of white position noise, below which there is no motion."""


def resting_as_passive(recording: Recording) -> Recording:
    """A recording whose axes at rest are passive, where another one moves.

    Friction holds an axis at rest against any effort up to its level, so its effort tells nothing.
    Its position does: nothing comes from there. An axis that was told to move is kept: a check then
    says that it did not.
    """
    passive = {
        name: PassiveAxis(axis.position, axis.position_unit)
        for name, axis in recording.axes.items()
        if _rests(axis)
    }
    axes = {name: axis for name, axis in recording.axes.items() if name not in passive}
    if not axes:
        return recording
    return replace(recording, axes=axes, passive={**recording.passive, **passive})


def _rests(axis: AxisRecord) -> bool:
    if axis.reference is not None and np.ptp(axis.reference) > 0.0:
        return False
    return not moves(axis.position) or only_noise(axis.position)


def moves(position: NDArray[np.float64]) -> bool:
    """Whether a position (N,) goes through enough counts of its encoder."""
    steps = np.abs(np.diff(position))
    count = np.min(steps, initial=np.inf, where=steps > 1e-9 * np.ptp(position))
    return bool(np.isfinite(count) and np.ptp(position) >= MINIMUM_COUNTS * count)


def only_noise(position: NDArray[np.float64]) -> bool:
    """Whether a position (N,) goes no farther than its noise."""
    return bool(np.ptp(position) < MINIMUM_NOISES * conditioning.position_noise(position))
