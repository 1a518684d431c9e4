"""Recordings: both formats, and each kind of bad file with its row, column and next step."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from edge_ident.errors import DataError
from edge_ident.signals.recording_files import load_recording, save_recording
from tests.measured import MeasuredData

Columns = dict[str, np.ndarray]


def columns(samples: int = 400) -> Columns:
    time = 0.01 * np.arange(samples)
    return {
        "time_s": time,
        "x_position_rad": np.round(2000 * np.sin(2 * time)) / 2000,
        "x_torque_nm": np.cos(2 * time),
    }


def write(path: Path, table: Columns, comment: str = "") -> Path:
    rows = np.column_stack(list(table.values()))
    text = "\n".join(",".join(f"{value:.12g}" for value in row) for row in rows)
    path.write_text(comment + ",".join(table) + "\n" + text + "\n")
    return path


def test_comments_and_unknown_columns_are_accepted(tmp_path: Path) -> None:
    table = columns() | {"note": np.zeros(400)}
    recording = load_recording(write(tmp_path / "a.csv", table, "# made, by hand\n"))
    assert list(recording.axes) == ["x"]
    assert recording.axes["x"].parameter_units == ("kg*m^2", "N*m*s/rad", "N*m", "N*m")


@pytest.mark.parametrize("suffix", [".npz", ".csv"])
def test_round_trip(tmp_path: Path, suffix: str) -> None:
    table = columns()
    table["x_reference_rad"] = table["x_position_rad"] + 0.01
    table["q_position_m"] = 1e-3 * table["x_position_rad"]
    table["q_current_a"] = table["x_torque_nm"]
    comment = "# effort_shift_s=0.00175\n"
    recording = load_recording(write(tmp_path / "a.csv", table, comment))
    path = tmp_path / f"b{suffix}"
    save_recording(recording, path)
    again = load_recording(path)
    assert again.effort_shift_s == 0.00175
    assert again.axes["q"].parameter_units == ("A*s^2/m", "A*s/m", "A", "A")
    for name, axis in recording.axes.items():
        np.testing.assert_allclose(again.axes[name].position, axis.position, rtol=1e-11)
        np.testing.assert_allclose(again.axes[name].effort, axis.effort, rtol=1e-11)
    assert again.axes["x"].reference is not None
    assert again.axes["q"].reference is None


def test_files_from_a_spreadsheet_are_read(tmp_path: Path) -> None:
    path = write(tmp_path / "a.csv", columns())
    text = path.read_text().replace("\n", "\r\n")
    path.write_bytes(b"\xef\xbb\xbf" + text.encode())
    assert list(load_recording(path).axes) == ["x"]


def test_foreign_column_names_are_renamed(tmp_path: Path) -> None:
    table = columns()
    table = {"t": table["time_s"], "pos": table["x_position_rad"], "tau": table["x_torque_nm"]}
    path = write(tmp_path / "a.csv", table)
    renames = {"t": "time_s", "pos": "y_position_rad", "tau": "y_torque_nm"}
    assert list(load_recording(path, renames).axes) == ["y"]
    with pytest.raises(DataError, match="no column velocity to rename"):
        load_recording(path, {"velocity": "y_velocity_rad_s"})


NOISE = np.random.default_rng(8).normal(size=400)


def drop(name: str) -> Callable[[Columns], Columns]:
    return lambda table: {key: values for key, values in table.items() if key != name}


def change(name: str, row: int | slice, value: float | np.ndarray) -> Callable[[Columns], Columns]:
    def apply(table: Columns) -> Columns:
        table[name][row] = value
        return table

    return apply


def offset(row: int, value: float) -> Callable[[Columns], Columns]:
    def apply(table: Columns) -> Columns:
        table["x_position_rad"][row:] += value
        return table

    return apply


@pytest.mark.parametrize(
    ("spoil", "message"),
    [
        (drop("time_s"), "column time_s is missing"),
        (drop("x_torque_nm"), "axis x has no effort column"),
        (drop("x_position_rad"), "axis x has no position column"),
        (change("x_torque_nm", 7, np.nan), r"row 9, column x_torque_nm: not a finite number"),
        (change("time_s", 30, 0.1), r"row 32, column time_s: time goes from 0.29 to 0.1 s"),
        (change("time_s", 30, 0.29), r"row 32, column time_s: time goes from 0.29 to 0.29 s"),
        (change("x_position_rad", slice(None), 1.0), "no motion"),
        (change("x_position_rad", slice(None), NOISE), "only noise"),
        (change("x_position_rad", slice(250, None), 0.3), r"stuck from row 252 to row 401"),
        (offset(200, 3.0), r"row 202: jumps by"),
        (lambda table: {k: v[:50] for k, v in table.items()}, "50 samples are not enough"),
    ],
)
def test_bad_data_names_the_place(
    tmp_path: Path, spoil: Callable[[Columns], Columns], message: str
) -> None:
    path = write(tmp_path / "bad.csv", spoil(columns()))
    with pytest.raises(DataError, match=message) as error:
        load_recording(path)
    assert "bad.csv" in error.value.cause
    assert error.value.next_step


def test_text_in_a_cell_names_row_and_column(tmp_path: Path) -> None:
    path = write(tmp_path / "a.csv", columns(300))
    lines = path.read_text().splitlines()
    lines[40] = lines[40].replace(",", ",oops", 1)
    path.write_text("\n".join(lines))
    with pytest.raises(DataError, match=r"row 41, column x_position_rad: 'oops.*not a number"):
        load_recording(path)
    lines[40] = "1,2"
    path.write_text("\n".join(lines))
    with pytest.raises(DataError, match="row 41: 2 values but 3 column names"):
        load_recording(path)


def test_missing_empty_and_foreign_files(tmp_path: Path) -> None:
    with pytest.raises(DataError, match="no such file"):
        load_recording(tmp_path / "absent.csv")
    (tmp_path / "empty.csv").write_text("")
    with pytest.raises(DataError, match="the file is empty"):
        load_recording(tmp_path / "empty.csv")
    (tmp_path / "text.npz").write_text("not an archive")
    with pytest.raises(DataError, match="not a readable"):
        load_recording(tmp_path / "text.npz")


@pytest.mark.parametrize(
    ("file", "units"),
    [
        ("emps_train.csv", {"q": "N"}),
        ("laas_motor_speed.csv", {"m": "A"}),
        ("double_pendulum_154220.csv", {"j1": "N*m", "j2": "N*m"}),
    ],
)
def test_real_recordings_pass_the_checks(
    measured_data: MeasuredData, file: str, units: dict[str, str]
) -> None:
    axes = load_recording(measured_data / file).axes
    assert {name: axis.effort_unit for name, axis in axes.items()} == units
