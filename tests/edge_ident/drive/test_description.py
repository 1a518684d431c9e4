"""Drive descriptions: the paper's feed drive, and mistakes with their line and allowed range."""

import math
from importlib.resources import files
from pathlib import Path

import pytest

from edge_ident.drive.description import load_drive
from edge_ident.errors import DataError

BUILT_IN = (files("edge_ident.drive") / "feed_drive.toml").read_text("utf-8")


def test_built_in_drive_is_the_papers() -> None:
    drive = load_drive()
    assert drive.sampling_period_s == 0.0025
    assert drive.axes["x"].gear_ratio == 131.25
    assert drive.axes["x"].screw_lead_m_per_rad * 2 * math.pi == pytest.approx(0.004)
    assert drive.axes["z"].encoder_resolution_rad == pytest.approx(7.48e-4, rel=1e-3)
    trajectory = drive.trajectory()
    assert trajectory.duration_s == pytest.approx(21.85, abs=0.01)
    assert round(trajectory.duration_s / drive.sampling_period_s) == 8742
    assert drive.trajectory(cycles=3).duration_s == pytest.approx(3 * trajectory.duration_s)


def test_an_axis_that_the_drive_lacks_leads_to_a_description_of_the_machine() -> None:
    with pytest.raises(DataError, match=r"\(feed drive\) has axes x, z, but not q") as error:
        load_drive().check_axes(["x", "q"])
    assert "--drive" in error.value.next_step
    assert "edge-ident init --axis x --axis q" in error.value.next_step


def test_a_description_nested_too_deeply_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "mine.toml"
    path.write_text("a = " + 3000 * "[\n")
    with pytest.raises(DataError, match="nested too deeply"):
        load_drive(path)


def test_board_table_gives_the_device(tmp_path: Path) -> None:
    path = tmp_path / "mine.toml"
    path.write_text(BUILT_IN + '\n[board]\ndevice = "/dev/ttyACM7"\nbaud_rate = 921600\n')
    drive = load_drive(path)
    assert (drive.device, drive.baud_rate) == ("/dev/ttyACM7", 921600)


@pytest.mark.parametrize(
    ("old", "new", "message", "next_step"),
    [
        ("gear_ratio = 131.25", "gear_ratio = -3", "axes.x.gear_ratio is -3", "0.001 to 10000"),
        ("period_s = 0.0025", 'period_s = "fast"', "sampling.period_s is 'fast'", "1e-05 to 0.1"),
        ("cycles = 1", "cycles = 1\nspeed = 2", "trajectory.speed is not known", "lead_in_s"),
        ("phase_rad = 0.0", "", "axes.x lacks phase_rad", "add phase_rad"),
        ("amplitude_rad = 6.28", "amplitude_rad = 8.28", "exceeds the travel", "at most 8"),
        ("speed_limit_rad_s = 4.0", "speed_limit_rad_s = 1.0", "above the speed limit", "at most"),
    ],
)
def test_mistakes_name_line_and_range(
    tmp_path: Path, old: str, new: str, message: str, next_step: str
) -> None:
    text = BUILT_IN.replace("travel_limit_rad = 9.0", "travel_limit_rad = 8.0").replace(old, new, 1)
    path = tmp_path / "mine.toml"
    path.write_text(text)
    with pytest.raises(DataError, match=message) as error:
        load_drive(path)
    assert next_step in error.value.next_step
    line = int(error.value.cause.split("line ")[1].split(":")[0])
    named = message.split(".")[-1].split()[0]
    if "lacks" not in message and "." in message:
        assert named in text.splitlines()[line - 1]


def test_broken_toml_and_missing_file(tmp_path: Path) -> None:
    path = tmp_path / "mine.toml"
    path.write_text("name = \n")
    with pytest.raises(DataError, match="line 1"):
        load_drive(path)
    with pytest.raises(DataError, match="no such file"):
        load_drive(tmp_path / "absent.toml")
    path.write_text('name = "a"\n[sampling]\nperiod_s = 0.001\n')
    with pytest.raises(DataError, match="describes no axis"):
        load_drive(path)
