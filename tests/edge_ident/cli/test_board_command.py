"""The command board: a device name that stays, and a board that remembers."""

import json
import re
import sys
from pathlib import Path

import pytest
from typer.testing import CliRunner

from edge_ident.cli import app
from tests.processes import running

pytestmark = pytest.mark.real_time
BOARD = [sys.executable, "-m", "edge_ident", "board", "--pty", "--speed", "10", "--link"]


def test_a_link_leads_to_a_board_that_keeps_its_state_between_commands(tmp_path: Path) -> None:
    link = tmp_path / "board"
    link.symlink_to(tmp_path / "gone")  # of a board that was killed
    with running([*BOARD, str(link)], errors=None) as process:
        assert process.stdout is not None
        assert process.stdout.readline().strip() == str(link)
        moves = []
        for target in ("x=0.5", "x=0.2"):
            command = ["home", "--to", target, "--device", str(link), "--json"]
            done = CliRunner().invoke(app, command)
            assert done.exit_code == 0, done.stderr
            moves.append(json.loads(done.stdout)["axes"]["x"])
        assert abs(moves[1]["from_rad"] - moves[0]["reached_rad"]) < 0.01
    assert not link.is_symlink()


def test_the_stop_of_a_board_is_pressed_by_a_command(tmp_path: Path) -> None:
    link = tmp_path / "board"
    pressing = ["board", "--press-stop", "--link", str(link)]
    refused = CliRunner().invoke(app, pressing)
    assert refused.exit_code == 3
    assert "no board runs" in refused.stderr
    with running([*BOARD, str(link)], errors=None) as process:
        assert process.stdout is not None
        process.stdout.readline()
        assert CliRunner().invoke(app, pressing).exit_code == 0
        asked = ["registers", "status", "--device", str(link)]
        status = CliRunner().invoke(app, asked).stdout
    assert re.search(r"fault_code +STO\b", status)
    assert re.search(r"sto_latched +1\b", status)
    assert not list(tmp_path.iterdir())


def test_the_link_of_a_board_that_was_killed_gives_way_to_what_it_leads_to(tmp_path: Path) -> None:
    """A new pseudo-terminal gets the number of the old one."""
    link = tmp_path / "board"
    with running([*BOARD, str(link)], errors=None) as process:
        assert process.stdout is not None
        process.stdout.readline()
        process.kill()
    assert link.is_symlink()
    link.unlink()
    link.symlink_to("/dev/null")  # something is there again
    with running([*BOARD, str(link)], errors=None) as process:
        assert process.stdout is not None
        assert process.stdout.readline().strip() == str(link)


def test_a_link_takes_no_name_that_is_in_use(tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    done = CliRunner().invoke(app, ["board", "--pty", "--link", str(tmp_path / "file")])
    assert done.exit_code == 5
    assert (tmp_path / "file").is_file()
    assert CliRunner().invoke(app, ["board", "--tcp", "0", "--link", "name"]).exit_code == 2


def test_a_served_board_identifies_by_itself(tmp_path: Path) -> None:
    with running([*BOARD, str(tmp_path / "board")], errors=None) as process:
        assert process.stdout is not None
        command = ["run", "--dry-run", "--json", "--device", process.stdout.readline().strip()]
        done = CliRunner().invoke(app, [*command, "--output", str(tmp_path / "run")])
        assert done.exit_code == 0, done.stderr
    said = json.loads(done.stdout)["board_identification"]
    assert {axis["verdict"] for axis in said["axes"].values()} == {"agrees"}
