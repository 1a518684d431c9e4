"""From a file of another program to parameters: the same as from the native file."""

import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from typer.testing import CliRunner

import edge_ident
from edge_ident.cli import app
from edge_ident.errors import DataError
from tests.test_bad_recordings import Columns, sound

LEAD_M = 0.005
M_PER_RAD = LEAD_M / (2.0 * np.pi)


def linear(columns: Columns) -> Columns:
    """The same axis behind a ball screw: metres and newtons."""
    return Columns(columns.time_s, columns.position * M_PER_RAD, columns.effort / M_PER_RAD)


def native(path: Path, columns: Columns) -> Path:
    axis = edge_ident.AxisRecord(columns.position, columns.effort, "m", "N")
    edge_ident.save_recording(edge_ident.Recording(columns.time_s, {"x": axis}, "made"), path)
    return path


def scope(path: Path, columns: Columns) -> Path:
    """Name, date and sampling time before the table; ms, mm and kN with decimal commas."""
    lines = ["Name;Achse X", "Datum;22.11.2026 10:00", "Abtastzeit [ms];2,5", ""]
    lines.append("Zeit [ms];X.ActPos [mm];X.SetPos [mm];X.Kraft [kN]")
    for t, x, u in zip(1e3 * columns.time_s, 1e3 * columns.position, 1e-3 * columns.effort,
                       strict=True):  # fmt: skip
        lines.append(";".join(f"{v:.12g}" for v in (t, x, x, u)).replace(".", ","))
    path.write_text("\r\n".join(lines) + "\r\n", encoding="latin-1", newline="")
    return path


def run(*arguments: str | Path) -> tuple[int, Any, str]:
    result = CliRunner().invoke(app, [str(argument) for argument in arguments])
    assert result.exception is None or isinstance(result.exception, SystemExit), result.exception
    return result.exit_code, json.loads(result.stdout or "null"), result.stderr


@pytest.fixture
def exported(tmp_path: Path) -> Path:
    return scope(tmp_path / "scope.csv", linear(sound()))


def parameters(document: Any) -> dict[str, tuple[float, float]]:
    found = document["axes"]["x"]["parameters"]
    return {name: (value["value"], value["std"]) for name, value in found.items()}


def test_a_file_is_not_replaced_by_what_was_read_of_it(exported: Path) -> None:
    before = exported.read_bytes()
    done = CliRunner().invoke(app, ["import", str(exported), "-o", str(exported)])
    assert done.exit_code == 2
    assert "is the file to import" in done.stderr
    assert exported.read_bytes() == before


def test_an_axis_that_stands_still_or_is_damaged_can_be_left_out(tmp_path: Path) -> None:
    columns, path = sound(), tmp_path / "machine.npz"
    still, damaged = np.zeros_like(columns.position), np.full_like(columns.effort, np.nan)
    np.savez(
        path,
        time_s=columns.time_s,
        x_position_rad=columns.position,
        x_torque_nm=columns.effort,
        y_position_rad=still,
        y_torque_nm=damaged,
    )
    with pytest.raises(DataError, match="not a finite number"):
        edge_ident.load_recording(path)
    alone = edge_ident.load_recording(path, options=edge_ident.ReadOptions(axes=["x"]))
    assert list(alone.axes) == ["x"]
    with pytest.raises(DataError, match="has no axis q") as caught:
        edge_ident.load_recording(path, options=edge_ident.ReadOptions(axes=["x", "q"]))
    assert caught.value.next_step == "it has x and y"
    code, document, _ = run("identify", path, "--axis", "x", "--no-diagnose", "--json")
    assert code == 0
    assert list(document["axes"]) == ["x"]


def test_a_recording_in_which_nothing_moves_is_refused(tmp_path: Path) -> None:
    columns, path = sound(), tmp_path / "machine.csv"
    still = edge_ident.AxisRecord(np.zeros_like(columns.position), columns.effort, "rad", "N*m")
    both = edge_ident.Recording(columns.time_s, {"x": still, "y": still}, "made")
    edge_ident.save_recording(both, path)
    with pytest.raises(DataError, match="axis x, position: no motion"):
        edge_ident.load_recording(path)


def test_an_export_in_mm_and_ms_gives_the_same_parameters(exported: Path, tmp_path: Path) -> None:
    """To the precision of twelve digits, which the encoder noise of the fit amplifies a little."""
    path = native(tmp_path / "native.npz", linear(sound()))
    code, expected, _ = run("identify", path, "--json")
    assert code == 0
    code, found, messages = run("identify", exported, "--json")
    assert code == 0
    for name, (value, std) in parameters(expected).items():
        assert parameters(found)[name] == pytest.approx((value, std), rel=1e-6), name
    assert "delimiter semicolon, decimal comma, UTF-8, headings in row 5" in messages
    assert "X.ActPos [mm] → x_position_m, times 0.001 (a position in mm)" in messages


def test_a_contracts_name_in_another_unit_keeps_its_axis(tmp_path: Path) -> None:
    """Degrees and mm are converted, beside a column that has the contract's own name."""
    made = linear(sound())
    expected = edge_ident.load_recording(native(tmp_path / "native.npz", made)).axes["x"]
    path = tmp_path / "mm.csv"
    table = np.column_stack([made.time_s, 1e3 * made.position, made.effort])
    np.savetxt(path, table, delimiter=",", header="time_s,x_position_mm,x_force_n", comments="")
    read = edge_ident.load_recording(path)
    assert list(read.axes) == ["x"]
    np.testing.assert_allclose(read.axes["x"].position, expected.position, rtol=1e-9)
    assert (read.axes["x"].position_unit, read.axes["x"].effort_unit) == ("m", "N")


def test_every_command_takes_the_same_options(exported: Path, tmp_path: Path) -> None:
    options = ["--column", "X.ActPos [mm]=x_position_m", "--column", "X.Kraft=x_force_n",
               "--period", "0.0025"]  # fmt: skip
    made = tmp_path / "made.csv"
    assert run("import", exported, *options, "-o", made, "--json")[0] == 0
    for command in (["identify"], ["gains"], ["diagnose"], ["compare", "--method",
                    "least_squares"]):  # fmt: skip
        code, document, messages = run(*command, exported, *options, "--json")
        assert code in (0, 1), messages
        assert "sampling period 0.0025 s (as given)" in messages
        assert "not used: Zeit [ms], X.SetPos [mm]" in messages
        assert document["schema"].startswith("edge-ident/")


def test_what_is_not_certain_is_listed_with_the_command_that_accepts_it(tmp_path: Path) -> None:
    columns, path = sound(), tmp_path / "unclear.csv"
    rows = np.column_stack([columns.time_s, columns.position, columns.effort, columns.effort])
    np.savetxt(path, rows, header="t [s];pos;iq [A];torque [Nm]", comments="", delimiter=";")
    code, nothing, messages = run("identify", path, "--json")
    assert code == 5
    assert "which column is the effort" in nothing["cause"]
    assert "pos states no unit" in messages
    proposed = nothing["next_step"]
    assert f"edge-ident identify {path} --column 't [s]=time_s'" in proposed
    accepted = ["--column", "t [s]=time_s", "--column", "pos=x_position_m", "--unit", "pos=mm",
                "--column", "iq [A]=x_current_a"]  # fmt: skip
    assert all(word in proposed for word in accepted)
    assert run("import", path, *accepted, "--json")[0] == 0
    code, document, _ = run("import", path, "--json")
    assert (code, document["certain"]) == (5, False)
    assert document["options"] == accepted


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"columns": {"nowhere": "time_s"}}, "there is no column nowhere to rename"),
        ({"columns": {"Zeit": "seconds"}}, "seconds is no name of the contract"),
        ({"columns": {"X.ActPos": "x_position_rad"}}, "is in mm, which is no rad"),
        ({"units": {"X.ActPos": "furlong"}}, "no unit that edge-ident knows"),
        ({"units": {"X.ActPos": "counts"}}, "say what that is with --resolution"),
        ({"units": {"X.Kraft": "%"}}, "say what that is with --rated-effort"),
        ({"units": {"X.Kraft": "mm"}}, "is named force and has the unit mm"),
        ({"resolution": "many"}, "not counts per turn or length"),
        ({"rated_effort": "2.4"}, "not an effort with its unit"),
    ],
)
def test_what_a_person_says_is_checked(
    exported: Path, options: dict[str, Any], message: str
) -> None:
    with pytest.raises(DataError, match=message) as error:
        edge_ident.load_recording(exported, options=edge_ident.ReadOptions(**options))
    assert error.value.next_step


def test_a_missing_number_is_refused_with_its_row_and_column(tmp_path: Path) -> None:
    columns = sound()
    columns.effort[100] = np.nan
    path = columns.write(tmp_path / "gap.csv")
    with pytest.raises(DataError, match="row 102, column x_torque_nm: not a finite number"):
        edge_ident.load_recording(path)


@pytest.mark.parametrize(
    ("change", "unit", "code"),
    [
        ({"position": 180.0 / np.pi}, "rad", "many_turns"),
        ({"position": np.pi / 180.0 / 4.0}, "rad", "small_travel"),
        ({"position": 1e3 * M_PER_RAD * 3e3}, "m", "long_travel"),
        ({"time_s": 200.0}, "rad", "slow_sampling"),
        ({"effort": 1e6}, "rad", "implausible_inertia"),
    ],
)
def test_implausible_scales_are_questioned(change: dict[str, float], unit: str, code: str) -> None:
    """A question with a next step; never an error."""
    good = sound()
    scaled = {name: getattr(good, name) * change.get(name, 1.0) for name in vars(good)}
    axis = edge_ident.AxisRecord(scaled["position"], scaled["effort"], unit, "N*m")
    recording = edge_ident.Recording(scaled["time_s"], {"x": axis}, "made")
    found = edge_ident.identify(recording, diagnose=False).axes["x"].findings
    (question,) = [finding for finding in found if finding.code == code]
    assert question.next_step
    assert not question.blocks


@pytest.mark.parametrize(("position", "effort"), [("m", "N*m"), ("rad", "N")])
def test_a_length_beside_a_torque_and_an_angle_beside_a_force_are_questioned(
    position: str, effort: str, tmp_path: Path
) -> None:
    """Their product is no work, and the inertia that follows is none."""
    good, path = sound(), tmp_path / "crossed.csv"
    axis = edge_ident.AxisRecord(1e-3 * good.position, good.effort, position, effort)
    edge_ident.save_recording(edge_ident.Recording(good.time_s, {"x": axis}, "made"), path)
    _, document, messages = run("import", path, "--json")
    assert f"the position is in {position} and the effort in {effort}" in messages
    assert "crossed_units" in [question["code"] for question in document["warnings"]]
    _, document, _ = run("identify", path, "--no-diagnose", "--json")
    assert "crossed_units" in [found["code"] for found in document["axes"]["x"]["warnings"]]


def test_the_question_about_crossed_units_can_be_followed(tmp_path: Path) -> None:
    """A position of 5 mm a turn becomes an angle by what the next step says."""
    good, path = sound(), tmp_path / "screw.csv"
    table = np.column_stack([good.time_s, 5.0 * good.position / (2.0 * np.pi), good.effort])
    np.savetxt(path, table, delimiter=",", header="t [s],pos [mm],torque [Nm]", comments="")
    _, _, messages = run("import", path, "--json")
    assert "--unit 'NAME=1/5 turn'" in messages
    options = edge_ident.ReadOptions(units={"pos": "1/5 turn"})
    read = edge_ident.load_recording(path, options=options).axes["x"]
    np.testing.assert_allclose(read.position, good.position, rtol=1e-9)
    native = Columns(good.time_s, good.position, good.effort).write(tmp_path / "native.csv")
    named = native.read_text().replace("x_position_rad", "x_position_m")
    native.write_text(named)
    assert "--column x_position_m=x_position_rad" in run("import", native, "--json")[2]
    options = edge_ident.ReadOptions({"x_position_m": "x_position_rad"}, {"x_position_m": "rad"})
    assert edge_ident.load_recording(native, options=options).axes["x"].position_unit == "rad"


def test_a_position_in_degrees_beside_a_speed_in_rad_is_questioned() -> None:
    good = sound()
    velocity = np.gradient(good.position, good.time_s)
    axis = edge_ident.AxisRecord(
        np.degrees(good.position), good.effort, "rad", "N*m", good.position, velocity
    )
    recording = edge_ident.Recording(good.time_s, {"x": axis}, "made")
    found = edge_ident.identify(recording, diagnose=False).axes["x"].findings
    codes = {finding.code: finding.message for finding in found}
    assert (
        "57.3 times what the velocity says, as between degrees and rad" in codes["velocity_scale"]
    )
    assert "57.3 times what the reference says" in codes["reference_scale"]


def test_text_is_identified_without_any_package_of_other_formats(exported: Path) -> None:
    source = f"""
import sys
sys.argv = ["edge-ident", "identify", {str(exported)!r}, "--json", "--no-diagnose"]
from edge_ident.cli import main
try:
    main()
except SystemExit as end:
    assert not end.code, end.code
print(*{{name.split(".")[0] for name in sys.modules}}, file=sys.stderr)
"""
    done = subprocess.run(
        [sys.executable, "-c", source], capture_output=True, text=True, check=True
    )
    loaded = set(done.stderr.splitlines()[-1].split())
    assert "numpy" in loaded
    assert not loaded & {"scipy", "pandas", "pyarrow", "h5py", "nptdms", "openpyxl", "matplotlib"}
