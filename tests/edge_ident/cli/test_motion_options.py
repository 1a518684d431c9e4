"""Periods are for motions that have them, and not without end."""

from pathlib import Path

import pytest
from typer.testing import CliRunner

from edge_ident.cli import app
from edge_ident.cli.options import MOST_CYCLES
from edge_ident.drive.description import TABLE_RANGES

COMMANDS = (
    ["run", "--device", "virtual"],
    ["capture", "--device", "virtual"],
    ["simulate", "--output", "never.csv"],
)


@pytest.mark.parametrize("command", COMMANDS, ids=lambda command: command[0])
@pytest.mark.parametrize(
    ("options", "said"),
    [
        (["--motion", "staircase", "--cycles", "5"], "staircase has no periods"),
        (["--cycles", str(MOST_CYCLES + 1)], "not in the range"),
    ],
)
def test_periods_that_make_no_sense_are_wrong_usage(
    command: list[str], options: list[str], said: str
) -> None:
    done = CliRunner().invoke(app, [*command, *options])
    assert done.exit_code == 2
    assert said in done.stderr


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (["--most-seconds", "20"], "the first motion takes 26.9 s"),
        (["--most-seconds", "40", "--cycles", "2"], "the first motion takes 48.7 s"),
        (["--dry-run", "--store"], "a dry run has no gains to store"),
    ],
)
def test_a_run_that_cannot_be_as_asked_does_not_begin(
    options: list[str], said: str, tmp_path: Path
) -> None:
    done = CliRunner().invoke(
        app, ["run", "--device", "virtual", "-o", str(tmp_path / "out"), *options]
    )
    assert done.exit_code == 2
    assert said in done.stderr
    assert not (tmp_path / "out" / "capture.npz").exists()


def test_a_setting_counts_for_the_motions_that_have_periods(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    asked = []

    def no_board(*_: object, **__: object) -> None:
        asked.append(True)
        raise OSError("no board")

    monkeypatch.setattr("edge_ident.cli.sessions.edge_ident.connect", no_board, raising=False)
    monkeypatch.setenv("EDGE_IDENT_CYCLES", "5")
    CliRunner().invoke(app, ["run", "--device", "none", "--motion", "staircase"])
    assert asked


def test_the_largest_number_is_that_of_a_drive_description() -> None:
    assert TABLE_RANGES["trajectory"]["cycles"] == (1, MOST_CYCLES)
