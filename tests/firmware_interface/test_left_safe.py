"""What a host leaves behind when something goes wrong, and what it says about it."""

import signal
import sys
from collections.abc import Callable
from contextlib import suppress
from types import FrameType
from typing import Any

import pytest
from board_bench import NEW, OLD, Bench, long_motion

from edge_ident.commissioning import safety
from edge_ident.commissioning.safety import left_safe, ready_to_move
from edge_ident.support import process
from firmware_interface import board_session
from firmware_interface.board import Board
from firmware_interface.errors import BoardError, BusyError, NoReplyError
from firmware_interface.registers import REGISTERS, SESSION_LEASE_S, Opcode, State
from firmware_interface.virtual.board import VirtualBoard

COMMAND = REGISTERS["command.opcode"].address
KEY = REGISTERS["session.key"].address
BUSY = BusyError("the line refuses the request (Modbus exception 6)", "wait")
SILENCE = NoReplyError("no reply", "check cable and power of the board")


@pytest.fixture(autouse=True)
def impatient(monkeypatch: pytest.MonkeyPatch) -> None:
    """Ask the board as fast as it answers, its time goes by requests; and not for long."""
    monkeypatch.setattr(board_session, "POLL_S", 0.0)
    monkeypatch.setattr(safety, "_LEAVE_S", 0.2)


class Line:
    """A link on which something may happen before and after each write, or at a read."""

    def __init__(self, virtual: VirtualBoard) -> None:
        self._virtual = virtual
        self.reading: Callable[[], None] = lambda: None
        self.before: Callable[[int], None] = lambda address: None
        self.before_words: Callable[[int, list[int]], None] = lambda address, words: None
        self.after: Callable[[int], None] = lambda address: None

    def read(self, address: int, count: int) -> list[int]:
        self.reading()
        return self._virtual.read(address, count)

    def write(self, address: int, words: list[int]) -> None:
        self.before(address)
        self.before_words(address, words)
        self._virtual.write(address, words)
        self.after(address)

    def close(self) -> None: ...


class LineBench(Bench):
    """The same with a line between host and board."""

    def __init__(self) -> None:
        super().__init__()
        self.line = Line(self.virtual)
        self.board = Board.connect(self.line)


def once(error: Exception) -> Callable[..., None]:
    """Raises an error the first time it is called with nothing or with a command's address."""
    left = [error]

    def happen(address: int = COMMAND) -> None:
        if left and address == COMMAND:
            raise left.pop()

    return happen


def always(error: Exception) -> Callable[..., None]:
    def happen(address: int = COMMAND) -> None:
        raise error

    return happen


def notes_after(bench: Bench, body: Callable[[], None]) -> str:
    """What is noted on the error that a body ends with."""
    try:
        with left_safe(bench.board):
            body()
    except (RuntimeError, BoardError) as error:
        return "; ".join(getattr(error, "__notes__", []))
    raise AssertionError("it ended well")


def test_a_device_in_between_that_is_busy_does_not_leave_the_machine_moving() -> None:
    bench = LineBench()

    def body() -> None:
        bench.start(long_motion())
        bench.line.reading = once(BUSY)
        bench.board.status()

    assert notes_after(bench, body) == ""
    status = bench.board.status()
    assert (status.state, status.enabled) == (State.IDLE, False)


def test_a_board_that_another_host_has_taken_over_is_left_to_it() -> None:
    bench = LineBench()
    another = Board.connect(bench.virtual)

    def body() -> None:
        bench.board.enable()
        bench.wait(SESSION_LEASE_S + 0.1)
        another.write_trajectory(long_motion())
        another.arm()
        another.start()
        bench.board.heartbeat()

    assert notes_after(bench, body) == ""
    assert another.status().state is State.MOVING
    assert another.status().enabled


def test_a_command_that_was_carried_out_is_not_believed_to_be_refused() -> None:
    bench = LineBench()
    bench.board.claim()
    bench.line.after = once(BoardError("refused (Modbus exception 4)", "check"))
    bench.board.enable()
    assert bench.board.status().enabled


def test_a_command_that_never_came_is_refused_with_the_reason(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(board_session, "COMMAND_TIMEOUT_S", 0.0)
    bench = LineBench()
    bench.board.claim()
    bench.line.before = once(BoardError("refused (Modbus exception 4)", "check"))
    with pytest.raises(BoardError, match="exception 4"):
        bench.board.enable()
    assert not bench.board.status().enabled


@pytest.mark.parametrize("confirmed", [False, True])
def test_which_gains_are_in_force_is_said(confirmed: bool) -> None:
    bench = LineBench()
    bench.board.enable()

    def body() -> None:
        bench.commit()
        if confirmed:
            bench.board.confirm()
        raise RuntimeError

    said = notes_after(bench, body)
    assert said.startswith("new gains" if confirmed else "the gains of before")
    assert bench.board.active_gains() == (NEW if confirmed else OLD)


@pytest.mark.parametrize("committed", [False, True])
def test_a_board_that_no_longer_answers_may_still_make_effort(committed: bool) -> None:
    bench = LineBench()

    def body() -> None:
        bench.board.enable()
        if committed:
            bench.commit()
        bench.line.reading = bench.line.before = always(SILENCE)
        raise RuntimeError

    said = notes_after(bench, body)
    assert "may still produce effort" in said
    assert ("which gains are in force is not known" in said) == committed


def test_a_failure_that_leaves_everything_as_it_was_needs_no_note() -> None:
    bench = LineBench()

    def body() -> None:
        raise RuntimeError

    assert notes_after(bench, body) == ""


def test_effort_that_was_on_before_stays_on_and_that_is_said() -> None:
    bench, said = LineBench(), list[str]()
    bench.board.enable()
    with ready_to_move(bench.board, said.append):
        pass
    assert bench.board.status().enabled
    assert any("edge-ident stop switches the effort off" in line for line in said)


@pytest.mark.parametrize("on_before", [False, True])
def test_effort_that_was_off_before_is_said_to_be_off_again(on_before: bool) -> None:
    bench, said = LineBench(), list[str]()
    if on_before:
        bench.board.enable()
    with suppress(RuntimeError), ready_to_move(bench.board, said.append):
        raise RuntimeError
    assert ("axes disabled again" in said) != on_before
    assert bench.board.status().enabled == on_before


def test_effort_that_could_not_be_switched_off_is_not_said_to_be_off() -> None:
    bench, said = LineBench(), list[str]()
    with suppress(RuntimeError), ready_to_move(bench.board, said.append):
        bench.line.reading = bench.line.before = always(SILENCE)
        raise RuntimeError
    assert "axes disabled again" not in said


def _interrupted_at(step: int) -> Callable[[FrameType, str, Any], Any]:
    """Traces; at this line or call the signal's handler runs, as the interpreter would let it."""
    left = [step]

    def trace(frame: FrameType, event: str, argument: object) -> Any:
        left[0] -= 1
        if left[0] == 0:
            process._interrupt(signal.SIGINT, frame)
        return trace

    return trace


def test_ctrl_c_at_any_line_of_what_follows_an_error_leaves_the_effort_off(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Between an error and the stop lie lines of contextlib: Ctrl-C there skipped the stop."""
    monkeypatch.setattr(process, "_received", [])
    monkeypatch.setattr(process, "_again_soon", lambda: None)
    for step in range(1, 120):
        monkeypatch.setattr(process, "_quiet_until_s", 0.0)
        bench, before = LineBench(), sys.gettrace()
        try:
            with ready_to_move(bench.board, lambda text: None):
                sys.settrace(_interrupted_at(step))
                raise RuntimeError  # what is traced begins in the frames that this one leaves
        except (RuntimeError, KeyboardInterrupt):
            sys.settrace(before)
        assert not bench.board.status().enabled, f"interrupted at step {step}"


@pytest.mark.parametrize("error", [BUSY, SILENCE], ids=["busy", "silent"])
@pytest.mark.parametrize("opcode", [Opcode.QUICK_STOP, Opcode.DISABLE, None])
def test_one_reply_that_is_lost_or_busy_does_not_leave_the_effort_on(
    error: Exception, opcode: Opcode | None, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Of a command, or of the write of the key before it, where the hold is old."""
    monkeypatch.setattr(safety, "_LEAVE_S", 5.0)
    monkeypatch.setattr(board_session, "COMMAND_TIMEOUT_S", 0.0)
    bench, left = LineBench(), [error]

    def happen(address: int, words: list[int]) -> None:
        wanted = address == KEY if opcode is None else (address, words[0]) == (COMMAND, opcode)
        if wanted and left:
            raise left.pop()

    def body() -> None:
        bench.board.enable()
        bench.board._session._held_at_s -= 3.0
        bench.line.before_words = happen
        raise RuntimeError

    assert notes_after(bench, body) == ""
    assert not left
    assert not bench.board.status().enabled


def test_a_machine_that_stopped_although_no_reply_came_needs_no_note(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """What is said comes from the board's status, not from what became of each command."""
    monkeypatch.setattr(safety, "stop_at_once", lambda board: board.quick_stop() or False)
    bench = LineBench()

    def body() -> None:
        bench.board.enable()
        raise RuntimeError

    assert notes_after(bench, body) == ""


def test_a_hold_that_runs_out_as_the_effort_goes_off_is_nobodys_stop() -> None:
    bench, left = LineBench(), [SESSION_LEASE_S + 0.1]

    def held_up(address: int, words: list[int]) -> None:
        if (address, words[0]) == (COMMAND, Opcode.DISABLE) and left:
            bench.wait(left.pop())

    bench.board.enable()
    bench.line.before_words = held_up
    bench.board.disable()
    assert not left
    assert not bench.board.status().enabled
    bench.board.enable()
