"""Every stop of the virtual board ends, whatever moves, and gains that shake an axis do not last.

`simulated/checks_stops.c` says the same of the firmware.
"""

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest
from board_bench import OLD, Bench, long_motion

from edge_ident.commissioning.gain_change import roll_back_unconfirmed
from edge_ident.commissioning.gain_transfer import check_feedback
from edge_ident.errors import GainError
from firmware_interface.board import Board
from firmware_interface.control_law import feedback_poles, feedback_stable
from firmware_interface.errors import BoardError
from firmware_interface.gains import AxisGains
from firmware_interface.motion import Multisine, SineComponent, Trajectory
from firmware_interface.plant.feed_drive import FEED_DRIVE
from firmware_interface.plant.hiding import Hidden
from firmware_interface.plant.plant import Plant
from firmware_interface.registers import AXES, Fault, Opcode, Result, State, WatchdogAction
from firmware_interface.virtual.board import VirtualBoard
from firmware_interface.virtual.drive import CONTROL_DELAY_S, SAMPLE_PERIOD_S
from firmware_interface.virtual.register_file import FREE
from firmware_interface.virtual.settings import DEFAULT_LIMITS

LONGEST_REST_S = 2.0
"""After the ramp of a stop."""
RAMP_S = 0.25
NOT_STATED = {"limits": dict.fromkeys(AXES, DEFAULT_LIMITS)}
SHAKING = [(19.75, 8.389, 1130.2), (4.425, 2.681, 177.4)]
"""Proportional, derivative and integral: unstable without a velocity filter."""


def feedback(proportional: float, derivative: float, integral: float) -> AxisGains:
    return replace(
        OLD["x"],
        proportional=proportional,
        derivative=derivative,
        integral=integral,
        velocity_filter_s=0.0,
    )


class Hand:
    """Pushes axis x to and fro from now on."""

    def __init__(self, plant: Plant, effort_nm: float, frequency_hz: float) -> None:
        self._advance, self._samples = plant.advance, 0
        self._effort_nm, self._rate = effort_nm, 2.0 * math.pi * frequency_hz
        plant.advance = self.advance  # type: ignore[method-assign]

    def advance(self, command: Sequence[float]) -> None:
        self._samples += 1
        push = self._effort_nm * math.sin(self._rate * self._samples * SAMPLE_PERIOD_S)
        self._advance([command[0] + push, *command[1:]])


def pushed(bench: Bench, effort_nm: float = 8.0, frequency_hz: float = 2.0) -> None:
    Hand(bench.virtual.machine.drive.plant, effort_nm, frequency_hz)


def attended(bench: Bench, seconds: float) -> None:
    """Time passes while the host gives signs of life."""
    for _ in range(round(seconds / 0.1)):
        bench.wait(0.1)
        bench.board.heartbeat()


def opcode(bench: Bench, opcode: Opcode, token: int = 30000) -> Result:
    return bench.command(opcode, token)


def assert_off(bench: Bench, fault: Fault) -> None:
    machine = bench.virtual.machine
    assert (machine.state, machine.fault, machine.enabled) == (State.FAULT, fault, False)
    assert not any(machine.drive.sample(machine._setpoints.current).effort)


def assert_old_gains(bench: Bench) -> None:
    assert bench.board.active_gains() == OLD
    assert not bench.board.status().unconfirmed


# ---- what swings


@pytest.mark.parametrize("gains", SHAKING, ids=str)
def test_a_loop_that_keeps_an_axis_swinging_is_ended(gains: tuple[float, float, float]) -> None:
    bench = Bench(**NOT_STATED)
    bench.board.enable()
    bench.board.stage_gains(dict.fromkeys(AXES, feedback(*gains)))
    bench.board.commit()
    pushed(bench, 12.0, 0.5)  # a knock
    bench.wait(1.0)
    bench.virtual.machine.drive.plant.advance = Plant.advance.__get__(  # the hand lets go
        bench.virtual.machine.drive.plant
    )
    for _ in range(30):
        if bench.virtual.machine.fault:
            break
        bench.wait(0.1)
    assert_off(bench, Fault.OSCILLATION)
    assert_old_gains(bench)


def test_a_coupling_that_breaks_in_a_motion_is_seen() -> None:
    bench = Bench()
    stiff = replace(OLD["x"], proportional=160.0, derivative=16.0)
    bench.board.stage_gains(dict.fromkeys(AXES, stiff))
    bench.board.commit()
    bench.board.confirm()
    bench.start(long_motion())
    attended(bench, 2.0)
    bench.virtual.machine.drive.plant.break_coupling(0)
    attended(bench, 1.5)
    assert bench.virtual.machine.fault in (Fault.OSCILLATION, Fault.SPEED, Fault.FOLLOWING_ERROR)
    assert not bench.virtual.machine.enabled


@pytest.mark.parametrize("frequency_hz", [0.5, 1.0, 2.0, 4.0, 8.0])
def test_a_hand_that_pushes_is_no_oscillation(frequency_hz: float) -> None:
    bench = Bench()
    bench.board.enable()
    pushed(bench, 8.0, frequency_hz)
    bench.wait(8.0)
    machine = bench.virtual.machine
    assert (machine.state, machine.fault, machine.enabled) == (State.IDLE, Fault.NONE, True)


@pytest.mark.parametrize("seed", range(4))
def test_a_worn_machine_moves_without_an_alarm(seed: int) -> None:
    """Stick-slip, play, ripples and all: slowly, and lively."""
    for rate, amplitude in ((0.3, 2.0), (2.0, 1.0), (12.0, 0.1)):
        worn = Hidden.used(seed, 2.0).plant()
        bench = Bench()
        bench.virtual = VirtualBoard(bench.virtual._settings, bench.clock, worn)
        bench.board = Board.connect(bench.virtual)
        sine = Multisine((SineComponent(amplitude, rate, 0.0),))
        bench.start(Trajectory(dict.fromkeys(AXES, sine), duration_s=60.0, lead_in_s=1.0))
        attended(bench, 8.0)
        assert bench.virtual.machine.fault is Fault.NONE


# ---- every stop ends


@pytest.mark.parametrize("stop", [Opcode.QUICK_STOP, Opcode.DISABLE, Opcode.ROLL_BACK])
def test_a_stop_ends_whatever_moves(stop: Opcode) -> None:
    bench = Bench()
    bench.board.enable()
    bench.board.stage_gains(dict.fromkeys(AXES, replace(OLD["x"], proportional=40.0)))
    bench.board.commit()
    pushed(bench)
    bench.wait(0.5)
    machine = bench.virtual.machine
    assert (machine.state, machine.moving) == (State.IDLE, True)
    done = opcode(bench, stop)
    assert done is (Result.DONE if stop is Opcode.QUICK_STOP else Result.NOT_AT_REST)
    assert (machine.state, machine.enabled) == (State.STOPPING, True)
    bench.wait(LONGEST_REST_S + 0.01)
    assert_off(bench, Fault.STOP_OVERDUE)
    assert_old_gains(bench)


def test_where_the_axes_come_to_rest_a_stop_leaves_the_effort_on() -> None:
    bench = Bench()
    bench.start(long_motion())
    attended(bench, 1.0)
    assert opcode(bench, Opcode.QUICK_STOP) is Result.DONE
    bench.wait(RAMP_S + 1.0)
    machine = bench.virtual.machine
    assert (machine.state, machine.fault, machine.enabled) == (State.IDLE, Fault.NONE, True)


def test_the_window_ends_whatever_moves() -> None:
    bench = Bench(confirm_window_s=2.0)
    bench.board.enable()
    bench.board.stage_gains(dict.fromkeys(AXES, replace(OLD["x"], proportional=40.0)))
    bench.board.commit()
    pushed(bench)
    attended(bench, 2.0 + LONGEST_REST_S + 0.1)
    assert_off(bench, Fault.STOP_OVERDUE)
    assert_old_gains(bench)


@pytest.mark.parametrize("action", WatchdogAction)
def test_the_watchdog_ends_whatever_moves(action: WatchdogAction) -> None:
    bench = Bench()
    bench.virtual._registers.put("watchdog.action", action)
    bench.start(long_motion())
    attended(bench, 1.0)
    pushed(bench)
    bench.wait(1.0 + RAMP_S + LONGEST_REST_S + 0.3)
    assert_off(bench, Fault.WATCHDOG)


def test_a_silent_host_loses_the_board_though_an_axis_moves() -> None:
    bench = Bench()
    bench.board.enable()
    pushed(bench)
    bench.wait(4.9)
    assert bench.virtual.machine.session.key == bench.key
    bench.wait(0.2)
    assert bench.virtual.machine.session.key == FREE
    assert bench.virtual.machine.moving


def test_a_host_takes_gains_back_though_an_axis_moves() -> None:
    bench = Bench()
    bench.board.enable()
    bench.board.stage_gains(dict.fromkeys(AXES, replace(OLD["x"], proportional=40.0)))
    bench.board.commit()
    pushed(bench)
    bench.wait(0.5)
    roll_back_unconfirmed(bench.board)
    assert_old_gains(bench)


# ---- feedback, before it acts


def test_feedback_that_is_unstable_as_stated_is_refused() -> None:
    for gains in SHAKING:
        bench = Bench()
        bench.board.enable()
        unstable = dict.fromkeys(AXES, feedback(*gains))
        bench.board.stage_gains(unstable)
        for commit in (bench.board.commit_running, bench.board.commit):
            with pytest.raises(BoardError, match="the loop would be unstable"):
                commit()
        assert_old_gains(bench)
        with pytest.raises(GainError, match="axis x: the loop would be unstable with the inertia"):
            check_feedback(bench.board, unstable)


def test_where_no_inertia_is_stated_the_host_says_so() -> None:
    for settings in (NOT_STATED, {"map_version": 5}):
        bench = Bench(**settings)
        assert check_feedback(bench.board, dict.fromkeys(AXES, feedback(*SHAKING[0]))) == AXES
    assert check_feedback(Bench().board, OLD) == ()


@pytest.mark.parametrize("seed", range(8))
def test_poles_tell_what_the_sampled_loop_does(seed: int) -> None:
    """A rigid body without dry friction grows or decays from a small deflection as they say."""
    rng = np.random.default_rng(seed)
    gains = feedback(*(rng.uniform(0.0, 1.0, 3) * [400.0, 25.0, 1500.0]))
    inertia, friction = rng.uniform(0.1, 1.0), rng.uniform(0.1, 1.0)
    poles = feedback_poles(
        gains, inertia, friction, period_s=SAMPLE_PERIOD_S, control_delay_s=CONTROL_DELAY_S
    )
    steps, sizes = 40, []
    position, velocity, integral, last, before = 1.0, 0.0, 0.0, 1.0, 0.0
    for _ in range(2000):
        integral -= gains.integral * position * SAMPLE_PERIOD_S
        speed = (position - last) / SAMPLE_PERIOD_S
        effort = -gains.proportional * position - gains.derivative * speed + integral
        last = position
        for step in range(steps):
            acting = before if step < steps * CONTROL_DELAY_S / SAMPLE_PERIOD_S else effort
            steady = acting / friction
            decay = math.exp(-friction / inertia * SAMPLE_PERIOD_S / steps)
            position += steady * SAMPLE_PERIOD_S / steps + (velocity - steady) * (
                inertia / friction
            ) * (1.0 - decay)
            velocity = steady + (velocity - steady) * decay
        before = effort
        sizes.append(abs(position))
        if not 1e-12 < sizes[-1] < 1e12:
            break
    half = len(sizes) // 2
    grows = max(sizes[half:]) > max(sizes[:half])
    assert grows == (np.abs(poles).max() > 1.0)


def test_a_loop_without_feedback_and_the_first_gains_are_stable() -> None:
    for gains in (OLD["x"], feedback(0.0, 0.0, 0.0), feedback(0.0, 3.0, 0.0)):
        for body in FEED_DRIVE.values():
            assert feedback_stable(
                gains,
                body.inertia,
                body.viscous_friction,
                period_s=SAMPLE_PERIOD_S,
                control_delay_s=CONTROL_DELAY_S,
            )


def test_a_jump_of_the_effort_is_refused_at_rest() -> None:
    """Offset, load table and ripples may be legal each, and too much together."""
    bench = Bench()
    bench.board.enable()
    much = replace(
        OLD["x"],
        offset_feedforward=3.0,
        load_table=(3.0,) * 24,
        ripple_cosine=(3.0,) * 4,
        table_start_rad=-2.0,
        table_step_rad=0.25,
    )
    bench.board.stage_gains(dict.fromkeys(AXES, much))
    with pytest.raises(BoardError, match="the effort would jump too far"):
        bench.board.commit()
    assert_old_gains(bench)
    bench.wait(1.0)
    assert max(map(abs, bench.board.status().position_rad.values())) < 0.01


def test_the_sound_drive_is_the_one_that_the_settings_state() -> None:
    limits = Bench().board.limits()
    for axis, body in FEED_DRIVE.items():
        assert limits[axis].inertia == pytest.approx(body.inertia)
        assert limits[axis].viscous_friction == pytest.approx(body.viscous_friction)
