"""What happens to the board while a host is at work, on a real pseudo-terminal: it is reset, its
clock wraps around, it gets ahead of the host, its power is cut in the middle of a gain write."""

import subprocess
import time
from collections.abc import Callable, Iterator
from contextlib import closing, contextmanager, suppress
from pathlib import Path

import pytest
from board_bench import NEW, OLD
from conformance_boards import BoardCommand, c_command, serving, until_abandoned
from fault_line import FaultyLine, Pace, Sender
from fault_proxy import FaultProxy
from pty_bench import PtyBench, connected_board, pty_bench

from edge_ident.commissioning.capture import capture_motion
from edge_ident.commissioning.gain_transfer import write_gains
from edge_ident.commissioning.safety import left_safe, make_ready, ready_to_move
from firmware_interface.board import Board
from firmware_interface.errors import BoardError, EdgeIdentError, LinkError
from firmware_interface.gains import AxisGains
from firmware_interface.motion import Multisine, SineComponent, Trajectory
from firmware_interface.registers import State

SINE = Multisine((SineComponent(0.4, 1.0, 0.0),))
SHORT = Trajectory({"x": SINE, "z": SINE}, duration_s=0.5, lead_in_s=1.0)
LONG = Trajectory({"x": SINE, "z": SINE}, duration_s=60.0, lead_in_s=1.0)
SPEED = 3.0


@pytest.fixture
def bench(tmp_path: Path) -> Iterator[PtyBench]:
    """A watched virtual board on a good line."""
    with pty_bench(tmp_path, FaultyLine(), SPEED) as running:
        yield running


def whole_capture(board: Board) -> float:
    """Capture a motion to its last sample and leave it; gives the tail in seconds."""
    board.enable()
    captured = capture_motion(board, SHORT, lambda in_hand, expected: None)
    board.finish()
    assert len(captured.recording.time_s) == 200
    return captured.tail_s


def test_a_reset_in_the_middle_of_a_motion_is_said_and_the_machine_stops(bench: PtyBench) -> None:
    with closing(bench.connect()) as board:
        board.enable()
        board.write_trajectory(LONG)
        board.arm()
        board.start()
        pages = board.capture_pages()
        next(pages)
        bench.witness.power_cycle()
        with pytest.raises(BoardError, match="the board has restarted") as caught, left_safe(board):
            list(pages)
        assert "supply" in caught.value.next_step
    bench.wait(1.0)
    bench.witness.stands_still()
    bench.witness.gains_are_whole()
    with closing(bench.connect()) as board:
        whole_capture(board)
    assert bench.witness.motions == 2


def test_the_clock_wraps_around_in_the_middle_of_a_motion(bench: PtyBench) -> None:
    with closing(bench.connect()) as board:
        whole_capture(board)
        with bench.witness.virtual.lock:
            bench.witness.virtual.machine.samples = 2**32 - 450  # after 124 days
    with closing(bench.connect()) as board:
        tail_s = whole_capture(board)
        assert board.status().clock_samples < 2**31
        assert 0.0 <= tail_s < 1.0


def test_the_microsecond_clock_of_the_firmware_wraps_around(firmware: Path) -> None:
    """The Linux port's wraps 3 s after power-up: watchdog and confirm window go on as before."""
    with serving(c_command(firmware, speed=1.0)) as served, served.connected() as board:
        board.stage_gains(board.active_gains())
        board.commit()
        board.enable()
        board.write_trajectory(LONG)
        board.arm()
        board.start()
        first, began_s = board.status(), time.monotonic()
        while time.monotonic() < began_s + 3.5:
            assert board.status().state is State.MOVING
            board.heartbeat()
            time.sleep(0.01)
        last = board.status()
        # the window counts what the board's own clock does, however late this host is
        passed_s = (last.clock_samples - first.clock_samples) * board.identity.sample_period_s
        assert passed_s > 3.0
        counted_s = first.confirm_remaining_s - last.confirm_remaining_s
        assert counted_s == pytest.approx(passed_s, abs=0.05)
        board.quick_stop()


def test_a_host_too_slow_for_the_board_is_told_that_samples_are_lost(
    command_of_either: BoardCommand, tmp_path: Path
) -> None:
    with (
        serving(command_of_either(speed=20.0)) as served,
        FaultProxy(served.url, tmp_path, FaultyLine()) as proxy,
    ):

        def slow_down(in_hand: int, expected: int) -> None:
            """Once the motion runs: a line that is slow before is refused."""
            proxy.line.pace = Pace(19200)

        with closing(connected_board(proxy.url, 2.0)) as board:
            board.enable()
            with pytest.raises(LinkError, match="overwritten") as caught, left_safe(board):
                capture_motion(board, LONG, slow_down)
            assert "faster link" in caught.value.next_step
            assert board.status().state is State.IDLE
        proxy.line.pace = Pace()
        with closing(connected_board(proxy.url)) as board:
            whole_capture(board)


def test_the_watchdog_stops_the_machine_of_a_host_that_fell_silent(
    command_of_either: BoardCommand, tmp_path: Path
) -> None:
    """The silent host is told when it speaks again; the next one goes on from there."""
    with (
        serving(command_of_either(speed=5.0)) as served,
        FaultProxy(served.url, tmp_path, FaultyLine()) as proxy,
    ):
        with closing(connected_board(proxy.url)) as board:
            board.enable()
            board.write_trajectory(LONG)
            board.arm()
            board.start()
            time.sleep(1.2)
            with pytest.raises(BoardError, match="fault WATCHDOG") as caught:
                next(board.capture_pages())
            assert "host load" in caught.value.next_step
            until_abandoned(board, lambda status: status.state is State.FAULT)
        with closing(connected_board(proxy.url)) as board:
            make_ready(board)
            whole_capture(board)


@pytest.mark.parametrize("state", [State.ARMED, State.DRAINING])
def test_the_effort_of_a_host_that_vanished_goes_off_with_the_next(
    command_of_either: BoardCommand, state: State
) -> None:
    """No watchdog guards axes at rest: they would be held under power for ever."""
    with serving(command_of_either(speed=5.0)) as served:
        with closing(connected_board(served.url)) as board:
            board.enable()
            board.write_trajectory(SHORT)
            board.arm()
            if state is State.DRAINING:
                board.start()
            until_abandoned(board, lambda status: status.state is state)
        with closing(connected_board(served.url)) as board:
            assert board.status().enabled
            with ready_to_move(board, lambda text: None):
                assert board.status().enabled
            assert not board.status().enabled


# ---- the power is cut in the middle of a gain write


def gain_write(board: Board) -> None:
    """All that `run` does to change gains for good, apart from the motions."""
    make_ready(board)
    write_gains(board, NEW)
    board.confirm()
    board.store()


class CutAt:
    """Calls something once, before the request of this number goes on."""

    def __init__(self, number: int, cut: Callable[[], None]) -> None:
        self._left, self._cut = number, cut
        self.requests = 0

    def __call__(self, sender: Sender, frame: bytes) -> None:
        """See `fault_line.Choose`."""
        if sender is Sender.HOST:
            self.requests += 1
            if self.requests == self._left:
                self._cut()


def requests_of_a_gain_write(bench: PtyBench) -> int:
    """How many requests a gain write takes where nothing is cut."""
    counting = CutAt(0, lambda: None)
    with closing(bench.connect()) as board:
        bench.line.choose = counting
        gain_write(board)
    return counting.requests


def test_the_virtual_boards_power_is_cut_at_every_request_of_a_gain_write(
    bench: PtyBench, tmp_path: Path
) -> None:
    count = requests_of_a_gain_write(bench)
    assert count > 10
    for number in range(1, count + 1):
        other = tmp_path / str(number)
        other.mkdir()
        with pty_bench(other, FaultyLine(), SPEED) as cut:
            with closing(cut.connect()) as board:
                cut.line.choose = CutAt(number, cut.witness.power_cycle)
                ended_well = False
                with suppress(EdgeIdentError), left_safe(board):
                    gain_write(board)
                    ended_well = True
                cut.witness.gains_are_whole()
            cut.line.choose = CutAt(0, lambda: None)
            with closing(cut.connect()) as board:
                make_ready(board)
                found = board.active_gains()
                assert found == cut.witness.virtual.machine.banks.stored
                assert found in (OLD, NEW)
                assert ended_well <= (found == NEW)
                gain_write(board)
                assert board.active_gains() == NEW


@contextmanager
def powered(firmware: Path, memory: Path, folder: Path) -> Iterator[tuple[FaultProxy, Callable]]:
    """The C board behind a line, and what cuts its power: once it returns, nothing answers."""
    folder.mkdir(exist_ok=True)
    command = c_command(firmware, "--store", str(memory))
    process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
    assert process.stdout is not None
    url = process.stdout.readline().strip()

    def cut() -> None:
        process.kill()
        process.wait()

    try:
        with FaultProxy(url, folder, FaultyLine()) as proxy:
            yield proxy, cut
    finally:
        cut()


def test_the_firmwares_power_is_cut_at_every_request_of_a_gain_write(
    firmware: Path, tmp_path: Path, thorough: bool
) -> None:
    """It stays off; what its permanent memory holds is seen at the next power-up.

    At every sixth request; `--thorough` cuts at each. How often the host asks whether the gains are
    stored is up to the board's time: the power is cut later and later until a gain write ends
    before.
    """
    first: dict[str, AxisGains] | None = None
    cut_short: LinkError | None = None
    number = 0
    while cut_short or number == 0:
        number += 1 if thorough else 6
        memory = tmp_path / f"memory{number}"
        with (
            powered(firmware, memory, tmp_path / "cut") as (proxy, cut),
            closing(connected_board(proxy.url, timeout_s=0.3)) as board,
        ):
            first = first or dict(board.active_gains())
            proxy.line.choose = CutAt(number, cut)
            cut_short = None
            try:
                gain_write(board)
            except LinkError as error:
                cut_short = error
        assert cut_short is None or "check cable and power" in cut_short.next_step
        with (
            powered(firmware, memory, tmp_path / "again") as (proxy, _),
            closing(connected_board(proxy.url)) as board,
        ):
            make_ready(board)
            assert board.active_gains() in ((first, NEW) if cut_short else (NEW,))
            assert not board.status().unconfirmed
    assert first != NEW
    assert number > 10
