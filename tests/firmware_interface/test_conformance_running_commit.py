"""Both boards exchange gains while their control law acts alike, and refuse it alike."""

from collections.abc import Callable
from dataclasses import replace

import pytest
from board_bench import NEW
from conformance_boards import Served, ask, start, until, until_fault

from firmware_interface.board import Board
from firmware_interface.codec import crc32
from firmware_interface.errors import BoardError
from firmware_interface.gains import Bank, encode_gains
from firmware_interface.motion import Multisine, SineComponent, Trajectory
from firmware_interface.registers import Fault, Opcode, Result, State

CRC = crc32(encode_gains(NEW))
SINE = Multisine((SineComponent(0.5, 3.0, 0.0),))
SHORT = Trajectory({"x": SINE, "z": SINE}, duration_s=0.5, lead_in_s=0.5)
LONG = replace(SHORT, duration_s=60.0)


def drain(board: Board) -> None:
    """To the end of a motion whose pages nobody has acknowledged."""
    start(board, SHORT)
    until(board, lambda status: status.state is State.DRAINING)


def test_the_board_says_that_it_can_and_how_far(either_board: Board) -> None:
    assert either_board.register_values("bumpless.capable") == (1.0,)
    for axis, limits in either_board.limits().items():
        assert limits.effort_jump_nm == pytest.approx(0.2 * limits.effort_nm)
        assert either_board.register_values(f"bumpless.{axis}.jump_limit") == pytest.approx([2.4])


@pytest.mark.parametrize("prepare", [Board.enable, drain], ids=["held", "draining"])
def test_gains_come_into_force_without_a_stop(
    either_board: Board, prepare: Callable[[Board], None]
) -> None:
    old = either_board.active_gains()
    either_board.stage_gains(NEW)
    prepare(either_board)
    state = either_board.status().state
    done = either_board.commit_running()
    assert done.taken
    assert max(map(abs, done.jumps_nm.values())) <= 2.4
    status = either_board.status()
    assert (status.state, status.fault, status.enabled) == (state, Fault.NONE, True)
    assert status.unconfirmed
    assert 115.0 < status.confirm_remaining_s <= 120.0
    assert either_board.active_gains() == NEW
    assert either_board.register_values("active.crc") == (CRC,)
    assert ask(either_board, Opcode.COMMIT_RUNNING, CRC) is Result.UNCONFIRMED
    either_board.quick_stop()
    until(either_board, lambda status: not status.unconfirmed)
    assert either_board.active_gains() == old


def test_they_are_confirmed_once_the_motion_is_left(either_board: Board) -> None:
    either_board.stage_gains(NEW)
    drain(either_board)
    assert either_board.commit_running().taken
    assert ask(either_board, Opcode.CONFIRM) is Result.WRONG_STATE
    assert list(either_board.capture_pages())
    either_board.finish()
    either_board.confirm()
    assert either_board.active_gains() == NEW


@pytest.mark.parametrize("offset", [2.875, -2.875])
def test_a_jump_beyond_the_limit_is_refused_and_told(either_board: Board, offset: float) -> None:
    old = either_board.active_gains()
    wanted: Bank = old | {"z": replace(old["z"], offset_feedforward=offset)}
    either_board.stage_gains(wanted)
    either_board.enable()
    refused = either_board.commit_running()
    assert refused.result is Result.EFFORT_JUMP
    assert refused.jumps_nm["x"] == pytest.approx(0.0, abs=0.05)
    assert refused.jumps_nm["z"] == pytest.approx(offset, abs=0.3)
    assert either_board.active_gains() == old
    assert not either_board.status().unconfirmed
    with pytest.raises(BoardError, match="the effort would jump too far"):
        either_board.commit()  # at rest, too
    assert either_board.active_gains() == old


def test_without_effort_it_is_refused(either_board: Board) -> None:
    either_board.stage_gains(NEW)
    assert ask(either_board, Opcode.COMMIT_RUNNING, CRC) is Result.NOT_ENABLED


def test_what_the_shadow_bank_must_be_it_must_be_here_too(either_board: Board) -> None:
    either_board.stage_gains(NEW)
    either_board.enable()
    assert ask(either_board, Opcode.COMMIT_RUNNING, CRC ^ 1) is Result.GAIN_CRC
    much = NEW | {"x": replace(NEW["x"], proportional=601.0)}
    either_board.stage_gains(much)
    crc = crc32(encode_gains(much))
    assert ask(either_board, Opcode.COMMIT_RUNNING, crc) is Result.GAIN_LIMITS


def test_an_armed_trajectory_and_a_motion_refuse_it(either_board: Board) -> None:
    old = either_board.active_gains()
    either_board.stage_gains(NEW)
    either_board.enable()
    either_board.write_trajectory(LONG)
    either_board.arm()
    assert ask(either_board, Opcode.COMMIT_RUNNING, CRC) is Result.WRONG_STATE
    either_board.start()
    assert ask(either_board, Opcode.COMMIT_RUNNING, CRC) is Result.WRONG_STATE
    until(either_board, lambda status: status.samples_captured > 0)
    assert ask(either_board, Opcode.COMMIT_RUNNING, CRC) is Result.WRONG_STATE
    with pytest.raises(BoardError, match="present state"):
        either_board.commit_running()
    assert either_board.active_gains() == old


def test_a_fault_refuses_it(either_kind: Served, either_board: Board) -> None:
    either_board.stage_gains(NEW)
    either_board.enable()
    either_kind.press_stop(True)
    assert until_fault(either_board) is Fault.STO
    assert ask(either_board, Opcode.COMMIT_RUNNING, CRC) is Result.WRONG_STATE
    either_kind.press_stop(False)
    until(either_board, lambda status: not status.sto_active)


def test_the_window_counts_from_the_exchange(fresh_board: Board) -> None:
    old = fresh_board.active_gains()
    fresh_board.stage_gains(NEW)
    fresh_board.enable()
    assert fresh_board.commit_running().taken
    until(fresh_board, lambda status: not status.unconfirmed)
    assert fresh_board.active_gains() == old
