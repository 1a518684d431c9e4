"""What a run does when things go wrong: gains end old, the machine at rest."""

import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from promised import design_always, promise_a_share

from edge_ident.commissioning import gain_transfer as gain_transfer
from edge_ident.commissioning.identification_motions import Plan
from edge_ident.commissioning.run import commission
from edge_ident.errors import BoardError, DataError, GainError
from firmware_interface.board import Board
from firmware_interface.gains import CONSERVATIVE_GAINS
from firmware_interface.registers import State
from firmware_interface.virtual.board import VirtualBoard
from firmware_interface.virtual.settings import BoardSettings
from tests.short_runs import Silent, brief_drive


class Impatient(Silent):
    """A user who presses Ctrl-C once a stage has begun and some samples are in."""

    def __init__(self, stage: str) -> None:
        self.wanted, self.current = stage, ""

    def stage(self, title: str) -> None:
        self.current = title

    def samples(self, in_hand: int, expected: int) -> None:
        if self.current == self.wanted and in_hand > 1000:
            raise KeyboardInterrupt


@pytest.fixture
def board() -> Board:
    return Board.connect(VirtualBoard())


def run(board: Board, folder: Path, observer: Silent | None = None, **plan: object):
    return commission(board, brief_drive(), None, Plan(**plan), folder, observer or Silent())


def assert_old_gains(board: Board) -> None:
    old = CONSERVATIVE_GAINS.numbers()
    assert board.active_gains()["x"].numbers() == pytest.approx(old, rel=1e-6)


def assert_old_gains_at_rest(board: Board) -> None:
    status = board.status()
    assert status.state is State.IDLE
    assert not status.unconfirmed
    assert_old_gains(board)


def test_least_squares_alone_carries_a_run(board: Board, tmp_path: Path) -> None:
    outcome = run(board, tmp_path)
    assert outcome.confirmed
    assert outcome.change is not None
    assert outcome.change.verification is not None
    assert min(of_axis.ratio for of_axis in outcome.change.verification.axes.values()) > 5
    assert board.active_gains()["x"].viscous_feedforward == pytest.approx(0.9, rel=0.05)


def test_gains_that_follow_worse_are_rolled_back(
    board: Board, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Whatever was promised of them."""
    design_always(replace(CONSERVATIVE_GAINS, proportional=15.0), monkeypatch)
    promise_a_share(monkeypatch, 0.5)
    outcome = run(board, tmp_path)
    assert not outcome.confirmed
    assert not outcome.good
    assert "increased the tracking error and were rolled back" in outcome.conclusion
    assert_old_gains_at_rest(board)


def test_gains_that_would_follow_worse_are_not_written(
    board: Board, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    design_always(replace(CONSERVATIVE_GAINS, proportional=15.0), monkeypatch)
    outcome = run(board, tmp_path)
    assert outcome.change is not None
    assert outcome.change.unchanged
    assert "would follow worse, axis x on the sinusoid" in outcome.conclusion
    assert_old_gains_at_rest(board)


def test_a_fault_during_verification_gives_the_old_gains_back(
    board: Board, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    design_always(replace(CONSERVATIVE_GAINS, proportional=2.0, derivative=1.0), monkeypatch)
    promise_a_share(monkeypatch, 0.5)
    with pytest.raises(BoardError, match="FOLLOWING_ERROR"):
        run(board, tmp_path)
    assert_old_gains(board)


@pytest.mark.parametrize(
    "stage",
    [
        "identification motion",
        "second motion, old gains",
        "verification motion",
        "second verification motion",
    ],
)
def test_interrupt_at_any_motion(board: Board, tmp_path: Path, stage: str) -> None:
    with pytest.raises(KeyboardInterrupt):
        run(board, tmp_path, Impatient(stage))
    assert_old_gains_at_rest(board)


def test_a_dry_run_promises_what_a_run_does_and_neither_moves_again_nor_stages(
    board: Board, tmp_path: Path
) -> None:
    dry = run(board, tmp_path, write=False)
    assert dry.designs
    assert dry.good
    assert not dry.confirmed
    assert_old_gains_at_rest(board)
    assert dry.change is not None
    assert dry.change.promise is not None
    assert {path.name for path in tmp_path.iterdir()} == {"capture.npz", "gains_before.json"}
    assert not board.status().staged_crc_ok
    done = run(Board.connect(VirtualBoard()), tmp_path)
    assert done.change is not None
    assert done.change.promise is not None
    for axis, tried in done.change.promise.motions["sinusoid"].items():
        forecast = dry.change.promise.motions["sinusoid"][axis]
        assert forecast.measured is None
        assert forecast.now == tried.now
    assert dry.conclusion.startswith("gains were designed and checked, nothing was written")
    assert "the forecast is a tracking error smaller by x " in dry.conclusion


def test_a_dry_run_says_that_a_run_would_write_nothing(
    board: Board, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    design_always(replace(CONSERVATIVE_GAINS, proportional=15.0), monkeypatch)
    outcome = run(board, tmp_path, write=False)
    would = "a run would end with 'nothing changed: new gains would follow worse, axis x on the"
    assert would in outcome.conclusion
    assert outcome.good


def test_no_motion_begins_whose_recording_has_no_room(
    board: Board, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    usage = shutil.disk_usage(tmp_path)._replace(free=100_000)
    monkeypatch.setattr(shutil, "disk_usage", lambda path: usage)
    monkeypatch.setattr(board, "enable", lambda: pytest.fail("the effort was switched on"))
    with pytest.raises(DataError, match="has 100 kB free") as caught:
        run(board, tmp_path)
    assert "this motion was not made" in caught.value.next_step
    assert board.status().samples_captured == 0
    assert_old_gains_at_rest(board)
    assert not list(tmp_path.iterdir())


def test_store_only_on_request(tmp_path: Path) -> None:
    link = VirtualBoard()
    outcome = run(Board.connect(link), tmp_path, store=True)
    assert outcome.stored
    assert link.machine.banks.stored["x"].viscous_feedforward > 0.8


def test_a_step_too_large_at_once_is_refused(board: Board) -> None:
    limits = {axis: replace(limit, gain_step=0.05) for axis, limit in board.limits().items()}
    wanted = {axis: replace(CONSERVATIVE_GAINS, proportional=100.0) for axis in ("x", "z")}
    with pytest.raises(GainError, match="proportional would change by 70 at once"):
        gain_transfer.check_gains(wanted, board.active_gains(), limits)


@pytest.mark.parametrize("value", [-1.0, np.nan, np.inf])
def test_senseless_gains_are_refused(board: Board, value: float) -> None:
    wanted = {"x": replace(CONSERVATIVE_GAINS, derivative=value)}
    with pytest.raises(GainError, match="derivative"):
        gain_transfer.check_gains(wanted, board.active_gains(), board.limits())


def test_a_difference_in_the_last_bit_is_seen() -> None:
    value = np.float32(0.43)
    read = float(np.nextafter(value, np.float32(1)))
    written = {"x": replace(CONSERVATIVE_GAINS, inertia_feedforward=float(value))}
    got = {"x": replace(CONSERVATIVE_GAINS, inertia_feedforward=read)}
    gain_transfer.compare_gains(written, written)
    with pytest.raises(BoardError, match="active inertia_feedforward reads back"):
        gain_transfer.compare_gains(written, got)


def test_many_cycles_do_not_outlast_the_window_to_confirm(tmp_path: Path) -> None:
    """Ten cycles take 55 s."""
    board = Board.connect(VirtualBoard(BoardSettings(confirm_window_s=25.0)))
    outcome = run(board, tmp_path, cycles=10)
    assert len(outcome.capture.recording.time_s) == 21855
    assert outcome.confirmed


def test_a_verification_longer_than_the_window_is_refused(tmp_path: Path) -> None:
    """Before anything is committed: 9 s for the first motion and 8 s for the second."""
    board = Board.connect(VirtualBoard(BoardSettings(confirm_window_s=10.0)))
    with pytest.raises(BoardError, match="verification motions take 17 s") as caught:
        run(board, tmp_path)
    assert "nothing was written" in caught.value.cause
    assert_old_gains_at_rest(board)
