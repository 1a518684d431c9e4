"""How the virtual board protects the machine: clamps, emergency stop, limit switches, self-test."""

import math
from dataclasses import replace

import pytest
from board_bench import OLD, Bench, long_motion

from firmware_interface.board import Board
from firmware_interface.errors import BoardError
from firmware_interface.gains import CONSERVATIVE_GAINS
from firmware_interface.motion import Multisine, SineComponent, Trajectory
from firmware_interface.registers import Fault, Opcode, Result, State
from firmware_interface.virtual.board import VirtualBoard
from firmware_interface.virtual.controller import AxisController, Setpoint
from firmware_interface.virtual.settings import DEFAULT_LIMITS, BoardSettings

# ---- what is no number


def test_an_effort_that_is_no_number_becomes_none_at_all() -> None:
    """Clipped between -limit and limit, it would be full effort."""
    for hostile in (math.nan, math.inf):
        gains = replace(CONSERVATIVE_GAINS, offset_feedforward=hostile)
        law = AxisController(gains, 0.0025, 12.0)
        assert law.effort_nm(Setpoint(0.0, 0.0, 0.0), 0.0) == 0.0
        assert not law.finite


@pytest.mark.parametrize("integral", [math.nan, math.inf])
def test_an_integral_that_is_no_number_becomes_none_at_all(integral: float) -> None:
    law = AxisController(replace(CONSERVATIVE_GAINS, integral=integral), 0.0025, 12.0)
    assert abs(law.effort_nm(Setpoint(0.1, 0.0, 0.0), 0.0)) < 12.0
    assert not law.finite


def test_gains_that_are_no_numbers_switch_the_effort_off_at_once() -> None:
    bench = Bench()
    bench.board.enable()
    drive = bench.virtual.machine.drive
    drive.set_gains(dict.fromkeys("xz", replace(OLD["x"], offset_feedforward=math.nan)))
    bench.wait(0.0025)
    machine = bench.virtual.machine
    assert (machine.state, machine.fault) == (State.FAULT, Fault.NOT_FINITE)
    assert not machine.enabled
    assert not any(drive.plant.torque_nm)


def test_setpoints_that_are_no_numbers_hold_the_axes_and_switch_the_effort_off() -> None:
    bench = Bench()
    bench.start(long_motion())
    bench.wait(0.3)
    setpoints = bench.virtual.machine._setpoints
    setpoints._ahead = iter([[Setpoint(math.nan, 0.0, 0.0)] * 2])
    bench.wait(0.0025)
    assert all(setpoint.finite for setpoint in setpoints.current)
    machine = bench.virtual.machine
    assert (machine.state, machine.fault, machine.enabled) == (
        State.FAULT,
        Fault.NOT_FINITE,
        False,
    )


# ---- enabling


def test_no_axis_that_moves_is_enabled() -> None:
    """Somebody pushes it by hand."""
    bench = Bench()
    bench.wait(0.1)
    bench.board.claim()
    plant = bench.virtual.machine.drive.plant
    plant._axes[0].velocity = (2.0, 2.0, 2.0)  # rad/s, all that turns with one axis
    bench.wait(0.02)
    assert bench.command(Opcode.ENABLE, 30500) is Result.NOT_AT_REST
    assert not bench.virtual.machine.enabled
    bench.wait(1.0)
    assert bench.command(Opcode.ENABLE, 30501) is Result.DONE
    pushed = bench.virtual.machine.drive.position_rad
    assert abs(pushed[0]) > 0.01
    bench.wait(1.0)  # held where it was left, not where it came from
    assert bench.virtual.machine.drive.position_rad == pytest.approx(pushed, abs=2e-3)


# ---- emergency stop, switches, self-test


def test_a_pulse_of_the_stop_between_two_samples_is_not_missed() -> None:
    bench = Bench()
    bench.start(long_motion())
    bench.virtual.inputs.press_stop()
    bench.virtual.inputs.release_stop()
    bench.wait(0.0025)
    status = bench.board.status()
    assert (status.state, status.fault, status.enabled) == (State.FAULT, Fault.STO, False)
    assert (status.sto_active, status.sto_latched) == (False, True)
    bench.wait(1.0)
    bench.board.clear_fault()
    status = bench.board.status()
    assert (status.state, status.sto_latched, status.enabled) == (State.IDLE, False, False)


def test_the_stop_is_latched_at_rest_without_effort_too() -> None:
    bench = Bench()
    bench.virtual.inputs.press_stop()
    assert bench.board.status().fault is Fault.STO
    assert bench.command(Opcode.CLEAR_FAULT, 30077) is Result.NOT_HELD
    bench.board.claim()
    assert bench.command(Opcode.CLEAR_FAULT, 30078) is Result.STO_ACTIVE
    bench.virtual.inputs.release_stop()
    assert bench.command(Opcode.CLEAR_FAULT, 30079) is Result.DONE


@pytest.mark.parametrize("end", [0, 1], ids=["negative", "positive"])
def test_a_pressed_limit_switch_lets_an_axis_move_away_only(end: int) -> None:
    bench = Bench()
    bench.virtual.inputs.pressed_by_hand = 1 << end
    bench.board.enable()
    bench.wait(1.0)
    assert bench.virtual.machine.state is State.IDLE  # holding is allowed
    away = 0.3 if end == 0 else -0.3
    for sign, fault in ((1.0, Fault.NONE), (-1.0, Fault.LIMIT_SWITCH)):
        step = Multisine((SineComponent(sign * away, 0.0, math.pi / 2),))
        still = Multisine((SineComponent(0.0, 0.0, 0.0),))
        position = bench.virtual.machine.drive.position_rad[0]
        there = replace(step, components=(*step.components, SineComponent(position, 0.0, 1.5708)))
        bench.start(Trajectory({"x": there, "z": still}, 0.2, 1.0))
        bench.wait(0.6)
        assert bench.virtual.machine.fault is fault
        if not fault:
            bench.board.heartbeat()
            list(bench.board.capture_pages())
            bench.board.finish()


BAD = {
    "no travel": {"limits": {"travel_rad": 0.0}},
    "a speed that is no number": {"limits": {"speed_rad_s": math.nan}},
    "an effort beyond the counts": {"limits": {"effort_nm": 132.0}},
    "an endless acceleration": {"limits": {"acceleration_rad_s2": math.inf}},
    "a step of more than all": {"limits": {"gain_step": 1.5}},
    "a gain that is no number": {"gains": {"derivative": math.nan}},
    "a negative gain": {"gains": {"proportional": -1.0}},
    "a divisor of zero": {"gains": {"stribeck_speed_rad_s": 0.0}},
    "a gain above its maximum": {"gains": {"proportional": 601.0}},
    "no window": {"confirm_window_s": 0.0},
    "an endless window": {"confirm_window_s": 1800.0},
}


@pytest.mark.parametrize("what", BAD)
def test_settings_that_make_no_sense_fail_the_self_test_for_good(what: str) -> None:
    changed: dict[str, object] = dict(BAD[what])
    if "limits" in changed:
        changed["limits"] = {"x": DEFAULT_LIMITS, "z": replace(DEFAULT_LIMITS, **changed["limits"])}  # type: ignore[arg-type]
    if "gains" in changed:
        changed["gains"] = {
            "x": CONSERVATIVE_GAINS,
            "z": replace(CONSERVATIVE_GAINS, **changed["gains"]),
        }  # type: ignore[arg-type]
    virtual = VirtualBoard(BoardSettings(**changed))  # type: ignore[arg-type]
    board = Board.connect(virtual)
    assert (board.status().state, board.status().fault) == (State.FAULT, Fault.SELF_TEST)
    for action in (board.clear_fault, board.enable):
        with pytest.raises(BoardError, match="refused"):
            action()
    assert not board.status().enabled
