"""Which board and drive the command profile measures: only the command line has a machine move."""

from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner

from edge_ident.cli import app
from edge_ident.commissioning import latency
from edge_ident.drive.description import Drive
from edge_ident.errors import BoardError


@pytest.fixture
def press(tmp_path: Path) -> Path:
    """A description of another drive, which says where its board is."""
    path = tmp_path / "press.toml"
    built_in = Path(latency.__file__).parents[1] / "drive" / "feed_drive.toml"
    described = built_in.read_text().replace('name = "', 'name = "press of ', 1)
    path.write_text(f'{described}\n[board]\ndevice = "press"\nbaud_rate = 9600\n')
    return path


@pytest.fixture
def profiled(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> list[tuple[Any, ...]]:
    """What was to be measured, each time."""
    calls: list[tuple[Any, ...]] = []

    def profile_device(*given: Any) -> None:
        calls.append(given)
        raise BoardError("enough", "that was all")

    monkeypatch.setattr(latency, "profile_device", profile_device)
    monkeypatch.setenv("EDGE_IDENT_CONFIG_FILE", str(tmp_path / "config.toml"))
    return calls


def run(*arguments: object) -> str:
    done = CliRunner().invoke(app, [*map(str, arguments)])
    assert done.exit_code in (0, 4), done.output
    return done.stderr


def device_and_drive(call: tuple[Any, ...]) -> tuple[str | None, str]:
    device, _, drive, *_ = call
    assert isinstance(drive, Drive)
    return device, drive.name[:5]


def test_no_machine_moves_that_the_command_line_does_not_name(
    monkeypatch: pytest.MonkeyPatch, profiled: list[tuple[Any, ...]], press: Path
) -> None:
    assert "virtual board" in run("profile", "--drive", press)
    run("config", "set", "drive", press)
    run("config", "set", "device", "set")
    assert "virtual board" in run("profile")
    monkeypatch.setenv("EDGE_IDENT_DEVICE", "environment")
    assert "virtual board" in run("profile")
    assert [device_and_drive(call) for call in profiled] == 3 * [(None, "press")]


def test_a_machine_that_it_names_moves_as_its_drive_does(
    monkeypatch: pytest.MonkeyPatch, profiled: list[tuple[Any, ...]], press: Path
) -> None:
    monkeypatch.setenv("EDGE_IDENT_DRIVE", str(press))
    assert "virtual board" not in run("profile", "--device", "/dev/mill")
    assert device_and_drive(profiled[0]) == ("/dev/mill", "press")
    assert profiled[0][1] == 9600


def test_the_help_says_that_it_moves_the_axes_and_commits_gains() -> None:
    text = " ".join(CliRunner().invoke(app, ["profile", "--help"]).stdout.split())
    assert "axes move with the effort on" in text
    assert "committed and rolled back repeatedly" in text
