"""What was staged outlasts another use of the shadow bank, and is not committed for nothing."""

from collections.abc import Callable
from dataclasses import replace

import pytest
from interrupted_link import InterruptedLink, Killed
from old_gains import assert_old_gains

from edge_ident.commissioning.gain_transfer import confirm_window_s, staged_kept, staged_whole
from edge_ident.commissioning.safety import left_safe
from edge_ident.errors import BoardError
from firmware_interface import board_session
from firmware_interface.board import Board
from firmware_interface.errors import EdgeIdentError, NoReplyError, StoppedError
from firmware_interface.gains import CONSERVATIVE_GAINS
from firmware_interface.registers import REGISTERS, Opcode
from firmware_interface.virtual.board import VirtualBoard

COMMAND = REGISTERS["command.opcode"].address
STAGED = 35.0


class Losing:
    """A link that loses the first command of a kind, and after it all there is or nothing."""

    def __init__(self, virtual: VirtualBoard, opcode: Opcode, *, dead: bool) -> None:
        self._virtual, self._opcode, self._dead = virtual, opcode, dead
        self.lost = False

    def read(self, address: int, count: int) -> list[int]:
        if self.lost and self._dead:
            raise NoReplyError("no reply", "check cable and power of the board")
        return self._virtual.read(address, count)

    def write(self, address: int, words: list[int]) -> None:
        strikes = address == COMMAND and words[0] == self._opcode and not self.lost
        self.lost |= strikes
        if strikes or (self.lost and self._dead):
            raise NoReplyError("no reply", "check cable and power of the board")
        self._virtual.write(address, words)

    def close(self) -> None: ...


@pytest.fixture(autouse=True)
def impatient(monkeypatch: pytest.MonkeyPatch) -> None:
    """Ask the board as fast as it answers: its time goes by requests."""
    monkeypatch.setattr(board_session, "POLL_S", 0.0)


@pytest.fixture
def virtual() -> VirtualBoard:
    """A board on which gains are staged."""
    virtual = VirtualBoard()
    gains = replace(CONSERVATIVE_GAINS, proportional=STAGED)
    board = Board.connect(virtual)
    board.stage_gains(dict.fromkeys(("x", "z"), gains))
    board.release()
    return virtual


def staged(virtual: VirtualBoard) -> float:
    return Board.connect(virtual).staged_gains()["x"].proportional


def notes(body: Callable[[], object], ends_with: type[BaseException]) -> str:
    with pytest.raises(ends_with) as caught:
        body()
    return "; ".join(getattr(caught.value, "__notes__", []))


def test_asking_for_the_window_changes_nothing(virtual: VirtualBoard) -> None:
    assert confirm_window_s(Board.connect(virtual)) == pytest.approx(120.0, abs=1.0)
    assert_old_gains(virtual)
    assert staged(virtual) == STAGED


def check_kept(virtual: VirtualBoard, board: Board, error: type[BaseException]) -> None:
    """A question for the window that ends in an error changes neither bank, and says nothing."""

    def body() -> None:
        with left_safe(board):
            confirm_window_s(board)

    assert "staged" not in notes(body, error)
    assert_old_gains(virtual)
    assert staged(virtual) == STAGED


@pytest.mark.parametrize("opcode", [Opcode.COMMIT, Opcode.ROLL_BACK])
def test_a_command_that_is_lost_meanwhile_leaves_what_was_staged(
    virtual: VirtualBoard, opcode: Opcode
) -> None:
    board = Board.connect(Losing(virtual, opcode, dead=False))
    check_kept(virtual, board, EdgeIdentError)


def test_ctrl_c_meanwhile_leaves_what_was_staged(virtual: VirtualBoard) -> None:
    link = InterruptedLink(virtual, "asking for the window", KeyboardInterrupt)
    link.starts = 1
    check_kept(virtual, Board.connect(link), KeyboardInterrupt)


def test_where_the_line_is_dead_or_another_host_has_the_board_the_loss_is_said(
    virtual: VirtualBoard,
) -> None:
    dead = Board.connect(Losing(virtual, Opcode.ROLL_BACK, dead=True))
    assert "stage them again" in notes(lambda: confirm_window_s(dead), EdgeIdentError)
    stopped = Board.connect(virtual)

    def body() -> None:
        with staged_kept(stopped):
            raise StoppedError("another host has stopped this one")

    assert "stage them again" in notes(body, StoppedError)


def test_nothing_is_said_of_gains_that_nobody_staged() -> None:
    dead = Board.connect(Losing(VirtualBoard(), Opcode.ROLL_BACK, dead=True))
    assert notes(lambda: confirm_window_s(dead), EdgeIdentError) == ""


def test_gains_in_force_are_no_staged_gains_whoever_left_them_there(
    virtual: VirtualBoard,
) -> None:
    """A host that dies while it asks for the window has the bank hold them."""
    link = InterruptedLink(virtual, "asking for the window", Killed)
    link.starts = 1
    with pytest.raises(Killed):
        confirm_window_s(Board.connect(link))
    board = Board.connect(virtual)
    board.roll_back()
    with pytest.raises(BoardError, match="in force already") as caught:
        staged_whole(board, board.active_gains())
    assert "gains stage" in caught.value.next_step
