"""Every fault of a line by name, on a real pseudo-terminal, against both boards.

Each strikes once at every kind of frame of a motion and a gain write. What holds afterwards: the
verb worked, or said that nothing was carried out and works when it is called again; no sample is
missing; the machine moved once; and the gains are those that were asked for.
"""

import threading
import time
from collections.abc import Callable, Iterator
from contextlib import closing, contextmanager
from pathlib import Path

import numpy as np
import pytest
from board_bench import NEW
from conformance_boards import BoardCommand, clean_up, python_command, serving, until
from fault_line import FaultyLine, LineFault, Pace, Sender, no_fault
from fault_proxy import FaultProxy
from pty_bench import connected_board

from firmware_interface import board_session
from firmware_interface.board import Board, CapturePage
from firmware_interface.errors import BoardError, LinkError
from firmware_interface.motion import Multisine, SineComponent, Trajectory
from firmware_interface.registers import PAGE_ADDRESS, REGISTERS, Opcode, Result, State

TIMEOUT_S = 0.1
SINE = Multisine((SineComponent(0.4, 1.0, 0.0),))
MOTION = Trajectory({"x": SINE, "z": SINE}, duration_s=421 * 0.0025, lead_in_s=2.0)
COMMAND = REGISTERS["command.opcode"].address
STATUS = REGISTERS["status.state"].address
SHADOW = REGISTERS["shadow.x.proportional"].address


@pytest.fixture(autouse=True)
def impatient(monkeypatch: pytest.MonkeyPatch) -> None:
    """Give commands that got lost up sooner than usual."""
    monkeypatch.setattr(board_session, "COMMAND_TIMEOUT_S", 0.25)


@contextmanager
def proxied(command: list[str], folder: Path) -> Iterator[FaultProxy]:
    """A board behind a line that is good until told otherwise."""
    with serving(command) as board, FaultProxy(board.url, folder, FaultyLine()) as running:
        yield running


@pytest.fixture(scope="module")
def either_proxy(
    command_of_either: BoardCommand, tmp_path_factory: pytest.TempPathFactory
) -> Iterator[FaultProxy]:
    """A board of either kind."""
    with proxied(command_of_either(), tmp_path_factory.mktemp("line")) as running:
        yield running


@pytest.fixture(scope="module")
def proxy(tmp_path_factory: pytest.TempPathFactory) -> Iterator[FaultProxy]:
    """A Python virtual board."""
    with proxied(python_command(), tmp_path_factory.mktemp("line")) as running:
        yield running


@contextmanager
def cleaned_up(proxy: FaultProxy, timeout_s: float = TIMEOUT_S) -> Iterator[Board]:
    """A host on the line; afterwards the board is as at power-up."""
    with closing(connected_board(proxy.url, timeout_s)) as board:
        first_gains = board.active_gains()
        board.enable()
        try:
            yield board
        finally:
            proxy.line.choose, proxy.line.pace = no_fault, Pace()
            time.sleep(2 * TIMEOUT_S)
            board.close()
            with closing(connected_board(proxy.url)) as another:
                clean_up(another, first_gains)


def request_to(address: int, opcode: Opcode | None = None) -> bytes:
    """How a request begins: with its address, and a command with its opcode."""
    function = 3 if address in (STATUS, PAGE_ADDRESS) else 16
    begin = bytes([1, function]) + address.to_bytes(2, "big")
    return begin if opcode is None else begin + bytes([0, 6, 12, 0, opcode])


class Strikes:
    """Lets a fault happen once to each exchange that begins in one of these ways.

    Attributes
    ----------
    sent : dict of bytes to int
        How often each went over the line.
    left : list of bytes
        Where it has not struck yet.
    """

    def __init__(self, fault: LineFault, sender: Sender, *requests: bytes) -> None:
        self._fault, self._sender = fault, sender
        self.left = list(requests)
        self.sent = dict.fromkeys(requests, 0)
        self._last = b""

    def __call__(self, sender: Sender, frame: bytes) -> LineFault | None:
        """See `fault_line.Choose`."""
        if sender is Sender.HOST:
            self._last = next((begin for begin in self.sent if frame.startswith(begin)), b"")
            if self._last:
                self.sent[self._last] += 1
        if sender is self._sender and self._last in self.left:
            self.left.remove(self._last)
            return self._fault
        return None


def done_in_two(verb: Callable[[], None]) -> int:
    """Call a verb; where the line ate it, once more. Gives how many calls it took."""
    try:
        verb()
    except LinkError:
        verb()
        return 2
    return 1


def check_samples(pages: list[CapturePage]) -> None:
    """Every sample is there, and nowhere is a step that the motion does not have."""
    assert [page.first_sample for page in pages] == list(range(0, 421, 14))
    position = np.vstack([page.position_rad for page in pages])
    assert position.shape == (421, 2)
    assert np.max(np.abs(np.diff(position, axis=0))) < 2 * 0.4 * 0.0025


@pytest.mark.parametrize(
    "fault",
    [fault for fault in LineFault if fault is not LineFault.SWAPPED],
    ids=lambda fault: fault.name.lower(),
)
def test_a_fault_of_requests_is_survived(either_proxy: FaultProxy, fault: LineFault) -> None:
    survive(either_proxy, fault, Sender.HOST)


@pytest.mark.parametrize("fault", LineFault, ids=lambda fault: fault.name.lower())
def test_a_fault_of_replies_is_survived(proxy: FaultProxy, fault: LineFault) -> None:
    """The board is innocent of what becomes of its replies: one kind of board will do."""
    survive(proxy, fault, Sender.BOARD)


def survive(proxy: FaultProxy, fault: LineFault, sender: Sender) -> None:
    """A motion and a gain write, in each of which the fault strikes at every kind of frame."""
    start, commit = (request_to(COMMAND, opcode) for opcode in (Opcode.START, Opcode.COMMIT))
    starting = Strikes(fault, sender, start)
    capturing = Strikes(fault, sender, request_to(STATUS), request_to(PAGE_ADDRESS))
    writing = Strikes(fault, sender, request_to(SHADOW), commit)
    with cleaned_up(proxy) as board:
        proxy.line.late_s = 1.5 * TIMEOUT_S
        board.write_trajectory(MOTION)
        board.arm()
        proxy.line.choose = starting
        calls = done_in_two(board.start)
        assert starting.sent[start] == calls  # never written a second time in one call
        proxy.line.choose = capturing
        check_samples(list(board.capture_pages()))
        board.finish()
        proxy.line.choose = writing
        done_in_two(lambda: board.stage_gains(NEW))
        calls = done_in_two(board.commit)
        assert writing.sent[commit] == calls
        assert board.active_gains() == NEW
        board.confirm()
        assert not board.status().unconfirmed
        assert not starting.left + capturing.left + writing.left
        assert board.status().state is State.IDLE  # it moved once


LATE_S = 0.9
"""Longer than a host waits for a command."""
VERBS: dict[Opcode, Callable[[Board], object]] = {
    Opcode.ENABLE: Board.enable,
    Opcode.DISABLE: Board.disable,
    Opcode.ARM: Board.arm,
    Opcode.START: Board.start,
    Opcode.COMMIT: Board.commit,
    Opcode.STORE: Board.store,
}


@pytest.mark.parametrize("opcode", VERBS, ids=lambda opcode: opcode.name)
def test_a_command_that_comes_after_everybody_gave_up_does_nothing(
    either_proxy: FaultProxy, opcode: Opcode
) -> None:
    """The host was told that it did not arrive; then it does, behind all that the host did since.

    So may a gateway deliver it that repeats a request by itself.
    """
    with cleaned_up(either_proxy) as board:
        old = board.active_gains()
        board.stage_gains(NEW)
        board.write_trajectory(MOTION)
        if opcode is Opcode.START:
            board.arm()
        if opcode is Opcode.ENABLE:
            board.disable()
        either_proxy.line.late_s = LATE_S
        late = Strikes(LineFault.LATE, Sender.HOST, request_to(COMMAND, opcode))
        either_proxy.line.choose = late
        with pytest.raises(LinkError, match=f"{opcode.name} did not reach the board:") as caught:
            VERBS[opcode](board)
        assert "check the cable" in caught.value.next_step
        board.quick_stop()
        before = board.status()
        board.claim()
        time.sleep(LATE_S)
        status = board.status()
        assert status.last_token != before.last_token
        found = Result.WRONG_STATE if opcode is Opcode.START else Result.NOT_HELD
        assert status.last_result is found
        assert status.state is State.IDLE
        assert (status.enabled, status.unconfirmed) == (before.enabled, False)
        assert board.active_gains() == old
        assert not late.left
        VERBS[Opcode.ENABLE](board)  # and commands of now are carried out


def test_a_board_that_keeps_the_hold_may_still_carry_a_lost_command_out(
    either_proxy: FaultProxy,
) -> None:
    """The host cannot take back what it said, and does not say that nothing was carried out."""
    release = request_to(REGISTERS["session.release"].address)
    with cleaned_up(either_proxy) as board:
        strikes = Strikes(LineFault.LOST, Sender.HOST, request_to(COMMAND, Opcode.FINISH), release)
        either_proxy.line.choose = strikes
        with pytest.raises(LinkError, match="FINISH did not reach the board so far") as caught:
            board.finish()
        assert "edge-ident doctor" in caught.value.next_step
        assert not strikes.left


@pytest.mark.parametrize(
    "fault", [LineFault.SWAPPED, LineFault.LATE, LineFault.REPEATED], ids=lambda fault: fault.name
)
def test_the_answer_of_another_register_is_not_taken(proxy: FaultProxy, fault: LineFault) -> None:
    """Serial number and map CRC have the same length: either would pass for the other."""
    serial, crc = (REGISTERS[f"identity.{name}"].address for name in ("serial_number", "map_crc"))
    with cleaned_up(proxy) as board:
        read = board._link.read
        right = {address: read(address, 2) for address in (serial, crc)}
        proxy.line.pace = Pace(115200)  # a second copy is still coming when the next request goes
        proxy.line.late_s = 1.2 * TIMEOUT_S
        proxy.line.choose = Strikes(
            fault, Sender.BOARD, bytes([1, 3]) + serial.to_bytes(2, "big") + bytes([0, 2])
        )
        for address in (serial, crc, serial, crc):
            assert read(address, 2) == right[address]


def test_real_time_at_115200_baud_with_jitter(either_proxy: FaultProxy) -> None:
    """Both boards run twenty times faster than the line: the ring takes up what waits."""
    with cleaned_up(either_proxy) as board:
        either_proxy.line.pace = Pace(115200, jitter_s=0.004)
        board.write_trajectory(MOTION)
        board.arm()
        board.start()
        check_samples(list(board.capture_pages()))
        assert board.status().overflows == 0


def test_a_hang_up_and_return_within_the_watchdog_loses_no_sample(proxy: FaultProxy) -> None:
    with cleaned_up(proxy, timeout_s=0.3) as board:
        board._link.write(REGISTERS["watchdog.timeout"].address, [5000])
        board.write_trajectory(MOTION)
        board.arm()
        board.start()
        proxy.hang_up()
        time.sleep(0.3)
        proxy.come_back()
        check_samples(list(board.capture_pages()))
        board.finish()
        board._link.write(REGISTERS["watchdog.timeout"].address, [1000])


def test_a_line_that_stays_away_is_said_and_the_machine_stops(
    proxy: FaultProxy,
) -> None:
    long = Trajectory(MOTION.axes, 60.0, 2.0)
    with cleaned_up(proxy) as board:
        board._link.write(REGISTERS["watchdog.timeout"].address, [300])
        board.write_trajectory(long)
        board.arm()
        board.start()
        proxy.hang_up()
        with pytest.raises(LinkError, match="connection is lost") as caught:
            list(board.capture_pages())
        assert "check cable" in caught.value.next_step
        time.sleep(0.5)
        proxy.come_back()
        with pytest.raises(BoardError, match="fault WATCHDOG") as fault:
            list(board.capture_pages())
        assert "edge-ident clear-fault" in fault.value.next_step
        until(board, lambda status: status.state is State.FAULT)
        board.clear_fault()
        board._link.write(REGISTERS["watchdog.timeout"].address, [1000])


def test_a_hang_up_while_the_host_waits_for_silence(
    proxy: FaultProxy,
) -> None:
    with cleaned_up(proxy) as board:
        proxy.line.choose = Strikes(LineFault.LOST, Sender.BOARD, request_to(STATUS))
        pulled = threading.Timer(1.5 * TIMEOUT_S, proxy.hang_up)
        pulled.start()
        with pytest.raises(LinkError, match="connection is lost"):
            board.status()
        pulled.join()
        proxy.come_back()
        assert board.status().state is State.IDLE


def test_the_name_of_the_device_outlives_it(proxy: FaultProxy) -> None:
    with Path(proxy.url).resolve().open("rb"):  # keeps its number from being given out again
        proxy.hang_up()
        assert not Path(proxy.url).exists()
        with pytest.raises(LinkError, match="cannot be opened"):
            connected_board(proxy.url)
        proxy.come_back()
    with closing(connected_board(proxy.url)) as board:
        assert board.status().state is State.IDLE
