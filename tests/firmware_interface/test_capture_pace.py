"""A line that is too slow for a motion is refused before anything moves, and no other line is.

Board and line share a simulated time: every request takes as long as this line's replies take, and
the board goes on meanwhile, whether or not its ring of pages is full.
"""

import time

import pytest

from edge_ident.commissioning.capture import capture_motion, check_recordable
from edge_ident.errors import LinkError
from firmware_interface.board import Board
from firmware_interface.capture_pages import CapturePace
from firmware_interface.motion import Multisine, SineComponent, Trajectory
from firmware_interface.registers import PAGE_SAMPLES, State
from firmware_interface.virtual.board import VirtualBoard
from firmware_interface.virtual.drive import SAMPLE_PERIOD_S
from firmware_interface.virtual.machine import Machine

FILLED_S = PAGE_SAMPLES * SAMPLE_PERIOD_S


class LineClock:
    """Time passes with every reply, and while somebody sleeps."""

    def __init__(self, reply_s: float) -> None:
        self.reply_s = reply_s
        self._samples = 0
        self._due = 0.0
        self.machine: Machine

    def now_s(self) -> float:
        return self._samples * SAMPLE_PERIOD_S

    def advance(self, machine: Machine, status_read: bool) -> None:
        self.machine = machine
        self.sleep(self.reply_s)

    def sleep(self, seconds: float) -> None:
        self._due += seconds / SAMPLE_PERIOD_S
        while self._due >= 1.0:
            self._due -= 1.0
            self._samples += 1
            self.machine.sample()

    def idle(self, machine: Machine) -> None:
        """Nobody asks in between."""


class SlowLine(VirtualBoard):
    """A board behind a line."""

    longest_reply_s = 0.0

    def once_clean(self) -> None:
        """Nothing gets lost on it."""


@pytest.fixture
def board(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> Board:
    """A board behind a line whose replies take so long."""
    clock = LineClock(request.param)
    line = SlowLine(clock=clock)
    monkeypatch.setattr(time, "monotonic", clock.now_s)
    monkeypatch.setattr(time, "sleep", clock.sleep)
    return Board.connect(line)


def motion(seconds: float) -> Trajectory:
    sine = Multisine((SineComponent(0.5, 1.0, 0.0),))
    return Trajectory({"x": sine, "z": sine}, duration_s=seconds, lead_in_s=1.0)


SLOW = pytest.mark.parametrize("board", [0.29], indirect=True)


@SLOW
def test_a_line_that_is_too_slow_is_refused_before_anything_moves(board: Board) -> None:
    with pytest.raises(LinkError) as refused:
        check_recordable(board, motion(22.0), None)
    assert "brings 1.7 capture pages a second, and at least 17.7 are needed" in str(refused.value)
    assert "a motion of at most 9 s can be recorded" in refused.value.next_step
    with pytest.raises(LinkError, match="too slow"):
        capture_motion(board, motion(22.0), lambda in_hand, expected: None)
    status = board.status()
    assert (status.state, status.samples_captured) == (State.IDLE, 0)


@SLOW
def test_a_motion_that_the_ring_holds_is_fetched_after_it(board: Board) -> None:
    """However slow the line, no sample is lost, and the time that it takes is said before."""
    said: list[str] = []
    times_s: list[float] = []
    board.enable()
    capture = capture_motion(
        board, motion(8.0), lambda *_: times_s.append(time.monotonic()), say=said.append
    )
    took_s = times_s[-1] - times_s[0]
    board.finish()
    assert len(capture.recording.time_s) == round(8.0 / SAMPLE_PERIOD_S)
    assert "of which the motion is 8 s" in said[-1]
    foretold_s = float(said[-1].partition("takes ")[2].partition(" s")[0])
    assert foretold_s == pytest.approx(took_s, rel=0.1)


@pytest.mark.parametrize("board", [0.003, 0.010, 0.025, 0.042], indirect=True)
def test_a_motion_that_is_not_refused_loses_no_sample(board: Board) -> None:
    board.enable()
    capture = capture_motion(board, motion(20.0), lambda *_: None, say=lambda text: None)
    board.finish()
    assert len(capture.recording.time_s) == round(20.0 / SAMPLE_PERIOD_S)


def test_a_board_whose_time_waits_for_the_host_is_never_too_slow() -> None:
    pace = Board.connect(VirtualBoard()).capture_pace(10**6)
    assert pace.keeps_up
    assert not pace.overwritten


@pytest.mark.parametrize("times", [1.1, 1.5, 3.0, 20.0])
def test_the_longest_motion_is_the_one_that_just_fits(times: float) -> None:
    longest_s = CapturePace(0, FILLED_S, times * FILLED_S).longest_s
    samples = longest_s / SAMPLE_PERIOD_S
    just = CapturePace.of(int(samples) - PAGE_SAMPLES, SAMPLE_PERIOD_S, times * FILLED_S)
    too_long = CapturePace.of(int(samples) + 2 * PAGE_SAMPLES, SAMPLE_PERIOD_S, times * FILLED_S)
    assert (just.overwritten, too_long.overwritten) == (False, True)
