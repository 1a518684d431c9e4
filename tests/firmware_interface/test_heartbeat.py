"""Signs of life come from a thread of their own, and tell a busy computer from a bad cable."""

import threading
import time
from collections.abc import Iterator

import pytest
from board_bench import long_motion

from firmware_interface import link
from firmware_interface.board import Board
from firmware_interface.errors import (
    BoardError,
    NoReplyError,
    RestartedError,
    SilentError,
    StoppedError,
)
from firmware_interface.link import Heartbeat
from firmware_interface.registers import REGISTERS, Fault, State
from firmware_interface.virtual.board import VirtualBoard, WallClock

KEY = REGISTERS["session.key"].address
SOON_S = 60.0
"""For what is sure to come: no test fails because the computer is busy."""


class NearLine(VirtualBoard):
    """A board behind a line without faults, on which time passes; counts signs of life."""

    def __init__(self, speed: float = 1.0) -> None:
        super().__init__(clock=WallClock(speed))
        self.longest_reply_s, self.once_clean = 0.0, lambda: None
        self.signs: list[int] = []
        self.sign = threading.Event()
        self.fails: Exception | None = None

    def read(self, address: int, count: int) -> list[int]:
        self.idle()  # a server would
        return super().read(address, count)

    def write(self, address: int, words: list[int]) -> None:
        self.idle()
        if address == KEY and len(words) > 2:
            if self.fails is not None:
                raise self.fails
            self.signs.append(threading.get_ident())
            self.sign.set()
        super().write(address, words)

    def next_sign(self) -> None:
        """Wait for another sign of life."""
        self.sign.clear()
        assert self.sign.wait(SOON_S)


@pytest.fixture
def line() -> NearLine:
    line = NearLine()
    while line.machine.busy:  # until it is sure that the axes stand
        line.idle()
    return line


@pytest.fixture
def board(line: NearLine) -> Iterator[Board]:
    """A host that holds the board, and whose signs of life are due often."""
    board = Board.connect(line)
    board.write_register("watchdog.timeout", 0.1)
    board.claim()
    with board.beating():
        yield board


def test_signs_of_life_come_while_the_host_computes(board: Board, line: NearLine) -> None:
    """Python code that never waits for anything holds them up no more than a wait does."""
    line.next_sign()
    line.sign.clear()
    while not line.sign.is_set():
        sum(range(1000))
    assert threading.get_ident() not in line.signs


def test_a_motion_goes_on_while_the_host_computes(board: Board, line: NearLine) -> None:
    board.enable()
    board.write_trajectory(long_motion())
    board.arm()
    board.start()
    for _ in range(20):  # five times as long as the watchdog waits
        line.next_sign()
    assert board.status().state is State.MOVING
    board.quick_stop()


def looks(board: Board, number: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """Wait until the thread has looked so often whether a sign is due."""
    looked, enough = [0], threading.Event()
    give_sign = board._session.give_sign

    def counted() -> None:
        give_sign()
        looked[0] += 1
        if looked[0] == number:
            enough.set()

    assert board._heartbeat is not None
    monkeypatch.setattr(board._heartbeat, "_beat", counted)
    assert enough.wait(SOON_S)


def test_a_board_that_was_let_go_hears_nothing(
    board: Board, line: NearLine, monkeypatch: pytest.MonkeyPatch
) -> None:
    line.next_sign()
    board.release()
    given = len(line.signs)
    looks(board, 20, monkeypatch)
    assert len(line.signs) == given
    assert board.status().session_remaining_s == 0.0


def test_a_host_that_was_stopped_is_told_by_what_it_asks(
    board: Board, line: NearLine, monkeypatch: pytest.MonkeyPatch
) -> None:
    line.next_sign()
    with board._session._lock:  # one line for both hosts
        Board.connect(line).quick_stop()
    looks(board, 10, monkeypatch)
    assert not board.holds
    with pytest.raises(StoppedError):
        board.enable()


def test_a_restart_that_the_thread_meets_is_told_once(
    board: Board, line: NearLine, monkeypatch: pytest.MonkeyPatch
) -> None:
    line.fails = RestartedError(board._session._nonce)
    looks(board, 10, monkeypatch)
    with pytest.raises(RestartedError):
        board.status()
    assert board.status().state is State.IDLE


def test_a_board_whose_time_waits_needs_no_thread() -> None:
    board = Board.connect(VirtualBoard())
    before = threading.active_count()
    with board.beating():
        assert threading.active_count() == before


def test_the_thread_ends_with_the_body(line: NearLine) -> None:
    board = Board.connect(line)
    before = threading.active_count()
    with board.beating():
        assert threading.active_count() == before + 1
        with board.beating():
            assert threading.active_count() == before + 1
    assert threading.active_count() == before


# ---- what was measured


def test_a_watchdog_that_expired_says_what_this_host_measured(line: NearLine) -> None:
    """Signs of life are lost on the line."""
    board = Board.connect(line)

    def cut_off() -> None:
        with board.beating():
            board.enable()
            board.write_trajectory(long_motion())
            board.arm()
            board.start()
            line.fails = NoReplyError("no reply", "check cable and power of the board")
            line.longest_reply_s = 0.75
            list(board.capture_pages())

    with pytest.raises(SilentError) as told:
        cut_off()
    assert "the host that started the motion fell silent" in told.value.cause
    assert "the slowest request took 0.75 s" in told.value.cause
    assert "this process did not run for 0." in told.value.cause
    assert "cable" in told.value.next_step


def test_a_computer_that_was_busy_is_no_bad_cable() -> None:
    error = SilentError("fault WATCHDOG at sample 7: silence", "do something")
    error.measured(0.9, 0.02)
    assert "this process did not run for 0.90 s" in error.cause
    assert "programs that load this computer" in error.next_step
    assert "cable" not in error.next_step
    assert isinstance(error, BoardError)


class HeldUp:
    """Wakes later than asked for, by these times, then ends."""

    def __init__(self, late_s: list[float]) -> None:
        self.now_s = 100.0
        self._late_s = late_s

    def wait(self, seconds: float) -> bool:
        if not self._late_s:
            return True
        self.now_s += seconds + self._late_s.pop(0)
        return False


def test_the_longest_time_that_the_process_did_not_run_is_measured(
    line: NearLine, monkeypatch: pytest.MonkeyPatch
) -> None:
    held_up = HeldUp([0.0, 0.9, 0.01])
    monkeypatch.setattr(link.time, "monotonic", lambda: held_up.now_s)
    beats = Heartbeat(line, lambda: None, lambda: 0.25)
    beats._ended = held_up  # type: ignore[assignment]
    thread = threading.Thread(target=beats._run)
    thread.start()
    thread.join()
    assert beats.silence == pytest.approx((0.9, 0.0, 0))
    beats.measure_anew()
    assert beats.silence == (0.0, 0.0, 0)


# ---- a virtual board on a busy computer


class WallTime:
    """Goes on by itself while a test gets ready, then as the test says."""

    def __init__(self) -> None:
        self.now_s, self.step_s = 1000.0, 0.001

    def monotonic(self) -> float:
        self.now_s += self.step_s
        return self.now_s


@pytest.fixture
def wall(monkeypatch: pytest.MonkeyPatch) -> WallTime:
    wall = WallTime()
    monkeypatch.setattr(time, "monotonic", wall.monotonic)
    return wall


@pytest.fixture
def moving(wall: WallTime) -> VirtualBoard:
    """A board that moves, just heard by its host, and at whose clock nobody looks."""
    virtual = VirtualBoard(clock=WallClock(1.0))
    board = Board.connect(virtual)
    board.enable()
    board.write_trajectory(long_motion())
    board.arm()
    board.start()
    wall.step_s = 0.0
    board.heartbeat()
    return virtual


def test_time_in_which_a_board_was_held_up_is_no_silence_of_its_host(
    moving: VirtualBoard, wall: WallTime
) -> None:
    before = moving.machine.samples
    for _ in range(5):  # each for longer than the watchdog waits
        wall.now_s += 10.0
        moving.idle()
    assert moving.machine.state is State.MOVING
    assert moving.machine.samples - before <= 5 * 0.05 / 0.0025


def test_a_host_that_is_silent_while_the_board_runs_is_stopped_in_time(
    moving: VirtualBoard, wall: WallTime
) -> None:
    silent_s = 0.0
    while moving.machine.state is State.MOVING and silent_s < 5.0:
        wall.now_s += 0.005
        silent_s += 0.005
        moving.idle()
    assert silent_s == pytest.approx(1.0, abs=0.02)
    assert moving.machine.fault is Fault.WATCHDOG
