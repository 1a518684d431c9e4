"""Rates, stamps and empty cells of one file on one clock; names beside or above their values."""

from collections.abc import Iterable
from datetime import datetime, timedelta
from pathlib import Path

import numpy as np
import openpyxl
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from numpy.typing import NDArray

import edge_ident
from edge_ident.errors import DataError

Array = NDArray[np.float64]

TIME_S = 0.001 * np.arange(3000)
BEGIN = datetime(2026, 11, 28, 23, 59, 58)


def position(time_s: Array) -> Array:
    return np.asarray(0.8 * np.sin(6.9 * time_s) + 0.3 * np.sin(20.7 * time_s + 1.0))


def effort(time_s: Array) -> Array:
    return np.asarray(2.0 * np.cos(6.9 * time_s) + 1.5 * np.sin(20.7 * time_s))


def lines(*columns: Iterable[str], separator: str = ",") -> str:
    return "".join(separator.join(row) + "\n" for row in zip(*columns, strict=True))


def text(values: Array, form: str = ".6f", *, comma: bool = False) -> list[str]:
    made = [format(value, form) for value in values]
    return [cell.replace(".", ",") for cell in made] if comma else made


def check(path: Path, period_s: float, options: edge_ident.ReadOptions | None = None) -> None:
    """Position and effort are those of their time, on a clock of this period."""
    recording = edge_ident.load_recording(path, options=options)
    axis, time_s = recording.axes["x"], recording.time_s - recording.time_s[0]
    assert np.median(np.diff(time_s)) == pytest.approx(period_s, rel=1e-3)
    inside = slice(60, -60)
    begin_s = BEGINS.get(path.name, 0.0)
    for found, true in ((axis.position, position), (axis.effort, effort)):
        assert np.max(np.abs(found - true(begin_s + time_s))[inside]) < 0.02


BEGINS = {"apart.csv": 3e-4, "long.csv": 2e-4}
"""Where the first row of the clock is not that of the file."""


def test_channels_of_two_rates_as_twincat_exports_them(tmp_path: Path) -> None:
    slow = TIME_S[::4]
    head = [
        ["Name", "X.ActPos", "Name", "X.ActTorque"],
        ["SampleTime[ms]", "1", "SampleTime[ms]", "4"],
        ["Unit", "rad", "Unit", "Nm"],
    ]
    cells = [text(1e3 * TIME_S), text(position(TIME_S)), text(1e3 * slow), text(effort(slow))]
    padded = [column + [""] * (len(TIME_S) - len(column)) for column in cells]
    path = tmp_path / "scope.csv"
    path.write_text(
        "".join("\t".join(row) + "\n" for row in head) + "\n" + lines(*padded, separator="\t")
    )
    check(path, 0.004)
    (said,) = edge_ident.inspect_recording(path).done
    assert "x_position_rad every 1 ms and x_torque_nm every 4 ms" in said


def test_channels_that_share_no_stamp(tmp_path: Path) -> None:
    """As a plotter exports two topics: each row has a value of one of them."""
    slow = TIME_S[::2] + 3e-4
    rows = [(t, f"{p:.6f}", "") for t, p in zip(TIME_S, position(TIME_S), strict=True)]
    rows += [(t, "", f"{u:.6f}") for t, u in zip(slow, effort(slow), strict=True)]
    path = tmp_path / "apart.csv"
    path.write_text(
        "time_s,x_position_rad,x_torque_nm\n"
        + "".join(f"{t:.6f},{p},{u}\n" for t, p, u in sorted(rows))
    )
    check(path, 0.002)


def test_a_table_for_each_variable_as_codesys_writes_them(tmp_path: Path) -> None:
    parts = []
    for name, unit, values in (("fActPosition", "rad", position), ("fActTorque", "Nm", effort)):
        parts.append(f"Variable;PLC_PRG.X.{name}\nUnit;{unit}\nTimestamp [ms];Value\n")
        stamps = text(1e3 * TIME_S, comma=True)
        parts.append(lines(stamps, text(values(TIME_S), comma=True), separator=";") + "\n")
    path = tmp_path / "trace.csv"
    path.write_text("Trace;Trace1\n\n" + "".join(parts))
    check(path, 0.001)


def test_a_name_before_each_value_as_halscope_writes(tmp_path: Path) -> None:
    """With one row more than it has samples, whose values are those of an older recording."""
    head = "Sampling period is 1000000 nSec \n\n"
    made = [f"x.pos-fb {p:+.14f} x.torque {u:+.14f} \n"
            for p, u in zip(position(TIME_S), effort(TIME_S), strict=True)]  # fmt: skip
    path = tmp_path / "hal.log"
    path.write_text((head + "".join(made) + "x.pos-fb +9.9 x.torque +0.0 \n").replace(".", ","))
    path.write_text(path.read_text().replace("x,", "x."))
    said = edge_ident.ReadOptions(units={"x.pos-fb": "rad", "x.torque": "Nm"})
    assert edge_ident.inspect_recording(path).rows == len(TIME_S)
    check(path, 0.001, said)


def test_a_value_in_each_row(tmp_path: Path) -> None:
    made = [
        f"{1e3 * t:.3f};x.position [rad];{p:.6f}\n{1e3 * t + 0.2:.3f};x.torque [Nm];{u:.6f}\n"
        for t, p, u in zip(TIME_S, position(TIME_S), effort(TIME_S + 2e-4), strict=True)
    ]
    path = tmp_path / "long.csv"
    path.write_text("timestamp;name;value\n" + "".join(made))
    recording = edge_ident.load_recording(path)
    axis, time_s = recording.axes["x"], recording.time_s
    assert np.max(np.abs(axis.effort - effort(time_s))[5:-5]) < 0.02
    assert np.max(np.abs(axis.position - position(time_s))[5:-5]) < 0.02


@pytest.mark.parametrize(
    ("form", "delimiter"),
    [("%Y-%m-%dT%H:%M:%S.%fZ", ","), ("%d.%m.%Y %H:%M:%S,%f", ";"), ("%H:%M:%S.%f", ",")],
    ids=["ISO 8601", "German", "past midnight"],
)
def test_times_of_day_become_seconds(form: str, delimiter: str, tmp_path: Path) -> None:
    stamps = [(BEGIN + timedelta(seconds=t)).strftime(form) for t in TIME_S.tolist()]
    comma = delimiter == ";"
    columns = text(position(TIME_S), comma=comma), text(effort(TIME_S), comma=comma)
    path = tmp_path / "log.csv"
    path.write_text(
        delimiter.join(["timestamp", "position [rad]", "torque [Nm]"]) + "\n"
        + lines(stamps, *columns, separator=delimiter)
    )  # fmt: skip
    check(path, 0.001)
    assert "timestamp in seconds from the first" in edge_ident.inspect_recording(path).how


@pytest.mark.parametrize(
    ("rows", "first"), [([0], 2), ([0, 1], 2), ([500], 502), ([2999], 3001), ([10, 800], 12)]
)
@pytest.mark.parametrize("blank", ["", "-", "n/a"])
def test_rows_with_empty_cells_are_left_out_and_counted(
    rows: list[int], first: int, blank: str, tmp_path: Path
) -> None:
    cells = [text(TIME_S), text(position(TIME_S)), text(effort(TIME_S))]
    for row in rows:
        cells[1][row] = cells[2][row] = blank
    path = tmp_path / "blank.csv"
    path.write_text("time_s,x_position_rad,x_torque_nm\n" + lines(*cells))
    found = edge_ident.inspect_recording(path)
    were = "row has" if len(rows) == 1 else "rows have"
    assert found.done == (f"{len(rows)} {were} an empty cell, the first in row {first}: left out",)
    assert len(found.recording().time_s) == len(TIME_S) - len(rows)


@pytest.mark.parametrize("empty", [0, 20, 60])
def test_a_bad_value_beside_an_empty_cell_is_refused_by_its_row(empty: int, tmp_path: Path) -> None:
    cells = [text(TIME_S), text(position(TIME_S)), text(effort(TIME_S))]
    cells[1][empty], cells[2][40] = "", "nan"
    path = tmp_path / "blank.csv"
    path.write_text("time_s,x_position_rad,x_torque_nm\n" + lines(*cells))
    with pytest.raises(DataError, match="row 42, column x_torque_nm: not a finite number"):
        edge_ident.load_recording(path)


def test_an_effort_that_acted_later_is_taken_later(tmp_path: Path) -> None:
    cells = [text(TIME_S), text(position(TIME_S)), text(effort(TIME_S + 0.1))]
    path = tmp_path / "late.csv"
    path.write_text("time_s,x_position_rad,x_torque_nm\n" + lines(*cells))
    recording = edge_ident.load_recording(path, options=edge_ident.ReadOptions(effort_shift_s=0.1))
    error = recording.axes["x"].effort - effort(recording.time_s)
    assert np.max(np.abs(error)) < 1e-3


def test_an_xml_trace_is_named(tmp_path: Path) -> None:
    path = tmp_path / "axis.trace"
    path.write_text('<?xml version="1.0"?>\n<Trace><Value>1,2</Value></Trace>\n')
    with pytest.raises(DataError, match="XML"):
        edge_ident.load_recording(path)


@pytest.mark.parametrize(
    "head",
    [
        "Time_pos [s],Position [rad],Time_torque [s],Torque [Nm]\n",
        "Time [s],Position [rad],Time [s],Torque [Nm]\n",
    ],
)
def test_channels_with_a_time_each_side_by_side(head: str, tmp_path: Path) -> None:
    slow = TIME_S[::2]
    cells = [text(TIME_S), text(position(TIME_S)), text(slow), text(effort(slow))]
    padded = [column + [""] * (len(TIME_S) - len(column)) for column in cells]
    path = tmp_path / "side.csv"
    path.write_text(head + lines(*padded))
    check(path, 0.002)


def test_empty_cells_and_dates_of_a_spreadsheet(tmp_path: Path) -> None:
    book = openpyxl.Workbook()
    book.active.append(["timestamp", "position [rad]", "torque [Nm]"])
    for k, t in enumerate(TIME_S[:600].tolist()):
        values = [None, None] if k == 7 else [float(position(t)), float(effort(t))]
        book.active.append([BEGIN + timedelta(seconds=t), *values])
    path = tmp_path / "book.xlsx"
    book.save(path)
    found = edge_ident.inspect_recording(path)
    assert found.done == ("1 row has an empty cell, the first in row 9: left out",)
    recording = found.recording()
    assert np.max(np.abs(recording.axes["x"].position - position(recording.time_s))) < 0.02


def test_the_first_sheet_that_holds_a_table_is_read(tmp_path: Path) -> None:
    book = openpyxl.Workbook()
    book.active.append(["Prüfer", "A. Person"])
    table = book.create_sheet("data")
    table.append(["time_s", "x_position_rad", "x_torque_nm"])
    for t in TIME_S[:600].tolist():
        table.append([t, float(position(t)), float(effort(t))])
    path = tmp_path / "book.xlsx"
    book.save(path)
    assert len(edge_ident.load_recording(path).time_s) == 600
    table.delete_cols(2, 2)
    book.save(path)
    with pytest.raises(DataError, match="sheet Sheet"):
        edge_ident.load_recording(path)


def test_null_in_parquet_is_an_empty_cell(tmp_path: Path) -> None:
    path = tmp_path / "a.parquet"
    held = [None if k == 3 else v for k, v in enumerate(effort(TIME_S).tolist())]
    columns = {"time_s": TIME_S, "x_position_rad": position(TIME_S), "x_torque_nm": held}
    pq.write_table(pa.table(columns), path)
    assert edge_ident.inspect_recording(path).done == ("1 row has an empty cell: left out",)
    check(path, 0.001)


def test_rows_that_are_written_twice_count_once(tmp_path: Path) -> None:
    path = tmp_path / "twice.csv"
    each = [text(values) for values in (TIME_S, position(TIME_S), effort(TIME_S))]
    rows = lines(*(np.repeat(column, 2) for column in each))
    path.write_text("time_s,x_position_rad,x_torque_nm\n" + rows, encoding="utf-8")
    found = edge_ident.inspect_recording(path)
    assert found.done == ("3000 rows repeat the row before: left out",)
    np.testing.assert_allclose(found.recording().time_s, TIME_S, atol=1e-9)


def test_a_time_that_stands_twice_beside_other_values_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "twice.csv"
    rows = lines(
        *(text(v) for v in (np.floor(500.0 * TIME_S) / 500.0, position(TIME_S), effort(TIME_S)))
    )
    path.write_text("time_s,x_position_rad,x_torque_nm\n" + rows, encoding="utf-8")
    with pytest.raises(DataError, match="time goes from 0 to 0 s"):
        edge_ident.load_recording(path)
