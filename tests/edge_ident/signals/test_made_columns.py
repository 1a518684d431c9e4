"""A speed stands for a position that was not recorded: integrated, and never called a position."""

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

import edge_ident
from edge_ident.signals.made_columns import with_integrated_speed
from tests.edge_ident.signals.test_effort_encoding import EFFORT, POSITION, TIME_S, TRUE, VELOCITY

Array = NDArray[np.float64]


RPM = 30.0 / np.pi


def write(path: Path, heads: list[str], *columns: Array, comma: bool = False) -> Path:
    separator, form = (";", "%.6f") if comma else (",", "%.6f")
    table = np.column_stack(columns)
    np.savetxt(
        path, table, delimiter=separator, header=separator.join(heads), comments="", fmt=form
    )
    if comma:
        path.write_text(path.read_text().replace(".", ","))
    return path


def zero(drift: float, **others: Array) -> str:
    columns = {"time_s": TIME_S, "x_velocity_rad_s": VELOCITY + drift, "x_torque_nm": EFFORT}
    made, (said,) = with_integrated_speed({**columns, **others})
    moved = made["x_position_rad"] - POSITION
    assert np.ptp(moved) < 0.05 + 0.06 * abs(drift) * TIME_S[-1]
    return said


@pytest.mark.parametrize(
    ("head", "factor"),
    [("speed [rpm]", RPM), ("velocity [rad/s]", 1.0), ("motor_speed_rpm", RPM)],
)
def test_a_speed_alone_gives_the_right_values(head: str, factor: float, tmp_path: Path) -> None:
    path = write(
        tmp_path / "a.csv", ["time [s]", head, "torque [Nm]"], TIME_S, factor * VELOCITY, EFFORT
    )
    found = edge_ident.inspect_recording(path)
    assert [use.target for use in found.columns] == ["time_s", "x_velocity_rad_s", "x_torque_nm"]
    assert any("is the integral of its speed" in line for line in found.done)
    values = edge_ident.identify(found.recording(), diagnose=False).axes["x"].estimate.parameters
    np.testing.assert_allclose(values, TRUE, rtol=0.03, atol=2e-3)


def test_german_headings_and_decimal_commas(tmp_path: Path) -> None:
    heads = ["Zeit [s]", "Drehzahl [1/min]", "Drehmoment [Nm]"]
    path = write(tmp_path / "a.csv", heads, TIME_S, RPM * VELOCITY, EFFORT, comma=True)
    np.testing.assert_allclose(
        np.gradient(edge_ident.load_recording(path).axes["x"].position, TIME_S)[1:-1],
        VELOCITY[1:-1], atol=0.05,
    )  # fmt: skip


@pytest.mark.parametrize(
    "heads", [["t [s]", "rpm", "torque"], ["t", "speed", "current"], ["t", "omega", "iq"]]
)
def test_a_speed_is_never_proposed_as_a_position(heads: list[str], tmp_path: Path) -> None:
    found = edge_ident.inspect_recording(
        write(tmp_path / "a.csv", heads, TIME_S, RPM * VELOCITY, EFFORT)
    )
    assert found.questions
    assert not [use for use in found.columns if "position" in (use.target or "")]
    assert found.columns[1].target == "x_velocity_rad_s"


def test_a_position_goes_before_a_speed(tmp_path: Path) -> None:
    heads = ["time [s]", "speed [rpm]", "position [rad]", "torque [Nm]"]
    path = write(tmp_path / "a.csv", heads, TIME_S, RPM * VELOCITY, POSITION, EFFORT)
    np.testing.assert_allclose(
        edge_ident.load_recording(path).axes["x"].position, POSITION, atol=1e-6
    )


def test_the_drift_of_the_zero_is_removed_where_it_shows() -> None:
    assert "no drift of its zero shows" in zero(0.0)
    assert "rad/s, was removed (there dry friction changes" in zero(0.3)
    said = zero(0.3, x_reference_rad=POSITION)
    assert "0.3 rad/s, was removed (the position then follows its reference)" in said


def test_the_zero_is_what_a_speed_reads_at_a_standstill() -> None:
    moves = np.where((TIME_S > 2.0) & (TIME_S < 6.0), 5.0 * np.sin(np.pi * TIME_S), 0.0)
    columns = {"time_s": TIME_S, "x_velocity_rad_s": moves + 0.02, "x_torque_nm": moves}
    made, (said,) = with_integrated_speed(columns)
    assert "0.02 rad/s, was removed (what it reads where the axis stands)" in said
    assert abs(made["x_position_rad"][-1]) < 0.01
