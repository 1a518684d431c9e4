"""The life of a board's gains, through the command line."""

import json
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner

from edge_ident import commissioning
from edge_ident.cli import app
from edge_ident.signals.recording_files import save_recording
from edge_ident.simulation.simulate import simulate
from firmware_interface.board import Board
from firmware_interface.errors import BoardError
from firmware_interface.gains import CONSERVATIVE_GAINS, AxisGains
from firmware_interface.registers import State
from firmware_interface.virtual.settings import BoardSettings
from tests.edge_ident.shared_board import SharedBoard

BETTER = replace(
    CONSERVATIVE_GAINS,
    proportional=100.0,
    derivative=12.0,
    inertia_feedforward=0.4,
    viscous_feedforward=0.8,
    coulomb_feedforward=1.2,
)


@pytest.fixture
def shared(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> SharedBoard:
    monkeypatch.setenv("EDGE_IDENT_BACKUPS", str(tmp_path / "backups"))
    return SharedBoard(monkeypatch, BoardSettings(serial_number=42))


def gains_file(folder: Path, gains: AxisGains, **more: object) -> Path:
    path = folder / "gains.json"
    axes = dict.fromkeys(("x", "z"), asdict(gains))
    path.write_text(
        json.dumps(
            {"schema": "edge-ident/gain-backup/1", "serial_number": 42, "axes": axes, **more}
        )
    )
    return path


def test_designed_gains_say_where_they_are_and_how_they_get_to_a_board(tmp_path: Path) -> None:
    save_recording(simulate(), tmp_path / "recording.npz")
    command = ["gains", str(tmp_path / "recording.npz"), "--output", str(tmp_path)]
    done = CliRunner().invoke(app, command)
    assert done.exit_code == 0, done.output
    file = tmp_path / "gains.json"
    assert f"written: {file}; write them to a board with: edge-ident gains stage {file}" in (
        done.stderr
    )


def test_staging_on_a_board_of_the_command_s_own_says_that_it_ends(tmp_path: Path) -> None:
    """Its next step must not be a commit, which would find another board."""
    command = ["gains", "stage", str(gains_file(tmp_path, BETTER)), "--device", "virtual"]
    done = CliRunner().invoke(app, [*command, "--backups", str(tmp_path)])
    assert done.exit_code == 0
    assert "edge-ident board --pty" in done.stderr
    assert "gains commit" not in done.stderr


def backups(folder: Path) -> list[Path]:
    return sorted((folder / "backups").glob("*.json"))


def test_from_staging_to_permanent_memory_and_back(shared: SharedBoard, tmp_path: Path) -> None:
    file = gains_file(tmp_path, BETTER)
    assert shared.json("gains", "show")["axes"]["x"]["new"] is None
    staged = shared.json("gains", "stage", file)
    assert staged["axes"]["z"]["active"]["proportional"] == 30.0
    assert shared.json("gains", "show")["axes"]["x"]["new"]["proportional"] == 100.0
    assert shared.board.active_gains()["x"].proportional == 30.0

    committed = shared.json("gains", "commit")
    assert committed["confirmed"]
    assert Path(committed["backup"]).name.startswith("board-42-")
    tracking = committed["axes"]["x"]["tracking_rms_rad"]
    assert tracking["after"] < 0.2 * tracking["before"]
    assert not shared.board.status().unconfirmed

    banks = shared.virtual.machine.banks
    assert banks.stored["x"].proportional == 30.0
    shared.json("gains", "store")
    assert banks.stored["x"].proportional == 100.0

    restored = shared.json("gains", "restore", staged["backup"])
    assert restored["confirmed"]
    assert restored["axes"]["x"]["tracking_rms_rad"]["before"] is None
    assert shared.board.active_gains()["x"].numbers() == pytest.approx(
        CONSERVATIVE_GAINS.numbers(), rel=1e-6
    )


def test_gains_that_would_follow_worse_are_not_written(shared: SharedBoard, tmp_path: Path) -> None:
    softer = replace(CONSERVATIVE_GAINS, proportional=15.0)
    shared.json("gains", "stage", gains_file(tmp_path, softer))
    found = shared.json("gains", "commit")
    assert found["unchanged"]
    low, high = found["promise"]["x"]["sinusoid"]["interval"]["rms_rad"]
    assert low > found["promise"]["x"]["sinusoid"]["now"]["rms_rad"]
    assert high > low
    assert found["promise"]["x"]["sinusoid"]["measured"] is None
    assert shared.board.active_gains()["x"].proportional == 30.0
    assert not shared.board.status().unconfirmed


@pytest.mark.parametrize(
    "gains",
    [
        replace(CONSERVATIVE_GAINS, proportional=151.0),
        replace(CONSERVATIVE_GAINS, derivative=0.79),
        replace(CONSERVATIVE_GAINS, integral=1.0),
        replace(CONSERVATIVE_GAINS, velocity_filter_s=0.0),
    ],
)
def test_steps_beyond_five_times_need_a_word(
    shared: SharedBoard, tmp_path: Path, gains: AxisGains
) -> None:
    file = gains_file(tmp_path, gains)
    code, _, errors = shared.run("gains", "stage", file)
    assert code == 1
    assert "factor of 5" in errors
    assert "--large-steps" in errors
    assert not shared.board.status().staged_crc_ok
    assert not backups(tmp_path)
    shared.json("gains", "stage", file, "--large-steps")
    assert shared.run("gains", "commit")[0] == 1  # the word is asked for again


def test_the_boards_own_limits_stand_above_any_word(shared: SharedBoard, tmp_path: Path) -> None:
    file = gains_file(tmp_path, replace(CONSERVATIVE_GAINS, proportional=601.0))
    code, _, errors = shared.run("gains", "stage", file, "--large-steps")
    assert code == 1
    assert "outside the board's limits" in errors


def test_a_commit_without_anything_staged(shared: SharedBoard) -> None:
    code, _, errors = shared.run("gains", "commit")
    assert code == 4
    assert "no gains are staged" in errors


def test_a_commit_of_the_gains_in_force_moves_nothing(shared: SharedBoard) -> None:
    board = shared.board
    board.stage_gains(board.active_gains())
    board.release()
    code, _, errors = shared.run("gains", "commit")
    assert code == 4
    assert "in force already" in errors
    assert "gains stage" in errors
    assert not shared.board.status().pages_written


def test_rollback_takes_back_what_a_dead_host_left(shared: SharedBoard, tmp_path: Path) -> None:
    board = shared.board
    board.stage_gains(dict.fromkeys(("x", "z"), BETTER))
    board.commit()
    assert shared.json("gains", "show")["unconfirmed_s"] > 100.0
    shared.json("gains", "rollback")
    assert shared.board.active_gains()["x"].proportional == 30.0
    code, _, errors = shared.run("gains", "rollback")
    assert code == 4
    assert "gains restore" in errors


@pytest.mark.parametrize("verb", ["stage", "store"])
def test_gains_that_wait_to_be_confirmed_are_no_gains_to_go_by(
    shared: SharedBoard, verb: str, tmp_path: Path
) -> None:
    board = shared.board
    board.stage_gains(dict.fromkeys(("x", "z"), BETTER))
    board.commit()
    board.release()
    staged = board.staged_gains()
    file = [gains_file(tmp_path, CONSERVATIVE_GAINS)] if verb == "stage" else []
    code, _, errors = shared.run("gains", verb, *file)
    assert (code, backups(tmp_path)) == (4, [])
    assert "wait to be confirmed" in errors
    assert shared.board.staged_gains() == staged


@pytest.mark.parametrize("verb", ["stage", "store"])
def test_no_other_host_has_the_board_while_its_gains_are_looked_at(
    shared: SharedBoard, verb: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    other, back_up = shared.board, commissioning.gain_transfer.back_up

    def held(*gains: Any) -> Path:
        assert other.held_by_another()
        return back_up(*gains)

    monkeypatch.setattr(commissioning.gain_transfer, "back_up", held)
    file = [gains_file(tmp_path, BETTER)] if verb == "stage" else []
    code, _, errors = shared.run("gains", verb, *file)
    assert (code, len(backups(tmp_path))) == (0, 1), errors


def test_a_backup_of_another_board_is_not_restored(shared: SharedBoard, tmp_path: Path) -> None:
    code, _, errors = shared.run("gains", "restore", gains_file(tmp_path, BETTER, serial_number=41))
    assert code == 5
    assert "backup is of board 41" in errors
    assert not shared.board.status().staged_crc_ok


def test_a_fault_in_the_motion_after_a_restore_leaves_the_gains_of_before(
    shared: SharedBoard, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from edge_ident.commissioning import gain_change as gain_change

    def fault(*_: object) -> None:
        raise BoardError("an axis fell too far behind", "look at it")

    monkeypatch.setattr(gain_change, "verification_motion", fault)
    code, _, errors = shared.run("gains", "restore", gains_file(tmp_path, BETTER))
    assert code == 4
    assert "too far behind" in errors
    status = shared.board.status()
    assert status.state is State.IDLE
    assert not status.unconfirmed
    assert shared.board.active_gains()["x"].proportional == 30.0


def test_diff_writes_nothing(shared: SharedBoard, tmp_path: Path) -> None:
    code, text, _ = shared.run("gains", "diff", gains_file(tmp_path, BETTER))
    assert code == 0
    assert "× 3.33" in text
    assert "+1.2" in text
    assert not shared.board.status().staged_crc_ok
    assert not backups(tmp_path)


@pytest.mark.parametrize("verb", [[], ["design"]])
def test_a_file_without_a_verb_is_designed_from(verb: list[str], tmp_path: Path) -> None:
    result = CliRunner().invoke(app, ["gains", *verb, "--json", str(tmp_path / "absent.csv")])
    assert result.exit_code == 5
    assert "give the path of a recording (.csv, " in json.loads(result.stdout)["next_step"]


def test_gains_of_another_board_are_staged_and_named_as_such(
    shared: SharedBoard, tmp_path: Path
) -> None:
    file = gains_file(tmp_path, BETTER, serial_number=77)
    _, _, messages = shared.run("gains", "stage", file)
    assert "these are the gains of board 77, and this is board 42" in messages
    _, _, messages = shared.run("gains", "stage", gains_file(tmp_path, BETTER, serial_number=42))
    assert "these are the gains of board" not in messages


@pytest.mark.parametrize(
    ("verb", "done"),
    [("store", "the gains are stored"), ("rollback", "the previous gains are in force")],
)
def test_what_was_done_is_noted_where_ctrl_c_comes_as_the_board_is_let_go(
    verb: str, done: str, shared: SharedBoard, monkeypatch: pytest.MonkeyPatch
) -> None:
    board = shared.board
    board.enable()
    board.stage_gains(dict.fromkeys(("x", "z"), BETTER))
    board.commit()
    if verb == "store":
        board.confirm()
    board.release()

    def interrupted(self: Board) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(Board, "release", interrupted)
    code, _, messages = shared.run("gains", verb)
    assert (code, f"note:  {done}" in messages) == (130, True)
