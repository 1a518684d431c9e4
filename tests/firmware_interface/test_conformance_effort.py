"""Both boards give no effort that nobody asked for, and none after any fault."""

import math
from dataclasses import replace

import pytest
from board_bench import long_motion
from conformance_boards import (
    BoardCommand,
    ask,
    refused_value,
    serving,
    sines,
    start,
    until,
    until_fault,
)

from firmware_interface.board import Board
from firmware_interface.motion import Trajectory
from firmware_interface.registers import MAP_CRC, Fault, Opcode, Result, State, WatchdogAction

LONG = replace(long_motion(), lead_in_s=2.0)
SHORT = replace(LONG, duration_s=1.0)
SWITCHES_RAD = 0.4


def reach(position_rad: float) -> Trajectory:
    """Slowly to a place, and stay."""
    return Trajectory(dict.fromkeys("xz", sines((position_rad, 0.0, 1.5707963))), 0.2, 3.0)


def move(board: Board, motion: Trajectory) -> None:
    """To the motion's end."""
    start(board, motion)
    list(board.capture_pages())
    board.finish()


def test_after_power_up_there_is_no_effort_until_it_is_asked_for(fresh_board: Board) -> None:
    status = until(fresh_board, lambda status: status.clock_samples > 400)
    assert (status.state, status.enabled, status.brake_released) == (State.IDLE, False, False)
    assert set(status.speed_rad_s.values()) == {0.0}
    assert ask(fresh_board, Opcode.ARM) is Result.NOT_ENABLED
    assert ask(fresh_board, Opcode.START, MAP_CRC) is Result.NOT_ENABLED
    fresh_board.enable()
    status = fresh_board.status()
    assert (status.state, status.enabled, status.brake_released) == (State.IDLE, True, True)


def test_travel_counts_from_power_up_where_nothing_was_homed(fresh_board: Board) -> None:
    status = fresh_board.status()
    assert status.homed == ()
    assert set(status.position_rad.values()) == {0.0}


def test_enable_twice_changes_nothing(either_board: Board) -> None:
    for _ in range(2):
        assert ask(either_board, Opcode.ENABLE) in (Result.DONE, Result.NOT_AT_REST)
    either_board.enable()
    before = either_board.status()
    assert ask(either_board, Opcode.ENABLE) is Result.DONE
    after = until(either_board, lambda status: status.clock_samples > before.clock_samples + 200)
    assert (after.enabled, after.position_rad) == (True, before.position_rad)


def test_disable_switches_the_effort_off_and_forgets_what_was_armed(either_board: Board) -> None:
    either_board.enable()
    either_board.write_trajectory(SHORT)
    either_board.arm()
    either_board.disable()
    status = either_board.status()
    assert (status.state, status.enabled, status.brake_released) == (State.IDLE, False, False)
    assert ask(either_board, Opcode.START, MAP_CRC) is Result.NOT_ENABLED
    either_board.disable()  # once more changes nothing
    assert either_board.status().state is State.IDLE


def test_disable_after_a_motion_leaves_its_capture(either_board: Board) -> None:
    start(either_board, SHORT)
    list(either_board.capture_pages())
    until(either_board, lambda status: status.state is State.DONE)
    either_board.disable()
    status = either_board.status()
    assert (status.state, status.enabled) == (State.DONE, False)
    either_board.finish()
    assert either_board.status().state is State.IDLE


def test_neither_enable_nor_disable_during_a_motion(either_board: Board) -> None:
    start(either_board, LONG)
    assert ask(either_board, Opcode.ENABLE) is Result.WRONG_STATE
    assert ask(either_board, Opcode.DISABLE) is Result.WRONG_STATE
    assert either_board.status().state is State.MOVING


def test_gains_are_exchanged_without_effort_too(either_board: Board) -> None:
    either_board.stage_gains(either_board.active_gains())
    either_board.commit()
    either_board.confirm()
    assert not either_board.status().enabled


@pytest.mark.parametrize("action", WatchdogAction, ids=lambda code: code.name)
def test_a_fault_ends_without_effort_and_so_does_its_clearing(
    either_board: Board, action: WatchdogAction
) -> None:
    assert refused_value(either_board, "watchdog.action", action) == 0
    assert refused_value(either_board, "watchdog.timeout", 0.1) == 0
    start(either_board, LONG)
    either_board._session._held = False  # a host that falls silent
    assert until_fault(either_board) is Fault.WATCHDOG
    status = either_board.status()
    assert (status.enabled, status.brake_released) == (False, False)
    assert ask(either_board, Opcode.ENABLE) is Result.WRONG_STATE
    assert ask(either_board, Opcode.DISABLE) is Result.DONE  # it is off
    either_board.clear_fault()
    status = either_board.status()
    assert (status.state, status.enabled) == (State.IDLE, False)
    assert ask(either_board, Opcode.ARM) is Result.NOT_ENABLED
    either_board.enable()


def test_what_is_measured_is_where_the_axes_are(either_board: Board) -> None:
    move(either_board, reach(0.3))
    status = either_board.status()
    for position in status.position_rad.values():
        assert position == pytest.approx(0.3, abs=0.05)
    start(either_board, replace(LONG, lead_in_s=0.5))
    status = until(either_board, lambda status: status.samples_captured > 400)
    wanted = 0.5 * math.cos(0.5 * status.samples_captured * 0.0025)
    for speed in status.speed_rad_s.values():
        assert speed == pytest.approx(wanted, abs=0.15)


# ---- emergency stop


def test_a_pulse_of_the_emergency_stop_is_not_missed(command_of_either: BoardCommand) -> None:
    with serving(command_of_either()) as served, served.connected() as board:
        start(board, LONG)
        served.press_stop(True)
        served.press_stop(False)
        assert until_fault(board) is Fault.STO
        status = until(board, lambda status: not status.sto_active)
        assert (status.enabled, status.sto_active, status.sto_latched) == (False, False, True)
        board.clear_fault()
        status = board.status()
        assert (status.state, status.sto_latched, status.enabled) == (State.IDLE, False, False)


def test_nothing_is_enabled_while_the_emergency_stop_is_pulled(
    command_of_either: BoardCommand,
) -> None:
    """At rest and without effort it is latched too."""
    with serving(command_of_either()) as served, served.connected() as board:
        served.press_stop(True)
        status = until(board, lambda status: status.state is State.FAULT)
        assert (status.fault, status.sto_active) == (Fault.STO, True)
        assert ask(board, Opcode.CLEAR_FAULT) is Result.STO_ACTIVE
        assert ask(board, Opcode.ENABLE) is Result.WRONG_STATE
        served.press_stop(False)
        until(board, lambda status: not status.sto_active)
        board.clear_fault()
        board.enable()
        assert board.status().enabled


# ---- limit switches


@pytest.mark.parametrize("side", [-1.0, 1.0], ids=["negative", "positive"])
def test_a_limit_switch_ends_a_motion_onto_it_and_lets_one_away_pass(
    command_of_either: BoardCommand, side: float
) -> None:
    command = command_of_either(switches_rad=SWITCHES_RAD)
    pressed = 0b0101 if side < 0.0 else 0b1010
    with serving(command) as served, served.connected() as board:
        move(board, reach(side * (SWITCHES_RAD - 0.15)))
        assert board.register_values("status.limit_switches") == (0.0,)
        start(board, reach(side * (SWITCHES_RAD + 0.4)))
        assert until_fault(board) is Fault.LIMIT_SWITCH
        assert not board.status().enabled
        switches = int(board.register_values("status.limit_switches")[0])
        assert switches
        assert switches & pressed == switches
        board.clear_fault()
        board.enable()
        clock = board.status().clock_samples
        status = until(board, lambda status: status.clock_samples > clock + 200)
        assert (status.state, status.fault) == (State.IDLE, Fault.NONE)  # holding is allowed
        start(board, reach(side * (SWITCHES_RAD + 0.4)))  # on and on is not
        assert until_fault(board) is Fault.LIMIT_SWITCH
        board.clear_fault()
        move(board, reach(0.0))
        assert board.register_values("status.limit_switches") == (0.0,)
