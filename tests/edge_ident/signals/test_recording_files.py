"""Recordings: both formats, and each kind of bad file with its row, column and next step."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from edge_ident.errors import DataError
from edge_ident.signals.read_columns import ReadOptions
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


def test_seconds_since_1970_are_kept(tmp_path: Path) -> None:
    table = columns() | {"time_s": 1.7e9 + 0.0025 * np.arange(400)}
    np.savez(tmp_path / "a.npz", allow_pickle=False, **table)
    recording = load_recording(tmp_path / "a.npz")
    save_recording(recording, tmp_path / "b.csv")
    again = load_recording(tmp_path / "b.csv")
    np.testing.assert_allclose(again.time_s, recording.time_s, rtol=0.0, atol=1e-6)


def test_a_pause_in_the_time_stamps_is_no_jump(tmp_path: Path) -> None:
    table = {name: np.delete(values, slice(200, 230)) for name, values in columns().items()}
    assert len(load_recording(write(tmp_path / "a.csv", table)).time_s) == 370


def test_a_torque_constant_turns_a_current_into_a_torque(tmp_path: Path) -> None:
    table = columns()
    for name, factor in (("x_current_a", 2.0), ("x_current_ma", 2000.0)):
        current = {name: factor * table["x_torque_nm"]}
        path = write(tmp_path / "a.csv", drop("x_torque_nm")(table) | current)
        assert load_recording(path).axes["x"].effort_unit == "A"
        axis = load_recording(path, options=ReadOptions(torque_constant=0.5)).axes["x"]
        assert axis.effort_unit == "N*m"
        np.testing.assert_allclose(axis.effort, table["x_torque_nm"], rtol=1e-9, atol=1e-12)
    for constant in (0.0, -1.0, np.nan, np.inf):
        with pytest.raises(DataError, match="not a torque constant"):
            load_recording(path, options=ReadOptions(torque_constant=constant))


def test_two_columns_of_one_name_are_a_question(tmp_path: Path) -> None:
    path = write(tmp_path / "a.csv", columns() | {"again": 3.0 * columns()["x_torque_nm"]})
    path.write_text(path.read_text().replace("again", "x_torque_nm"))
    with pytest.raises(DataError, match="several columns are named x_torque_nm") as error:
        load_recording(path)
    assert error.value.next_step.endswith("--column x_torque_nm=x_torque_nm")
    first = load_recording(path, {"x_torque_nm": "x_torque_nm"}).axes["x"].effort
    second = load_recording(path, {"x_torque_nm (2)": "x_torque_nm"}).axes["x"].effort
    np.testing.assert_allclose(second, 3.0 * first, rtol=1e-9, atol=1e-11)


@pytest.mark.parametrize("shift", ["abc", "nan", "inf", "1e3"])
def test_a_shift_that_is_none_is_refused(tmp_path: Path, shift: str) -> None:
    path = write(tmp_path / "a.csv", columns(), f"# effort_shift_s={shift}\n")
    with pytest.raises(DataError, match=f"effort_shift_s is {shift}"):
        load_recording(path)


def _cut(content: bytes) -> bytes:
    return content[: len(content) // 2]


def _one_bit_off(content: bytes) -> bytes:
    return content[:1000] + bytes([content[1000] ^ 1]) + content[1001:]


@pytest.mark.parametrize("damage", [_cut, _one_bit_off, lambda content: content[128:]])
def test_a_damaged_archive_is_refused(tmp_path: Path, damage: Callable[[bytes], bytes]) -> None:
    np.savez(tmp_path / "whole.npz", allow_pickle=False, **columns())
    (tmp_path / "a.npz").write_bytes(damage((tmp_path / "whole.npz").read_bytes()))
    with pytest.raises(DataError, match=r"a\.npz: not a readable \.npz file"):
        load_recording(tmp_path / "a.npz")


def test_an_archive_of_something_else_is_refused(tmp_path: Path) -> None:
    np.save(tmp_path / "a.npy", np.zeros(300))
    (tmp_path / "a.npy").rename(tmp_path / "a.npz")
    with pytest.raises(DataError, match=r"not a readable \.npz file"):
        load_recording(tmp_path / "a.npz")
    tables = {name: np.column_stack([values, values]) for name, values in columns().items()}
    np.savez(tmp_path / "b.npz", allow_pickle=False, **tables)
    with pytest.raises(DataError, match="not certain which column is what"):
        load_recording(tmp_path / "b.npz")
    texts = {name: np.array(["a"] * 400) for name in columns()}
    np.savez(tmp_path / "c.npz", allow_pickle=False, **texts)
    with pytest.raises(DataError, match=r"no two series of numbers.*time_s \(text\)"):
        load_recording(tmp_path / "c.npz")


def test_an_archive_may_hold_columns_of_one_and_words(tmp_path: Path) -> None:
    upright = {name: values[:, np.newaxis] for name, values in columns().items()}
    np.savez(tmp_path / "a.npz", name="drive 3", **upright)
    axis = load_recording(tmp_path / "a.npz").axes["x"]
    np.testing.assert_array_equal(axis.position, columns()["x_position_rad"])


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
