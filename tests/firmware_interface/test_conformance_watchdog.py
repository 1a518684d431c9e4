"""Both boards know when the host that started a motion is gone, whoever else makes a noise."""

from collections.abc import Callable
from dataclasses import replace

import pytest
from board_bench import long_motion
from conformance_boards import (
    BoardCommand,
    fresh_token,
    key_of,
    refused,
    refused_value,
    send,
    serving,
    start,
    until_abandoned,
    until_fault,
)

from firmware_interface.board import Board, BoardStatus
from firmware_interface.codec import encode
from firmware_interface.registers import MAP_CRC, REGISTERS, Fault, Opcode, State, WatchdogAction

BUSY = 6
FOREIGN = 0x0BADC0DE
LONG = replace(long_motion(), lead_in_s=2.0, duration_s=300.0)


def poll(board: Board, status: BoardStatus) -> None:
    board._link.read(REGISTERS["identity.nonce"].address, 2)


def acknowledge(board: Board, status: BoardStatus) -> None:
    refused_value(board, "capture.pages_acknowledged", status.pages_written)


def write_elsewhere(board: Board, status: BoardStatus) -> None:
    refused_value(board, "shadow.crc", 1)
    refused_value(board, "identity.magic", 1)


def beat_with_another_key(board: Board, status: BoardStatus) -> None:
    assert refused_value(board, "session.key", FOREIGN) == BUSY


def command_with_another_key(board: Board, status: BoardStatus) -> None:
    send(board, Opcode.FINISH, fresh_token(board), 0, FOREIGN)


def repeat_an_old_command(board: Board, status: BoardStatus) -> None:
    send(board, Opcode.START, status.last_token, MAP_CRC, key_of(board))


def release_with_another_key(board: Board, status: BoardStatus) -> None:
    assert refused_value(board, "session.release", FOREIGN) == 0


@pytest.mark.parametrize(
    "noise",
    [
        poll,
        acknowledge,
        write_elsewhere,
        beat_with_another_key,
        command_with_another_key,
        repeat_an_old_command,
        release_with_another_key,
    ],
    ids=lambda noise: noise.__name__,
)
def test_nobody_else_keeps_the_motion_of_a_dead_host_alive(
    either_board: Board, noise: Callable[[Board, BoardStatus], None]
) -> None:
    assert refused_value(either_board, "watchdog.timeout", 0.25) == 0
    start(either_board, LONG)

    def over(status: BoardStatus) -> bool:
        if not status.fault:
            noise(either_board, status)
        return status.state is State.FAULT

    status = until_abandoned(either_board, over)
    assert (status.fault, status.enabled) == (Fault.WATCHDOG, False)


@pytest.mark.parametrize("sign", ["heartbeats", "commands"])
def test_the_host_that_started_keeps_its_motion_alive(either_board: Board, sign: str) -> None:
    """Over forty times the watchdog's patience, as the board's own clock counts it."""
    assert refused_value(either_board, "watchdog.timeout", 5.0) == 0
    start(either_board, LONG)
    first = either_board.status().clock_samples

    def on_and_on(status: BoardStatus) -> bool:
        if sign == "heartbeats":
            either_board.heartbeat()
        else:
            send(either_board, Opcode.ARM, fresh_token(either_board), 0, key_of(either_board))
        return status.clock_samples > first + 8000 or status.fault is not Fault.NONE

    status = until_abandoned(either_board, on_and_on)
    assert (status.state, status.fault) == (State.MOVING, Fault.NONE)


def watchdog_changes(board: Board) -> set[int]:
    """Modbus exceptions to every way of changing the watchdog."""
    words = encode("watchdog.timeout", 5.0) + encode("watchdog.action", WatchdogAction.COAST)
    return {
        refused_value(board, "watchdog.timeout", 5.0),
        refused_value(board, "watchdog.action", WatchdogAction.COAST),
        refused(board, REGISTERS["watchdog.timeout"].address, words),
    }


def test_the_watchdog_stays_as_it_is_during_a_motion(either_board: Board) -> None:
    start(either_board, LONG)
    assert watchdog_changes(either_board) == {BUSY}
    either_board.quick_stop()
    assert either_board.register_values("watchdog.timeout") == (1.0,)
    assert refused_value(either_board, "watchdog.timeout", 2.0) == 0


def test_the_watchdog_stays_as_it_is_once_a_motion_is_armed(either_board: Board) -> None:
    """Else a foreign host could change it between ARM and START."""
    either_board.enable()
    either_board.write_trajectory(LONG)
    either_board.arm()
    assert watchdog_changes(either_board) == {BUSY}
    either_board.quick_stop()
    assert either_board.register_values("watchdog.timeout") == (1.0,)
    assert refused_value(either_board, "watchdog.timeout", 2.0) == 0


def test_the_watchdog_stays_as_it_is_during_a_stop(command_of_either: BoardCommand) -> None:
    """On a board ten times slower than time, where a stop takes a while."""
    with serving(command_of_either(speed=0.1)) as served, served.connected() as board:
        start(board, replace(LONG, lead_in_s=0.1, duration_s=20.0))
        send(board, Opcode.QUICK_STOP, fresh_token(board), 0, FOREIGN)
        changes, status = watchdog_changes(board), board.status()
        assert changes == {BUSY} or status.state is not State.STOPPING


def test_a_shorter_patience_counts(either_board: Board) -> None:
    assert refused_value(either_board, "watchdog.timeout", 0.1) == 0
    start(either_board, LONG)
    until_abandoned(either_board, lambda status: status.state is State.FAULT)
    assert until_fault(either_board) is Fault.WATCHDOG


def test_a_host_that_dies_at_the_end_of_its_motion_leaves_no_effort(either_board: Board) -> None:
    """The axes stand before the watchdog's time is over, and nobody fetches the last pages."""
    assert refused_value(either_board, "watchdog.timeout", 2.0) == 0
    start(either_board, replace(LONG, lead_in_s=0.5, duration_s=0.5))
    seen = set()

    def over(status: BoardStatus) -> bool:
        seen.add(status.state)
        return status.state is State.FAULT

    status = until_abandoned(either_board, over)
    assert State.DRAINING in seen
    assert (status.fault, status.enabled) == (Fault.WATCHDOG, False)


def test_silence_at_rest_is_no_fault(either_board: Board) -> None:
    assert refused_value(either_board, "watchdog.timeout", 0.1) == 0
    either_board.enable()
    status = until_abandoned(either_board, lambda status: status.session_remaining_s < 4.0)
    assert (status.state, status.enabled) == (State.IDLE, True)
