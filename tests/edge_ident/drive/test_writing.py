"""A written description is read back as it was, and says units and origins."""

import re
from dataclasses import replace
from pathlib import Path

import pytest

from edge_ident.drive.description import load_drive, write_drive
from edge_ident.errors import DataError


def test_a_written_description_is_read_back_to_the_last_bit(tmp_path: Path) -> None:
    path = tmp_path / "new" / "mine.toml"
    drive = replace(load_drive(), name='Müller\'s "press" \\ 2', sampling_period_s=1 / 3000)
    write_drive(drive, path, {"axes.z.effort_limit_nm": "0.0914 Nm"}, ["a note"])
    assert load_drive(path) == drive
    text = path.read_text("utf-8")
    assert "# - a note" in text
    assert re.search(r"\[axes\.z\][^[]*effort_limit_nm = 12 +# N\*m .*; 0\.0914 Nm", text)
    numbers = [line for line in text.splitlines() if re.match(r"\w+ = [\d.e+-]+", line)]
    assert len(numbers) == 4 + 2 * 9
    assert all("  # " in line or " # " in line for line in numbers)


def test_an_axis_that_only_turns_has_no_lead(tmp_path: Path) -> None:
    drive = load_drive()
    turning = replace(drive, axes={"c": replace(drive.axes["x"], screw_lead_m_per_rad=0.0)})
    write_drive(turning, tmp_path / "table.toml", {})
    assert "screw_lead" not in (tmp_path / "table.toml").read_text("utf-8")
    assert load_drive(tmp_path / "table.toml") == turning


def test_what_cannot_be_read_replaces_nothing(tmp_path: Path) -> None:
    path = tmp_path / "mine.toml"
    path.write_text("old")
    with pytest.raises(DataError, match="period_s is 2"):
        write_drive(replace(load_drive(), sampling_period_s=2.0), path, {})
    assert [file.name for file in tmp_path.iterdir()] == ["mine.toml"]
    assert path.read_text() == "old"
