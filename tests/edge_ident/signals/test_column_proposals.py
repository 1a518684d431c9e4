"""What is proposed for columns that nobody named, and that it can be accepted."""

from dataclasses import replace
from pathlib import Path
from typing import Any, Final

import numpy as np
import pytest
from numpy.typing import NDArray

import edge_ident
from edge_ident.errors import DataError
from tests.test_bad_recordings import sound

GOOD: Final = sound()
OUNCE_INCH_NM: Final = 28.349523125e-3 * 9.80665 * 0.0254
"""Avoirdupois ounce, standard gravity and inch, all exact: NIST SP 811, appendix B."""


def write(path: Path, columns: dict[str, NDArray[np.float64]]) -> Path:
    head = ",".join(columns)
    table = np.column_stack(list(columns.values()))
    np.savetxt(path, table, delimiter=",", header=head, comments="", fmt="%.16g")
    return path


def axis(position: str, effort: str, /, **factors: float) -> dict[str, NDArray[np.float64]]:
    """Time, position and effort under these headings, divided by their units in SI."""
    return {
        "t [s]": GOOD.time_s,
        position: GOOD.position / factors.get("position", 1.0),
        effort: GOOD.effort / factors.get("effort", 1.0),
    }


def proposed(path: Path) -> dict[str, tuple[str | None, str | None]]:
    """Name in the contract and unit, by the heading."""
    found = edge_ident.inspect_recording(path)
    assert found.questions
    return {use.heading: (use.target, use.unit_text) for use in found.columns}


def accepted(path: Path) -> edge_ident.Recording:
    """The recording that the proposal's own options give."""
    return edge_ident.load_recording(path, options=accepting(path))


def accepting(path: Path, **read: Any) -> edge_ident.ReadOptions:
    """The options that accept the proposal for a file that is read so."""
    options = edge_ident.inspect_recording(path, edge_ident.ReadOptions(**read)).options
    pairs = list(zip(options[::2], options[1::2], strict=True))
    said = {
        kind: dict(value.rsplit("=", 1) for option, value in pairs if option == kind)
        for kind in ("--column", "--unit")
    }
    assert len(said["--column"]) + len(said["--unit"]) == len(pairs)
    return edge_ident.ReadOptions(columns=said["--column"], units=said["--unit"])


@pytest.mark.parametrize(
    ("heading", "factor"),
    [
        ("Torque (oz-in)", OUNCE_INCH_NM),
        ("torque_oz_in", OUNCE_INCH_NM),
        ("Torque [in-lbs]", 16.0 * OUNCE_INCH_NM),
        ("Torque (ft-lb)", 12.0 * 16.0 * OUNCE_INCH_NM),
    ],
)
def test_torques_in_ounces_and_pounds_are_converted(
    heading: str, factor: float, tmp_path: Path
) -> None:
    path = write(tmp_path / "us.csv", axis("Position (rad)", heading, effort=factor))
    read = edge_ident.load_recording(path).axes["x"]
    np.testing.assert_allclose(read.effort, GOOD.effort, rtol=1e-12)


def test_a_force_in_pounds_beside_inches_is_converted(tmp_path: Path) -> None:
    columns = axis("Position (in)", "Force (lbf)", position=0.0254, effort=4.4482216152605)
    read = edge_ident.load_recording(write(tmp_path / "us.csv", columns)).axes["x"]
    np.testing.assert_allclose(read.position, GOOD.position, rtol=1e-12)
    np.testing.assert_allclose(read.effort, GOOD.effort, rtol=1e-12)


@pytest.mark.parametrize(
    ("position", "effort", "targets"),
    [
        ("q_elbow [rad]", "tau_elbow [Nm]", ["elbow_position_rad", "elbow_torque_nm"]),
        ("q_x [m]", "tau_x [N]", ["x_position_m", "x_force_n"]),
        ("q1 [rad]", "tau1 [A]", ["axis1_position_rad", "axis1_current_a"]),
        ("x_y [m]", "F_meas_y [N]", ["y_position_m", "y_force_n"]),
        ("theta2 [rad]", "i2 [A]", ["axis2_position_rad", "axis2_current_a"]),
        ("x [m]", "F [N]", ["x_position_m", "x_force_n"]),
    ],
)
def test_coordinates_and_efforts_of_formulas_are_an_axis_with_any_name(
    position: str, effort: str, targets: list[str], tmp_path: Path
) -> None:
    found = edge_ident.inspect_recording(write(tmp_path / "arm.csv", axis(position, effort)))
    assert not found.questions
    assert [use.target for use in found.columns[1:]] == targets


@pytest.mark.parametrize(
    ("position", "effort"),
    [
        ("q_elbow [rad]", "tau_wrist [Nm]"),
        ("x_y [m]", "F_z [N]"),
        ("x_y [m]", "i_y [N]"),
        ("d_y [m]", "F_y [N]"),
    ],
)
def test_coordinate_and_effort_that_do_not_belong_together_are_asked_about(
    position: str, effort: str, tmp_path: Path
) -> None:
    assert proposed(write(tmp_path / "arm.csv", axis(position, effort)))


def test_two_coordinates_of_one_axis_are_asked_about(tmp_path: Path) -> None:
    columns = axis("q_y [rad]", "i_y [A]")
    assert proposed(write(tmp_path / "arm.csv", {**columns, "phi_y [rad]": GOOD.position}))


@pytest.mark.parametrize(
    ("position", "effort", "unknown"),
    [
        ("Position [rad]", "Torque [fnord]", "Torque [fnord]"),
        ("Position [rad]", "Torque [0.1 Nm]", "Torque [0.1 Nm]"),
        ("Position [rad]", "Torque [mm]", "Torque [mm]"),
        ("Position [cubits]", "Torque [Nm]", "Position [cubits]"),
        ("Position [Nm]", "Torque [Nm]", "Position [Nm]"),
    ],
)
def test_no_other_unit_is_proposed_where_a_heading_states_one(
    position: str, effort: str, unknown: str, tmp_path: Path
) -> None:
    path = write(tmp_path / "unknown.csv", axis(position, effort))
    found = edge_ident.inspect_recording(path)
    (question,) = found.questions
    assert unknown in question
    assert [word for word in found.options if word.startswith(f"{unknown}=")][1:] == [
        f"{unknown}=UNIT"
    ]


def test_a_unit_that_is_not_known_is_asked_for_where_the_column_is_named(tmp_path: Path) -> None:
    path = write(tmp_path / "unknown.csv", axis("Position [rad]", "Torque [fnord]"))
    names = {"Position [rad]": "x_position_rad", "Torque [fnord]": "x_torque_nm"}
    options = edge_ident.ReadOptions(columns=names)
    with pytest.raises(DataError, match="states fnord, which is no unit") as caught:
        edge_ident.load_recording(path, options=options)
    assert "--unit 'Torque [fnord]=UNIT'" in caught.value.next_step
    said = edge_ident.ReadOptions(columns=names, units={"Torque [fnord]": "0.5 Nm"})
    read = edge_ident.load_recording(path, options=said).axes["x"]
    np.testing.assert_allclose(read.effort, 0.5 * GOOD.effort)


@pytest.mark.parametrize("heading", ["Position (actual)", "Position (J2)", "Position [1]"])
def test_words_and_labels_in_brackets_are_no_unit(heading: str, tmp_path: Path) -> None:
    path = write(tmp_path / "label.csv", axis(heading, "Torque [Nm]"))
    assert proposed(path)[heading][1] == "rad"


def test_what_brackets_of_a_position_and_a_torque_hold_names_their_axis(tmp_path: Path) -> None:
    """No unit is one of both."""
    columns = axis("Position (left)", "Torque (left)")
    columns |= {"Position (right)": GOOD.position, "Torque (right)": GOOD.effort}
    path = write(tmp_path / "sides.csv", columns)
    assert proposed(path)["Torque (left)"] == ("left_torque_nm", "Nm")
    assert list(accepted(path).axes) == ["left", "right"]


@pytest.mark.parametrize("heading", ["Position [grad]", "winkel_grad", "Lage in grad"])
def test_grad_is_asked_about(heading: str, tmp_path: Path) -> None:
    """Degrees in German, gradians in English: 10 % apart."""
    path = write(tmp_path / "grad.csv", axis(heading, "Torque [Nm]", position=np.pi / 180.0))
    assert proposed(path)[heading] == ("x_position_rad", "deg")
    np.testing.assert_allclose(accepted(path).axes["x"].position, GOOD.position, rtol=1e-12)
    gon = edge_ident.ReadOptions(units={heading: "gon"})
    read = edge_ident.load_recording(path, options=gon).axes["x"]
    np.testing.assert_allclose(read.position, 0.9 * GOOD.position, rtol=1e-12)


def test_grad_with_a_capital_is_german(tmp_path: Path) -> None:
    columns = axis("Winkel [Grad]", "Moment [Nm]", position=np.pi / 180.0)
    read = edge_ident.load_recording(write(tmp_path / "german.csv", columns)).axes["x"]
    np.testing.assert_allclose(read.position, GOOD.position, rtol=1e-12)


@pytest.mark.parametrize(
    ("effort", "factor", "name", "unit"),
    [
        ("actual_torque", 1.0, "x_position_rad", "rad"),
        ("actual_torque", np.pi / 180.0, "x_position_rad", "deg"),
        ("actual_force", 1.0, "x_position_m", "mm"),
        ("actual_force", 10.0, "x_position_m", "m"),
    ],
)
def test_beside_a_torque_an_axis_turns(
    effort: str, factor: float, name: str, unit: str, tmp_path: Path
) -> None:
    path = write(tmp_path / "bare.csv", axis("actual_position", effort, position=factor))
    assert proposed(path)["actual_position"] == (name, unit)
    assert accepted(path).axes["x"].position_unit == name.rpartition("_")[2]


def test_beside_a_torque_without_a_name_an_axis_turns(tmp_path: Path) -> None:
    assert proposed(write(tmp_path / "ab.csv", axis("a", "b")))["a"] == ("x_position_rad", "rad")


@pytest.mark.parametrize(
    ("heading", "name", "unit"),
    [
        ("Load (fnord)", "x_torque_nm", None),
        ("Load (oz-in)", "x_torque_nm", "oz-in"),
        ("Load (lbf)", "x_force_n", "lbf"),
    ],
)
def test_a_column_told_by_its_course_keeps_its_unit(
    heading: str, name: str, unit: str | None, tmp_path: Path
) -> None:
    path = write(tmp_path / "load.csv", axis("Position (deg)", heading))
    assert proposed(path)["Position (deg)"] == ("x_position_rad", "deg")
    assert proposed(path)[heading] == (name, unit)


@pytest.mark.parametrize(
    ("unit", "factor", "first"),
    [
        ("s", 1.0, 0.0),
        ("ms", 1e-3, 0.0),
        ("us", 1e-6, 0.0),
        ("ns", 1e-9, 0.0),
        ("ns", 1e-9, 1.7e9),
        ("us", 1e-6, 1.7e9),
        ("s", 1.0, 1.7e9),
    ],
)
def test_a_time_has_the_only_unit_in_which_a_drive_is_sampled_so(
    unit: str, factor: float, first: float, tmp_path: Path
) -> None:
    columns = axis("Position [rad]", "Torque [Nm]")
    columns = {"%time": (first + columns.pop("t [s]")) / factor, **columns}
    path = write(tmp_path / "time.csv", columns)
    found = edge_ident.inspect_recording(path)
    assert not found.questions
    assert (found.columns[0].target, found.columns[0].unit_text) == ("time_s", unit)
    read = edge_ident.load_recording(path).time_s
    np.testing.assert_allclose(read - read[0], GOOD.time_s, atol=1e-6)


def test_a_time_that_may_have_two_units_is_asked_about(tmp_path: Path) -> None:
    """At 40 Hz a step is 0.025 s, which would be 40 kHz in ms."""
    columns = axis("Position [rad]", "Torque [Nm]")
    path = write(tmp_path / "slow.csv", {"t": 10.0 * columns.pop("t [s]"), **columns})
    assert proposed(path)["t"] == ("time_s", "s")
    np.testing.assert_allclose(accepted(path).time_s, 10.0 * GOOD.time_s)


def test_seconds_since_1970_tell_a_fine_unit(tmp_path: Path) -> None:
    """At 20 kHz a step is 50,000 ns, which would be 50 ms of a clock in us."""
    columns = axis("Position [rad]", "Torque [Nm]")
    columns = {"time": 1e9 * (1.7e9 + columns.pop("t [s]") / 50.0), **columns}
    assert proposed(write(tmp_path / "time.csv", columns))["time"] == ("time_s", "ns")


def test_a_time_that_is_too_slow_names_its_own_column(tmp_path: Path) -> None:
    columns = axis("Position [rad]", "Torque [Nm]")
    columns = {"stamp time": 1e9 * columns.pop("t [s]"), **columns}
    path = write(tmp_path / "slow.csv", columns)
    options = edge_ident.ReadOptions(units={"stamp time": "us"})
    with pytest.raises(DataError, match="too slow") as caught:
        edge_ident.load_recording(path, options=options)
    assert "in nanoseconds, say so: --unit 'stamp time=ns'" in caught.value.next_step
    with pytest.raises(DataError, match="too slow") as caught:
        edge_ident.load_recording(path, options=edge_ident.ReadOptions(period_s=2.5))
    assert caught.value.next_step == "give the sampling period in seconds: --period"


def test_a_position_without_a_unit_is_in_counts_where_their_size_is_given(tmp_path: Path) -> None:
    columns = axis("pos", "iq [A]", position=2.0 * np.pi / 16384.0)
    path = write(tmp_path / "counts.csv", columns)
    options = edge_ident.ReadOptions(resolution="16384/turn")
    found = edge_ident.inspect_recording(path, options=options)
    assert {use.heading: use.unit_text for use in found.columns}["pos"] == "counts"
    assert found.options[-2:] == ("--resolution", "16384/turn")
    columns_said = {"pos": "x_position_rad", "iq [A]": "x_current_a"}
    said = replace(options, columns=columns_said)
    with pytest.raises(DataError, match="no column is in counts, and pos states no unit") as error:
        edge_ident.load_recording(path, options=said)
    assert "--unit 'pos=counts'" in error.value.next_step
    read = edge_ident.load_recording(path, options=replace(said, units={"pos": "counts"}))
    np.testing.assert_allclose(read.axes["x"].position, GOOD.position, atol=1e-9)


@pytest.mark.parametrize("heading", ["x_torque_pct", "x_torque_percent", "x_current_pct"])
def test_a_name_of_the_contract_in_percent_asks_for_the_rated_effort(
    heading: str, tmp_path: Path
) -> None:
    path = write(
        tmp_path / "a.csv",
        {
            "time_s": GOOD.time_s,
            "x_position_rad": GOOD.position,
            heading: GOOD.effort / 0.024,
        },
    )
    found = edge_ident.inspect_recording(path)
    assert found.options == (
        "--column", f"{heading}=x_{heading.split('_')[1]}_{'nm' if 'torque' in heading else 'a'}",
        "--rated-effort", "VALUE_Nm",
    )  # fmt: skip
    assert set(found.open_values) == {"VALUE_Nm"}
    options = edge_ident.ReadOptions(rated_effort="2.4 Nm")
    if "torque" in heading:
        read = edge_ident.load_recording(path, options=options).axes["x"]
        np.testing.assert_allclose(read.effort, GOOD.effort, rtol=1e-12)


def test_whole_numbers_without_a_unit_are_counts(tmp_path: Path) -> None:
    counts = np.rint(GOOD.position / (2.0 * np.pi) * 65536)
    path = write(
        tmp_path / "a.csv", {"t [s]": GOOD.time_s, "pos": counts, "torque [Nm]": GOOD.effort}
    )
    assert proposed(path)["pos"] == ("x_position_rad", "counts")
    found = edge_ident.inspect_recording(path)
    assert set(found.open_values) == {"COUNTS/turn"}
    options = edge_ident.ReadOptions(
        {"pos": "x_position_rad", "torque": "x_torque_nm"},
        units={"pos": "counts"},
        resolution="65536/turn",
    )
    read = edge_ident.load_recording(path, options=options).axes["x"]
    np.testing.assert_allclose(read.position, GOOD.position, atol=1e-4)


def test_the_one_column_that_is_left_is_asked_about(tmp_path: Path) -> None:
    path = write(
        tmp_path / "a.csv",
        {
            "t [s]": GOOD.time_s,
            "joint.0.pos-fb": GOOD.position,
            "joint.0.pos-cmd": GOOD.position,
            "pid.0.output": GOOD.effort,
        },
    )
    found = edge_ident.inspect_recording(path)
    assert found.questions[0] == "is pid.0.output the effort? No other column is left"
    read = accepted(path).axes["x"]
    np.testing.assert_allclose(read.effort, GOOD.effort, rtol=1e-12)
    assert read.reference is not None


def test_a_quantity_in_percent_without_an_axis_is_proposed_for_one(tmp_path: Path) -> None:
    path = write(
        tmp_path / "a.csv",
        {"time_s": GOOD.time_s, "pos_rad": GOOD.position, "torque_pct": GOOD.effort / 0.024},
    )
    found = edge_ident.inspect_recording(path)
    assert [use.target for use in found.columns] == ["time_s", "x_position_rad", "x_torque_nm"]
    assert set(found.open_values) == {"VALUE_Nm"}
