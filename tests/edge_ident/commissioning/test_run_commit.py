"""How a run puts its gains in force: without a stop where the board can, else as ever."""

import shutil
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import pytest

from edge_ident.commissioning.gain_transfer import load_gains
from edge_ident.commissioning.identification_motions import Plan
from edge_ident.commissioning.run import Outcome, commission
from edge_ident.report.gains import commit_document
from firmware_interface.board import Board
from firmware_interface.gains import Bank
from firmware_interface.registers import AXES, Result, State
from firmware_interface.virtual.board import VirtualBoard
from firmware_interface.virtual.controller import Setpoint, Transfer
from firmware_interface.virtual.drive import Drive
from firmware_interface.virtual.settings import DEFAULT_LIMITS, BoardSettings
from tests.short_runs import Listening, brief_drive

STOP = "gains are committed at rest"


def run(virtual: VirtualBoard, folder: Path) -> tuple[Outcome, list[str]]:
    """With the built-in drive on a brief motion; and what the person is told."""
    board, observer = Board.connect(virtual), Listening()
    try:
        return commission(board, brief_drive(), None, Plan(), folder, observer), observer.said
    finally:
        board.close()


def limited(jump_nm: float) -> VirtualBoard:
    limits = dict.fromkeys(AXES, replace(DEFAULT_LIMITS, effort_jump_nm=jump_nm))
    return VirtualBoard(BoardSettings(limits=limits))


def test_a_run_commits_without_a_stop(tmp_path: Path) -> None:
    virtual = VirtualBoard()
    outcome, said = run(virtual, tmp_path)
    assert outcome.confirmed
    assert outcome.change is not None
    committed = commit_document(outcome.change)
    assert committed is not None
    assert committed["running"]
    assert committed["refused"] is None
    assert max(map(abs, committed["jump_nm"].values())) <= DEFAULT_LIMITS.effort_jump_nm
    assert not any(STOP in line for line in said)
    assert virtual.machine.state is State.IDLE
    assert not virtual.machine.enabled


def test_the_old_gains_are_on_disk_when_new_ones_are_written(tmp_path: Path) -> None:
    class Tidy(Listening):
        """Somebody who removes the folder during the first motion."""

        removed = False

        def samples(self, in_hand: int, expected: int) -> None:
            if not self.removed:
                shutil.rmtree(tmp_path / "run")
            self.removed = True

    virtual = VirtualBoard()
    board = Board.connect(virtual)
    old = board.active_gains()
    (tmp_path / "run").mkdir()
    assert commission(board, brief_drive(), None, Plan(), tmp_path / "run", Tidy()).confirmed
    assert load_gains(tmp_path / "run" / "gains_before.json").gains == old


def test_where_the_effort_would_jump_too_far_a_run_stops_and_says_so(tmp_path: Path) -> None:
    virtual = VirtualBoard()
    handover = virtual.machine.handover
    considered = handover.considered

    def at_rest_alone(
        drive: Drive, gains: Bank, setpoints: Sequence[Setpoint], *, moving: bool
    ) -> Transfer | None:
        if handover.offered is None:
            return considered(drive, gains, setpoints, moving=moving)
        handover.end(Result.EFFORT_JUMP)
        return None

    handover.considered = at_rest_alone  # type: ignore[method-assign]
    outcome, said = run(virtual, tmp_path)
    assert outcome.confirmed
    committed = commit_document(outcome.change)
    assert committed is not None
    assert not committed["running"]
    assert committed["refused"] == "EFFORT_JUMP"
    assert sum(STOP in line for line in said) == 1


@pytest.mark.parametrize(
    "virtual",
    [VirtualBoard(BoardSettings(map_version=4)), limited(0.0)],
    ids=["map 4", "switched off"],
)
def test_a_board_that_cannot_is_driven_with_the_stop(virtual: VirtualBoard, tmp_path: Path) -> None:
    outcome, said = run(virtual, tmp_path)
    assert outcome.confirmed
    assert commit_document(outcome.change) == {"running": False, "jump_nm": None, "refused": None}
    assert not any(STOP in line for line in said)


def test_nothing_written_has_no_commit() -> None:
    assert commit_document(None) is None
