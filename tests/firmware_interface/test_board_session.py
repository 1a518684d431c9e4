"""Who commands a board: one host at a time, for as long as it gives signs of life."""

from collections.abc import Callable
from dataclasses import replace
from itertools import pairwise

import pytest
from board_bench import NEW, Bench, long_motion

from firmware_interface import board_session
from firmware_interface.board import Board
from firmware_interface.codec import crc32, encode
from firmware_interface.errors import (
    BoardError,
    BusyError,
    LinkError,
    NoReplyError,
    OvertakenError,
    RestartedError,
)
from firmware_interface.motion import Trajectory
from firmware_interface.registers import REGISTERS, SESSION_LEASE_S, Fault, Opcode, Result, State
from firmware_interface.virtual.board import VirtualBoard

COMMAND = REGISTERS["command.opcode"].address
KEY = REGISTERS["session.key"].address
STATUS = REGISTERS["status.state"].address


@pytest.fixture(autouse=True)
def impatient(monkeypatch: pytest.MonkeyPatch) -> None:
    """Ask the board as fast as it answers: its time goes by requests."""
    monkeypatch.setattr(board_session, "POLL_S", 0.0)


def test_connecting_and_reading_holds_nothing() -> None:
    board = Board.connect(VirtualBoard())
    board.limits()
    board.active_gains()
    assert board.status().session_remaining_s == 0.0


def test_a_command_takes_a_board_that_nobody_holds_and_release_lets_go() -> None:
    board = Board.connect(VirtualBoard())
    board.enable()
    assert board.status().session_remaining_s > 0.9 * SESSION_LEASE_S
    board.release()
    assert board.status().session_remaining_s == 0.0


def test_each_host_has_a_key_of_its_own() -> None:
    keys = {Board.connect(VirtualBoard())._session._key for _ in range(20)}
    assert len(keys) == 20
    assert 0 not in keys


def test_a_board_that_a_living_host_holds_is_not_taken() -> None:
    virtual = VirtualBoard()
    first = Board.connect(virtual)
    first.claim()

    class Living(VirtualBoard):
        """Between the other host's requests, the first one gives a sign of life."""

        def __init__(self) -> None: ...

        def read(self, address: int, count: int) -> list[int]:
            first.heartbeat()
            return virtual.read(address, count)

        def write(self, address: int, words: list[int]) -> None:
            virtual.write(address, words)

    second = Board.connect(Living())
    with pytest.raises(BusyError, match="another host controls the board") as caught:
        second.enable()
    assert "edge-ident stop" in caught.value.next_step
    assert not first.status().enabled


def test_the_hold_of_a_host_that_is_gone_is_waited_out() -> None:
    virtual = VirtualBoard()
    Board.connect(virtual).claim()
    board = Board.connect(virtual)
    board.enable()
    assert board.status().enabled


def test_anybody_may_stop_the_machine() -> None:
    bench = Bench()
    another = Board.connect(bench.virtual)
    bench.start(long_motion())
    another.quick_stop()
    assert another.status().state is State.IDLE


def test_a_motion_is_not_started_by_a_host_that_has_lost_the_board(
    short_motion: Trajectory,
) -> None:
    """What is armed there may be another host's motion by now."""
    bench = Bench()
    bench.arm(short_motion)
    bench.wait(SESSION_LEASE_S + 0.1)
    with pytest.raises(BoardError, match="does not control the board") as caught:
        bench.board.start()
    assert "start again" in caught.value.next_step
    assert bench.board.status().state is State.ARMED


def test_arm_and_commit_name_what_this_host_wrote(short_motion: Trajectory) -> None:
    """Somebody else writes in between: neither his motion nor his gains are taken for ours."""
    bench = Bench()
    bench.board.enable()
    bench.board.write_trajectory(short_motion)
    bench.virtual.write(REGISTERS["trajectory.lead_in_samples"].address, [0, 77])
    with pytest.raises(BoardError, match="not the one that the host wrote"):
        bench.board.arm()
    bench.board.stage_gains(NEW)
    Board.connect(bench.virtual).staged_gains()
    words = bench.virtual.read(REGISTERS["shadow.x.proportional"].address, 96)
    words[1] ^= 1
    bench.virtual.write(REGISTERS["shadow.x.proportional"].address, words)
    crc = crc32(bench.virtual.read(REGISTERS["shadow.x.proportional"].address, 96))
    bench.virtual.write(REGISTERS["shadow.crc"].address, [crc >> 16, crc & 0xFFFF])
    with pytest.raises(BoardError, match="not the one that the host staged"):
        bench.board.commit()


class BetweenOthers(VirtualBoard):
    """Another host's command comes right after each of the first few of this host."""

    def __init__(self, commands: int) -> None:
        super().__init__()
        self._left = commands

    def write(self, address: int, words: list[int]) -> None:
        super().write(address, words)
        if address == COMMAND and self._left:
            self._left -= 1
            super().write(address, [Opcode.FINISH, 40_000 + self._left, 0, 0, 0, 7])


def test_a_stop_between_the_commands_of_another_host_is_said_until_it_is_seen() -> None:
    board = Board.connect(BetweenOthers(2))
    board.quick_stop()
    assert board.status().last_result is Result.DONE


@pytest.mark.parametrize("verb", [Board.quick_stop, Board.enable])
def test_a_command_that_another_one_overtook_is_not_said_to_be_lost(
    verb: Callable[[Board], object], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(board_session, "COMMAND_TIMEOUT_S", 0.0)
    board = Board.connect(BetweenOthers(9))
    with pytest.raises(OvertakenError, match="another host came right after it"):
        verb(board)


class Recorder:
    """Notes the writes of the key with the board's clock, and loses what it is told to."""

    def __init__(self, virtual: VirtualBoard) -> None:
        self.virtual = virtual
        self.beats: list[tuple[float, list[int]]] = []
        self.lose_acknowledgements_of: set[int] = set()

    def read(self, address: int, count: int) -> list[int]:
        return self.virtual.read(address, count)

    def write(self, address: int, words: list[int]) -> None:
        if address == KEY:
            self.beats.append((self.virtual.machine.samples * 0.0025, words))
            pages = words[3] if len(words) == 4 else None
            if pages in self.lose_acknowledgements_of:
                self.lose_acknowledgements_of.remove(pages)
                raise NoReplyError("no reply", "check the cable")
        self.virtual.write(address, words)

    def close(self) -> None: ...


def test_while_the_machine_moves_the_host_beats_four_times_in_the_watchdogs_time() -> None:
    link = Recorder(VirtualBoard())
    board = Board.connect(link)
    board.enable()
    motion = replace(long_motion(), lead_in_s=10.0, duration_s=5.0)
    board.write_trajectory(motion)
    board.arm()
    board.start()
    started_s = link.virtual.machine.samples * 0.0025
    list(board.capture_pages())
    board.finish()
    times_s = [when_s for when_s, _ in link.beats if when_s >= started_s]
    # the board's time goes on by 0.28 s with every look at the status
    assert max(b - a for a, b in pairwise(times_s)) < 0.6
    assert all(len(words) == 4 for when_s, words in link.beats if when_s >= started_s)
    assert board.status().fault is Fault.NONE


def test_a_lost_last_acknowledgement_is_repeated_until_the_board_is_done(
    short_motion: Trajectory,
) -> None:
    """Before, the board stayed DRAINING and the host gave up after ten seconds."""
    link = Recorder(VirtualBoard())
    board = Board.connect(link)
    board.enable()
    board.write_trajectory(short_motion)
    board.arm()
    board.start()
    link.lose_acknowledgements_of = {31}
    assert sum(len(page.position_rad) for page in board.capture_pages()) == 421
    assert not link.lose_acknowledgements_of
    board.finish()
    assert board.status().state is State.IDLE


def test_a_lost_sign_of_life_is_repeated_at_once() -> None:
    """A line and its timeouts would take most of the watchdog's time until the next is due."""
    link = Recorder(VirtualBoard())
    board = Board.connect(link)
    board.claim()
    link.beats.clear()
    link.lose_acknowledgements_of = {0}
    board.heartbeat()
    assert len(link.beats) == 2
    assert link.beats[0][1] == link.beats[1][1]


# ---- has it restarted?


class LateStatus:
    """Brings an old reply once more in place of the next status."""

    def __init__(self, virtual: VirtualBoard, copies: int) -> None:
        self.virtual = virtual
        self.copies = copies
        self.old: list[int] = []

    def read(self, address: int, count: int) -> list[int]:
        if address == STATUS and self.old and self.copies:
            self.copies -= 1
            return self.old
        words = self.virtual.read(address, count)
        if address == STATUS and not self.old:
            self.old = words
        return words

    def write(self, address: int, words: list[int]) -> None:
        self.virtual.write(address, words)

    def close(self) -> None: ...


def test_a_late_status_does_not_say_that_the_board_has_restarted() -> None:
    link = LateStatus(VirtualBoard(), copies=0)
    board = Board.connect(link)
    for _ in range(5):
        board.status()
    before = board.status().clock_samples
    link.copies = 2
    assert board.status().clock_samples > before


def test_late_statuses_without_end_are_the_lines_fault_not_a_restart() -> None:
    link = LateStatus(VirtualBoard(), copies=0)
    board = Board.connect(link)
    for _ in range(5):
        board.status()
    link.copies = 100
    with pytest.raises(LinkError, match="late replies continue to arrive") as caught:
        board.status()
    assert "restarted" not in caught.value.cause


def test_a_board_that_has_restarted_is_told_by_its_nonce_and_once() -> None:
    virtual = VirtualBoard()
    board = Board.connect(virtual)
    for _ in range(50):
        board.status()
    virtual.power_cycle()
    with pytest.raises(RestartedError, match="the board has restarted") as caught:
        board.status()
    assert "supply" in caught.value.next_step
    board.enable()
    assert board.status().enabled


def test_effort_that_another_hosts_command_left_on_is_not_taken_for_off() -> None:
    """A foreign QUICK_STOP with the token that this host uses next takes the place of DISABLE."""
    bench = Bench()
    board, machine = bench.board, bench.virtual.machine
    board.enable()
    token = board.status().last_token % 0xFFFF + 1
    words = encode("command.opcode", Opcode.QUICK_STOP) + encode("command.token", token)
    words += encode("command.argument", 0) + encode("command.key", 0xF0)
    board._link.write(REGISTERS["command.opcode"].address, words)
    with pytest.raises(BoardError, match="has stopped this one"):
        board.disable()
    assert machine.drive.powered
    board.disable()
    assert not machine.drive.powered
