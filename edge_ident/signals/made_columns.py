"""Columns that a file does not hold as a recording needs them: on one clock, with a position."""

import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from edge_ident.errors import DataError
from edge_ident.files.table import Column, Series, Table, merged, without_repetition
from edge_ident.files.units import known_unit
from edge_ident.signals.conditioning import Array, condition, encoder_count, unit_length
from edge_ident.signals.contract_columns import EFFORTS, TIME, Rows, parse_name
from edge_ident.signals.filters import Mask, lowpass
from edge_ident.signals.metrics import quantile
from edge_ident.signals.read_columns import is_time
from edge_ident.signals.time_stamps import EvenGrid, interpolated
from edge_ident.signals.timing import vertex
from edge_ident.support.words import listed

# Columns of several clocks, or with empty cells, on the one clock of a recording.
#
# A table is sparse where several rates stand in it, where channels have a time each, where joints
# are sent apart, or where a cell is empty. All of these are the same: each column has stamps of its
# own.


# Share of the rows of the densest column that all others are in, from which they have one clock,
# and what is missing is missing.
_ONE_CLOCK: Final = 0.9
# Rate of a column over that of the clock, from which what the clock cannot hold is taken out.
_FASTER: Final = 2.0
_BAND: Final = 0.4  # of the clock's rate, that is kept of a faster column
_FEWEST: Final = 4  # samples that are interpolated between


@dataclass(frozen=True)
class OneClock:
    """Columns on one clock.

    Attributes
    ----------
    columns : mapping of name to (N,) array
    said : tuple of str
        What was done, one line each.
    rows : range or (N,) array of int
        Row of the file that holds each sample; counted from 0 where none does.
    """

    columns: Mapping[str, Array]
    said: tuple[str, ...]
    rows: Rows


def on_one_clock(
    columns: Mapping[str, Array],
    sparse: Collection[str],
    rows: Rows,
    effort_shift_s: float = 0.0,
) -> OneClock:
    """Bring columns to one clock: that of the slowest position or effort.

    Parameters
    ----------
    columns : mapping of name in the contract to (N,) array
    sparse : collection of str
        Columns in which NaN stands where they were not sampled.
    rows : range or (N,) array of int
        Row of the file that holds each sample.
    effort_shift_s : float
        Time from a row's stamp to when its effort acted.

    Raises
    ------
    DataError
        The columns have no time in common.
    """
    if TIME not in columns:
        return OneClock(columns, (), rows)
    if repeated := _repeated(columns):
        once = {name: values[~repeated[0]] for name, values in columns.items()}
        made = on_one_clock(once, sparse, np.array(rows)[~repeated[0]], effort_shift_s)
        return replace(made, said=(repeated[1], *made.said))
    if not (sparse or effort_shift_s):
        return OneClock(columns, (), rows)
    known = {
        name: ~np.isnan(values) if name in sparse else np.ones(len(values), np.bool_)
        for name, values in columns.items()
    }
    leading = [n for n in columns if (parse_name(n) or ("", ""))[1] in ("position", *EFFORTS)]
    leading = leading or [n for n in columns if n != TIME]
    complete = np.logical_and.reduce([known[n] for n in (TIME, *leading)])
    most = max(int(np.count_nonzero(known[n] & known[TIME])) for n in leading)
    one = np.count_nonzero(complete) >= _ONE_CLOCK * most
    ordered = bool(np.all(np.diff(columns[TIME][known[TIME]]) > 0.0))
    if (one and not effort_shift_s) or not ordered:
        return _without_holes(columns, known, complete, rows)
    return _resampled(columns, known, leading, effort_shift_s)


def _repeated(columns: Mapping[str, Array]) -> tuple[Mask, str] | None:
    """Rows that repeat the one before in every column, and what is said of them; None where a time
    stands there again beside other values."""
    again = np.diff(columns[TIME], prepend=np.nan) == 0.0
    if not np.any(again):
        return None
    rows = np.flatnonzero(again)
    for values in columns.values():
        here, before = values[rows], values[rows - 1]
        if not np.all((here == before) | (np.isnan(here) & np.isnan(before))):
            return None
    return again, f"{len(rows)} rows repeat the row before: left out"


def _without_holes(
    columns: Mapping[str, Array], known: Mapping[str, Mask], complete: Mask, rows: Rows
) -> OneClock:
    """Rows in which position, effort and time are known; what else is missing is interpolated."""
    time = columns[TIME]
    made = {name: values[complete] for name, values in columns.items()}
    for name, values in columns.items():
        here = known[name] & known[TIME]
        if not known[name][complete].all() and np.any(here):
            made[name] = np.interp(time[complete], time[here], values[here])
    missing = np.flatnonzero(~complete)
    if not len(missing) or not len(made[TIME]):
        return OneClock(made, (), rows)
    where = f", the first in row {rows[missing[0]]}" if rows[0] else ""
    what = "row has" if len(missing) == 1 else "rows have"
    said = f"{len(missing)} {what} an empty cell{where}: left out"
    return OneClock(made, (said,), np.array(rows)[complete])


def _resampled(
    columns: Mapping[str, Array],
    known: Mapping[str, Mask],
    leading: Sequence[str],
    effort_shift_s: float,
) -> OneClock:
    stamps = {n: columns[TIME][known[n] & known[TIME]] for n in columns}
    for name in columns:
        if (parse_name(name) or ("", ""))[1] in EFFORTS:
            stamps[name] = stamps[name] + effort_shift_s
    few = [name for name in columns if len(stamps[name]) < _FEWEST]
    lacking = [name for name in leading if name in few]
    first = max((stamps[n][0] for n in leading if n not in few), default=0.0)
    last = min((stamps[n][-1] for n in leading if n not in few), default=0.0)
    if lacking or first >= last:
        raise DataError(
            f"{listed(leading)} have no time in common",
            "export them from one recording; an axis may be left out with --axis",
        )
    periods = {n: quantile(np.diff(stamps[n]), 0.5) for n in columns if n not in few}
    clock = max(leading, key=lambda n: periods[n])
    at = stamps[clock]
    at = at[(at >= first) & (at <= last)]
    made = {TIME: at}
    for name, values in columns.items():
        if name != TIME and name not in few:
            here = known[name] & known[TIME]
            made[name] = _at(at, stamps[name], values[here], periods[name], periods[clock])
    rates = listed(f"{n} every {1e3 * periods[n]:.4g} ms" for n in leading)
    said = f"several clocks ({rates}): all are brought to that of {clock}"
    if effort_shift_s:
        side = "after" if effort_shift_s > 0.0 else "before"
        said = f"the effort is taken {abs(effort_shift_s):g} s {side} its row"
    return OneClock(made, (said,), range(len(at)))


def _at(at: Array, stamps: Array, values: Array, period_s: float, clock_s: float) -> Array:
    """A series (N,) at other times (M,)."""
    place = np.clip(np.searchsorted(stamps, at), 0, len(stamps) - 1)
    faster = clock_s / period_s
    if faster < _FASTER and np.array_equal(stamps[place], at):
        return values[place]
    if faster >= _FASTER and EvenGrid.of(stamps).jitter < 1.0:
        values = lowpass(values, _BAND / clock_s, period_s)
    return interpolated(at, stamps, values)


def with_own_clocks(table: Table) -> Table:
    """A table whose channels have a time each as one whose rows are the stamps of all of them.

    A column of time is the clock of those behind it, up to the next. Columns of time that are of
    one length and differ in name, such as when a message was sent and when it came, are no clocks.
    """
    columns = table.columns
    clocks = [i for i, column in enumerate(columns) if _is_time(column)]
    times = [columns[i] for i in clocks]
    if len(clocks) < 2 or clocks[0] or np.min(np.diff(clocks)) < 2 or not _differ(times):
        return table
    series = [
        _series(columns[i], column)
        for i, end in zip(clocks, [*clocks[1:], len(columns)], strict=True)
        for column in columns[i + 1 : end]
    ]
    series = [each for each in series if len(each.stamps)]
    if not series:
        return table
    made = merged(series, times[0].heading, times[0].unit)
    how = ", ".join(filter(None, (table.how, f"{len(clocks)} columns of time")))
    return replace(table, columns=made, how=how, first_row=0)


def _is_time(column: Column) -> bool:
    unit = None if column.unit is None else known_unit(column.unit)
    return is_time(without_repetition(column.name), None if unit is None else unit.base)


def _differ(times: Sequence[Column]) -> bool:
    """Whether columns of time are clocks of their own, in one unit."""
    alike = len({without_repetition(time.heading) for time in times}) == 1
    lengths = {int(np.count_nonzero(~np.isnan(time.values))) for time in times}
    first = times[0].values
    same = all(np.array_equal(time.values, first, equal_nan=True) for time in times)
    return not same and (alike or len(lengths) > 1) and len({time.unit for time in times}) == 1


def _series(clock: Column, column: Column) -> Series:
    here = ~np.isnan(clock.values) & ~np.isnan(column.values)
    return Series(column.heading, column.unit, clock.values[here], column.values[here])


# The position of an axis of which only the speed was recorded.


# Of the highest speed, up to which an axis may stand: more than the drift of a tachometer.
_STANDS: Final = 0.02
_LONG: Final = 20  # samples of a standstill
_REACH: Final = 0.05  # of the highest speed, up to which a zero is looked for by the friction
_TRIED: Final = 21
_MOST: Final = 1 << 15  # samples by which it is looked for
_CERTAIN: Final = 3.0  # standard deviations from which a zero is off: the usual three-sigma rule
_TINY: Final = float(np.finfo(float).tiny)


def with_integrated_speed(columns: Mapping[str, Array]) -> tuple[dict[str, Array], list[str]]:
    """Add the position of each axis that has an effort and a speed, and no position.

    The zero of a speed drifts, and the position with it. It shows where the axis stands, against a
    reference, and by the speed at which dry friction changes its direction. Elsewhere nothing tells
    it from a motion.

    Parameters
    ----------
    columns : mapping of name in the contract to (N,) array

    Returns
    -------
    columns : dict
    said : list of str
        What was done, one line for each axis.
    """
    made, said = dict(columns), []
    parsed = {name: parse_name(name) or ("", "", "") for name in columns}
    held = {(axis, quantity) for axis, quantity, _ in parsed.values()}
    for name, (axis, quantity, unit) in parsed.items():
        driven = any((axis, effort) in held for effort in EFFORTS)
        if (
            quantity != "velocity"
            or not driven
            or (axis, "position") in held
            or TIME not in columns
        ):
            continue
        length = unit.removesuffix("_s")
        speed, time_s = columns[name], columns[TIME]
        reference = columns.get(f"{axis}_reference_{length}")
        effort = next(columns[n] for n, p in parsed.items() if p[0] == axis and p[1] in EFFORTS)
        zero, because = _zero(time_s, speed, reference, effort)
        position = _integral(time_s, speed - zero)
        position += 0.0 if reference is None else float(reference[0])
        made[f"{axis}_position_{length}"] = position
        drift = "no drift of its zero shows, and none was removed"
        if because:
            drift = f"the drift of its zero, {zero:.3g} {length}/s, was removed ({because})"
        said.append(f"the position of {axis} is the integral of its speed; {drift}")
    return made, said


def _zero(time_s: Array, speed: Array, reference: Array | None, effort: Array) -> tuple[float, str]:
    """What a speed (N,) reads at rest, and how that shows; nothing where it does not."""
    if len(speed) < _LONG or not np.all(np.diff(time_s) > 0.0):
        return 0.0, ""
    if reference is not None:
        slope = np.polyfit(time_s - time_s[0], _integral(time_s, speed) - reference, 1)[0]
        return float(slope), "the position then follows its reference"
    around = np.convolve(np.abs(speed) > _STANDS * np.max(np.abs(speed)), np.ones(_LONG), "same")
    if np.count_nonzero(around == 0.0) >= _LONG:
        return float(np.mean(speed[around == 0.0])), "what it reads where the axis stands"
    zero, std = _zero_of_friction(time_s[:_MOST], speed[:_MOST], effort[:_MOST])
    if abs(zero) > _CERTAIN * std:
        return zero, "there dry friction changes its direction"
    return 0.0, ""


def _zero_of_friction(time_s: Array, speed: Array, effort: Array) -> tuple[float, float]:
    """The zero with which the base model leaves least of an effort (N,), with its deviation."""
    zeros = _REACH * float(np.max(np.abs(speed))) * np.linspace(-1.0, 1.0, _TRIED)
    left, independent = np.empty(_TRIED), 0.0
    for i, zero in enumerate(zeros):
        signals = condition(time_s, _integral(time_s, speed - zero), effort)
        columns, _ = unit_length(signals.regressor)
        fitted = columns @ np.linalg.lstsq(columns, signals.effort, rcond=None)[0]
        left[i] = np.sum((signals.effort - fitted) ** 2)
        independent = 2.0 * signals.cutoff_hz * signals.period_s * len(columns)
    best, step = int(np.argmin(left)), zeros[1] - zeros[0]
    if not 0 < best < _TRIED - 1:
        return 0.0, np.inf
    place, bend = vertex(left[best - 1 : best + 2].tolist())
    std = step * np.sqrt(2.0 * left[best] / (independent * max(bend, _TINY)))
    return float(zeros[best] + step * place), float(std)


def _integral(time_s: Array, speed: Array) -> Array:
    """From zero, by the trapezoidal rule."""
    steps = 0.5 * (speed[1:] + speed[:-1]) * np.diff(time_s)
    return np.concatenate([[0.0], np.cumsum(steps)])


# A position that starts again after a turn, or where its counter is full.

# Share of the samples in which a position may start again: an axis goes on in between.
_MOST_TURNS: Final = 0.05
# Of all values' extent, up to which the other steps are short beside a turn.
_SHORT_STEP: Final = 0.2
# Of how closely a turn is seen, from which the smallest step is a count, and not what is printed.
_COUNT: Final = 0.1


def unwrapped(position: Array, unit: str) -> tuple[Array, float, int]:
    """A position (N,) in rad or m that starts again after a turn, or where its counter is full, as
    if it went on.

    The steps at which it starts again are all of one size, beside what the axis goes meanwhile,
    and no value lies farther from another than that. Lost counts and spikes are not so.

    Returns
    -------
    position : (N,) array
        The same array where it never starts again.
    turn : float
        After which it does; 0 where it never does.
    count : int
        How often.
    """
    if len(position) < 3:
        return position, 0.0, 0
    steps, extent = np.diff(position), float(np.ptp(position))
    far = np.flatnonzero(np.abs(steps) > 0.5 * extent)
    if not len(far) or len(far) > _MOST_TURNS * len(steps) or np.any(np.diff(far) == 1):
        return position, 0.0, 0
    others = np.delete(steps, far)
    usual = float(np.max(np.abs(others), initial=0.0))
    beside = [np.clip(far + side, 0, len(steps) - 1) for side in (-1, 1)]
    going = np.mean([np.where(np.isin(at, far), 0.0, steps[at]) for at in beside], axis=0)
    sizes = np.abs(steps[far] - going)
    turn = float(np.median(sizes))
    off = float(np.max(np.abs(sizes - turn)))
    if (
        usual > _SHORT_STEP * extent
        or off > usual
        or not turn - 2.0 * usual <= extent <= turn + off
    ):
        return position, 0.0, 0
    within = max(off, float(np.quantile(np.abs(np.diff(others)), 0.99)))
    turn = _whole_turn(turn, within, encoder_count(position), unit)
    turns = np.zeros(len(position))
    turns[far + 1] = -np.sign(steps[far])
    return position + turn * np.cumsum(turns), turn, len(far)


def _whole_turn(turn: float, within: float, count: float, unit: str) -> float:
    """What a turn is that is known to a distance: whole turns, a power of two of counts, counts."""
    whole = 2.0 * math.pi * max(1, round(turn / (2.0 * math.pi)))
    if unit == "rad" and abs(whole - turn) <= within + count:
        return whole
    if count <= _COUNT * within:
        return turn
    full = count * 2.0 ** round(math.log2(turn / count))
    return full if abs(full - turn) <= within + count else count * round(turn / count)
