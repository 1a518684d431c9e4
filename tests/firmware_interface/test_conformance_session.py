"""Both boards obey one host at a time, and know when that host is gone."""

from dataclasses import replace

import pytest
from board_bench import NEW, long_motion
from conformance_boards import (
    ask,
    command,
    fresh_token,
    key_of,
    refused,
    refused_value,
    send,
    start,
    until,
    until_abandoned,
)

from firmware_interface.board import Board
from firmware_interface.codec import crc32, encode
from firmware_interface.errors import StoppedError
from firmware_interface.gains import encode_gains, staged_writes
from firmware_interface.registers import MAP_CRC, REGISTERS, Fault, Opcode, Result, State

BUSY, ILLEGAL_VALUE = 6, 3
MINE, FOREIGN = 0x12345678, 0x0BADC0DE
LONG = replace(long_motion(), lead_in_s=2.0, duration_s=300.0)
KEY = REGISTERS["session.key"].address


def holder(board: Board) -> int:
    """The key that the board says holds it."""
    return int(board.register_values("session.key")[0])


def remaining_s(board: Board) -> float:
    """How long still."""
    return board.register_values("session.remaining")[0]


def claimed(board: Board, key: int) -> int:
    """Modbus exception to a claim, 0 where it succeeds."""
    return refused_value(board, "session.key", key)


def released(board: Board, key: int) -> int:
    """Modbus exception to a release, 0 where it succeeds."""
    return refused_value(board, "session.release", key)


# ---- who holds the board


def test_a_key_holds_the_board_and_bars_other_hosts(either_board: Board) -> None:
    assert (holder(either_board), remaining_s(either_board)) == (0, 0.0)
    assert claimed(either_board, MINE) == 0
    assert holder(either_board) == MINE
    assert 0.0 < remaining_s(either_board) <= 5.0
    assert claimed(either_board, FOREIGN) == BUSY
    assert claimed(either_board, 0) == ILLEGAL_VALUE
    assert holder(either_board) == MINE
    assert claimed(either_board, MINE) == 0
    assert released(either_board, MINE) == 0


def test_a_released_board_is_anybodys(either_board: Board) -> None:
    assert claimed(either_board, MINE) == 0
    assert released(either_board, FOREIGN) == 0  # which changes nothing
    assert holder(either_board) == MINE
    assert released(either_board, MINE) == 0
    assert (holder(either_board), remaining_s(either_board)) == (0, 0.0)
    assert claimed(either_board, FOREIGN) == 0
    assert released(either_board, FOREIGN) == 0


def test_a_late_heartbeat_does_not_take_a_board_that_its_host_let_go(either_board: Board) -> None:
    heartbeat = encode("session.key", MINE) + encode("capture.pages_acknowledged", 0)
    for _ in range(2):  # the same host may come again
        assert claimed(either_board, MINE) == 0
        assert refused(either_board, KEY, heartbeat) == 0
        assert released(either_board, MINE) == 0
        assert refused(either_board, KEY, heartbeat) == BUSY
        assert holder(either_board) == 0


def test_a_host_that_says_nothing_more_loses_the_board(either_board: Board) -> None:
    assert claimed(either_board, MINE) == 0
    until_abandoned(either_board, lambda status: holder(either_board) == 0)
    assert remaining_s(either_board) == 0.0
    assert ask(either_board, Opcode.ENABLE, key=MINE) is Result.NOT_HELD
    assert claimed(either_board, FOREIGN) == 0
    assert released(either_board, FOREIGN) == 0


def test_commands_renew_the_hold(either_board: Board) -> None:
    either_board.claim()
    until_abandoned(either_board, lambda status: status.session_remaining_s < 4.5)
    send(either_board, Opcode.FINISH, fresh_token(either_board), 0, key_of(either_board))
    status = either_board.status()
    assert status.last_result is Result.WRONG_STATE  # even a refused one
    assert status.session_remaining_s > 4.5


def test_the_hold_does_not_run_out_while_an_axis_moves(either_board: Board) -> None:
    """It begins anew when the movement ends, however long that took."""
    assert refused_value(either_board, "watchdog.timeout", 5.0) == 0
    start(either_board, LONG)
    status = either_board.status()
    for _ in range(10):
        later = status.clock_samples + 400
        status = until_abandoned(either_board, lambda status: status.clock_samples > later)  # noqa: B023
        assert status.session_remaining_s > 4.5
    assert released(either_board, key_of(either_board)) == BUSY
    assert released(either_board, FOREIGN) == 0
    assert holder(either_board) == key_of(either_board)


def test_a_board_that_checks_a_trajectory_keeps_its_host(either_board: Board) -> None:
    either_board.enable()
    either_board.write_trajectory(replace(LONG, duration_s=21600.0))
    token, crc = fresh_token(either_board), either_board._trajectory_crc
    send(either_board, Opcode.ARM, token, crc, key_of(either_board))
    assert either_board.status().state is State.CHECKING
    assert released(either_board, key_of(either_board)) == BUSY


# ---- what only the holder may do


def test_commands_of_a_host_that_does_not_hold_the_board_are_refused(either_board: Board) -> None:
    for key in (FOREIGN, 0):  # while nobody does
        assert ask(either_board, Opcode.ENABLE, key=key) is Result.NOT_HELD
    either_board.enable()
    either_board.write_trajectory(LONG)
    either_board.arm()
    for opcode in set(Opcode) - {Opcode.QUICK_STOP}:
        for key in (FOREIGN, 0):
            assert ask(either_board, opcode, MAP_CRC, key) is Result.NOT_HELD
    assert either_board.status().state is State.ARMED


def test_a_start_is_not_carried_out_for_another_host(either_board: Board) -> None:
    either_board.enable()
    either_board.write_trajectory(LONG)
    either_board.arm()
    token = fresh_token(either_board)
    assert command(either_board, Opcode.START, token, MAP_CRC, FOREIGN) is Result.NOT_HELD
    # nor later, by the same token
    assert command(either_board, Opcode.START, token, MAP_CRC) is Result.NOT_HELD
    assert either_board.status().state is State.ARMED


def test_anybody_may_stop_the_machine_and_its_host(either_board: Board) -> None:
    """No watchdog ends the stop of a host that is barred; the shortest stop lasts 0.25 s."""
    assert refused_value(either_board, "watchdog.timeout", 0.24) == 0
    start(either_board, LONG)
    until(either_board, lambda status: status.samples_captured > 100)
    assert ask(either_board, Opcode.QUICK_STOP, key=FOREIGN) is Result.DONE
    status = until_abandoned(either_board, lambda status: status.state is not State.STOPPING)
    assert (status.state, status.fault, holder(either_board)) == (State.IDLE, Fault.NONE, 0)
    assert claimed(either_board, key_of(either_board)) == BUSY


@pytest.mark.parametrize("hold", ["lives", "has run out"])
def test_a_host_that_another_one_stopped_at_rest_is_refused(either_board: Board, hold: str) -> None:
    either_board.enable()
    mine = key_of(either_board)
    if hold == "has run out":  # while it computes, which takes longer
        until_abandoned(either_board, lambda status: not status.session_remaining_s)
    assert ask(either_board, Opcode.QUICK_STOP, key=FOREIGN) is Result.DONE
    assert (holder(either_board), remaining_s(either_board)) == (0, 0.0)
    for opcode in (Opcode.ENABLE, Opcode.ARM, Opcode.START, Opcode.COMMIT, Opcode.CONFIRM):
        assert ask(either_board, opcode, MAP_CRC, mine) is Result.NOT_HELD
    assert claimed(either_board, mine) == BUSY
    assert claimed(either_board, FOREIGN) == 0
    assert released(either_board, FOREIGN) == 0
    assert claimed(either_board, mine) == BUSY  # it knows nothing of the stop yet


def test_gains_that_wait_for_their_confirmation_go_with_the_host_that_is_stopped(
    either_board: Board,
) -> None:
    old = either_board.active_gains()
    either_board.stage_gains(NEW)
    either_board.commit()
    assert ask(either_board, Opcode.QUICK_STOP, key=FOREIGN) is Result.DONE
    status = until_abandoned(either_board, lambda status: not status.unconfirmed)
    assert status.state is State.IDLE
    assert either_board.active_gains() == old
    with pytest.raises(StoppedError):
        either_board.confirm()


def test_a_host_that_stops_its_own_motion_keeps_the_board(either_board: Board) -> None:
    start(either_board, LONG)
    either_board.quick_stop()
    assert holder(either_board) == key_of(either_board)
    either_board.arm()


def test_a_stop_is_not_held_against_a_host_that_had_let_go(either_board: Board) -> None:
    either_board.claim()
    either_board.release()
    assert ask(either_board, Opcode.QUICK_STOP, key=FOREIGN) is Result.DONE
    either_board.enable()


def test_gains_that_another_host_staged_are_not_committed(either_board: Board) -> None:
    """Staging needs no session; but COMMIT says which gains it means."""
    old = either_board.active_gains()
    either_board.stage_gains(NEW)
    mine = crc32(encode_gains(NEW))
    theirs = dict.fromkeys("xz", replace(NEW["x"], proportional=65.0))
    assert all(refused(either_board, *write) == 0 for write in staged_writes(theirs)[0])
    assert ask(either_board, Opcode.COMMIT, mine) is Result.GAIN_CRC
    assert ask(either_board, Opcode.COMMIT, 0) is Result.GAIN_CRC
    assert either_board.active_gains() == old


def test_a_heartbeat_and_what_it_acknowledges_are_taken_together_or_not(
    either_board: Board,
) -> None:
    """Both stand in one write of four words."""
    start(either_board, replace(LONG, duration_s=2.0))
    until(either_board, lambda status: status.state is State.DRAINING)
    pages = either_board.status().pages_written
    assert pages > 2

    def acknowledged() -> float:
        return either_board.register_values("capture.pages_acknowledged")[0]

    def both(key: int, count: int) -> int:
        words = encode("session.key", key) + encode("capture.pages_acknowledged", count)
        return refused(either_board, KEY, words)

    mine = key_of(either_board)
    assert both(FOREIGN, 1) == BUSY
    assert both(mine, pages + 1) == ILLEGAL_VALUE
    assert acknowledged() == 0
    assert both(mine, 2) == 0
    assert acknowledged() == 2


def test_what_a_host_armed_is_not_another_hosts_to_start(either_board: Board) -> None:
    either_board.enable()
    either_board.write_trajectory(LONG)
    either_board.arm()
    either_board.release()
    assert claimed(either_board, FOREIGN) == 0
    assert ask(either_board, Opcode.START, MAP_CRC, FOREIGN) is Result.WRONG_STATE
    assert either_board.status().state is State.IDLE
    assert released(either_board, FOREIGN) == 0
