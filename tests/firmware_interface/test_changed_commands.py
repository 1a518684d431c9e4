"""A command that the line changes into another one: the board carries that out, and says DONE."""

from collections.abc import Callable

import pytest
from board_bench import NEW, OLD, Bench, long_motion

from edge_ident.commissioning.gain_change import _confirm_or_roll_back, roll_back_unconfirmed
from firmware_interface import board_session
from firmware_interface.board import Board
from firmware_interface.errors import BoardError
from firmware_interface.registers import REGISTERS, Opcode, State

COMMAND = REGISTERS["command.opcode"].address


@pytest.fixture(autouse=True)
def impatient(monkeypatch: pytest.MonkeyPatch) -> None:
    """Ask the board as fast as it answers: its time goes by requests."""
    monkeypatch.setattr(board_session, "POLL_S", 0.0)


def change_next(
    bench: Bench, monkeypatch: pytest.MonkeyPatch, opcode: Opcode | None = None, key_bit: int = 0
) -> None:
    """Have the next command arrive as another one, or with another key."""
    write, left = bench.virtual.write, [opcode]

    def changed(address: int, words: list[int]) -> None:
        if address == COMMAND and left:
            words = [left.pop() or words[0], *words[1:-1], words[-1] ^ key_bit]
        write(address, words)

    monkeypatch.setattr(bench.virtual, "write", changed)


def committed() -> Bench:
    bench = Bench()
    bench.board.enable()
    bench.commit()
    return bench


def test_effort_that_stays_off_or_on_is_not_believed(monkeypatch: pytest.MonkeyPatch) -> None:
    bench = Bench()
    change_next(bench, monkeypatch, Opcode.QUICK_STOP)
    with pytest.raises(BoardError, match="ENABLE had no effect"):
        bench.board.enable()
    bench.board.enable()
    change_next(bench, monkeypatch, Opcode.ENABLE)
    with pytest.raises(BoardError, match="DISABLE had no effect"):
        bench.board.disable()


@pytest.mark.parametrize("verb", [Board.confirm, Board.roll_back])
def test_gains_that_still_wait_are_neither_kept_nor_taken_back(
    verb: Callable[[Board], None], monkeypatch: pytest.MonkeyPatch
) -> None:
    bench = committed()
    change_next(bench, monkeypatch, Opcode.DISABLE)
    with pytest.raises(BoardError, match="had no effect"):
        verb(bench.board)


@pytest.mark.parametrize("keep", [True, False])
def test_the_gains_in_force_decide_and_not_the_word_of_the_board(
    keep: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    bench = committed()
    change_next(bench, monkeypatch, Opcode.ROLL_BACK if keep else Opcode.CONFIRM)
    with pytest.raises(BoardError, match="reads back as"):
        _confirm_or_roll_back(bench.board, NEW if keep else OLD, keep=keep)


def test_a_roll_back_that_changed_nothing_is_said(monkeypatch: pytest.MonkeyPatch) -> None:
    bench = committed()
    change_next(bench, monkeypatch, Opcode.CONFIRM)
    with pytest.raises(BoardError, match="the same as before"):
        roll_back_unconfirmed(bench.board)
    bench = committed()
    roll_back_unconfirmed(bench.board)
    assert bench.board.active_gains() == OLD


def test_a_fault_that_stays_is_not_cleared(monkeypatch: pytest.MonkeyPatch) -> None:
    bench = Bench()
    bench.virtual.inputs.press_stop()
    bench.wait(0.1)
    bench.virtual.inputs.release_stop()
    change_next(bench, monkeypatch, Opcode.QUICK_STOP)
    with pytest.raises(BoardError, match="fault STO"):
        bench.board.clear_fault()


def test_a_stop_that_was_none_is_seen_at_once(monkeypatch: pytest.MonkeyPatch) -> None:
    bench = Bench()
    bench.start(long_motion())
    change_next(bench, monkeypatch, Opcode.ENABLE)
    with pytest.raises(BoardError):
        bench.board.quick_stop()
    bench.board.quick_stop()
    assert bench.board.status().state is State.IDLE


def test_a_store_that_was_none_is_made_good(monkeypatch: pytest.MonkeyPatch) -> None:
    bench = committed()
    bench.board.confirm()
    change_next(bench, monkeypatch, Opcode.DISABLE)
    bench.board.store()
    assert bench.virtual.machine.banks.stored == NEW
    assert bench.board.status().stores == 1


@pytest.mark.parametrize("verb", [Board.confirm, Board.roll_back, Board.disable])
def test_a_command_with_a_key_that_the_line_changed_is_given_again(
    verb: Callable[[Board], None], monkeypatch: pytest.MonkeyPatch
) -> None:
    bench = committed()
    change_next(bench, monkeypatch, key_bit=0x100)
    verb(bench.board)
    assert bench.board.holds
