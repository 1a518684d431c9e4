"""Gains that come into force while the control law acts: what the virtual board makes of them."""

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from board_bench import NEW, OLD, Bench
from hypothesis import given
from hypothesis import strategies as st
from law_cases import drawn_gains

from firmware_interface.codec import crc32
from firmware_interface.errors import BoardError
from firmware_interface.gains import AxisGains, Bank, encode_gains
from firmware_interface.motion import Multisine, SineComponent, Trajectory
from firmware_interface.registers import AXES, Fault, Opcode, Result, State
from firmware_interface.virtual.drive import EFFORT_PER_COUNT_NM, SAMPLE_PERIOD_S, DriveSample
from firmware_interface.virtual.machine import settings_sound
from firmware_interface.virtual.settings import DEFAULT_LIMITS, BoardSettings

SINE = Multisine((SineComponent(0.5, 3.0, 0.0),))
SHORT = Trajectory({"x": SINE, "z": SINE}, duration_s=0.5, lead_in_s=0.5)
SEEDS = st.integers(0, 2**32 - 1)


def feedforward(rng: np.random.Generator) -> AxisGains:
    """Gains that might be designed for the drive behind the board, or badly so."""
    gains = drawn_gains(rng)
    return replace(
        gains,
        proportional=float(rng.uniform(10.0, 350.0)),
        derivative=float(rng.uniform(1.0, 30.0)),
        integral=float(rng.choice([0.0, 500.0])),
        velocity_filter_s=float(rng.uniform(0.0, 0.03)),
    )


class Coming(Bench):
    """A board whose axes come to rest after a motion; its samples are kept."""

    def __init__(self, after_s: float = 0.05, patience_s: float = 1.0, **changed: object) -> None:
        super().__init__(**changed)
        self.board.claim()
        self.board.write_register("watchdog.timeout", patience_s)
        self.samples: list[DriveSample] = []
        self.wait(0.1)
        self.start(SHORT)
        machine = self.virtual.machine
        while machine.state is State.MOVING:
            self.pass_samples(1)
        self.pass_samples(round(after_s / SAMPLE_PERIOD_S))
        taken = machine.drive.sample

        def noted(setpoints: Any) -> DriveSample:
            self.samples.append(taken(setpoints))
            return self.samples[-1]

        machine.drive.sample = noted  # type: ignore[method-assign]

    def pass_samples(self, count: int) -> None:
        """With a host that is alive."""
        machine = self.virtual.machine
        for _ in range(count):
            machine.session.heard(machine.session.key)
            machine.capture.acknowledge(machine.capture.pages_written)
            machine.sample()

    def efforts_nm(self, count: int, gains: Bank | None = None) -> np.ndarray:
        """Of so many samples; gains are offered in the first of them."""
        if gains is not None:
            self.virtual.machine.handover.offer(gains)
        before = len(self.samples)
        self.pass_samples(count)
        return EFFORT_PER_COUNT_NM * np.array([s.effort for s in self.samples[before:]])


@given(SEEDS, st.floats(0.0, 0.4))
def test_the_board_goes_on_without_a_jump_or_keeps_its_gains(seed: int, after_s: float) -> None:
    rng = np.random.default_rng(seed)
    gains = dict.fromkeys(AXES, feedforward(rng))
    went, stayed = Coming(after_s), Coming(after_s)
    machine = went.virtual.machine
    changed, kept = went.efforts_nm(3, gains), stayed.efforts_nm(3)
    assert np.abs(changed[0] - kept[0]).max() <= EFFORT_PER_COUNT_NM
    if machine.handover.result is Result.DONE:
        assert machine.banks.active == decoded(gains)
        assert max(map(abs, machine.handover.jumps_nm)) <= DEFAULT_LIMITS.effort_jump_nm
        assert machine.banks.unconfirmed
    else:
        assert machine.handover.result is Result.EFFORT_JUMP
        np.testing.assert_array_equal(changed, kept)
        assert machine.banks.active == OLD
        assert not machine.banks.unconfirmed


def test_the_same_gains_once_more_change_nothing() -> None:
    went, stayed = Coming(), Coming()
    changed = went.efforts_nm(150, went.virtual.machine.banks.active)
    np.testing.assert_array_equal(changed[:1], stayed.efforts_nm(150)[:1])
    assert max(map(abs, went.virtual.machine.handover.jumps_nm)) < 1e-9


def decoded(gains: Bank) -> Bank:
    """In 32-bit floats."""
    return {
        axis: AxisGains.of_numbers([float(np.float32(n)) for n in bank.numbers().values()])
        for axis, bank in gains.items()
    }


def test_a_commit_on_the_way_to_rest_is_read_back_confirmed_and_stored() -> None:
    bench = Coming()
    board, machine = bench.board, bench.virtual.machine
    board.stage_gains(NEW)
    done = board.commit_running()
    assert done.taken
    assert machine.state in (State.DRAINING, State.DONE)  # nobody has stopped anything
    assert board.active_gains() == NEW
    assert board.status().unconfirmed
    board.finish()
    board.confirm()
    board.store()
    assert machine.banks.stored == NEW


def test_a_jump_beyond_the_limit_leaves_every_bit_as_it_was() -> None:
    bench = Coming()
    board, banks = bench.board, bench.virtual.machine.banks
    words = bench.virtual._registers.spans(banks._active)
    wrong = dict.fromkeys(AXES, replace(OLD["x"], proportional=10.0, offset_feedforward=-2.875))
    board.stage_gains(wrong)
    refused = board.commit_running()
    assert refused.result is Result.EFFORT_JUMP
    assert max(map(abs, refused.jumps_nm.values())) > DEFAULT_LIMITS.effort_jump_nm
    assert bench.virtual._registers.spans(banks._active) == words
    assert not board.status().unconfirmed
    board.finish()
    board.disable()
    board.commit()  # what is staged is still there, and without effort nothing jumps
    assert board.active_gains() == wrong


@pytest.mark.parametrize("step", ["staged", "offered", "exchanged", "confirmed"])
def test_power_cut_at_any_step_leaves_old_or_new_gains_whole(step: str) -> None:
    bench = Coming()
    board, machine = bench.board, bench.virtual.machine
    board.stage_gains(NEW)
    if step == "offered":
        machine.handover.offer(NEW)
    elif step != "staged":
        assert board.commit_running().taken
    if step == "confirmed":
        board.finish()
        board.confirm()
        board.store()
    bench.virtual.power_cycle()
    wanted = NEW if step == "confirmed" else OLD
    assert bench.virtual.machine.banks.active == wanted
    bench.wait(0.5)
    assert bench.virtual.machine.banks.active == wanted
    assert not bench.virtual.machine.banks.unconfirmed
    assert not bench.virtual.machine.enabled


@pytest.mark.parametrize("end", ["fault", "withdrawn", "quick stop"])
def test_what_comes_before_the_sample_that_would_decide_refuses(end: str) -> None:
    bench = Coming()
    machine, commands = bench.virtual.machine, bench.virtual._commands
    bench.board.stage_gains(NEW)
    crc, key = crc32(encode_gains(NEW)), bench.key
    commands.command(Opcode.COMMIT_RUNNING, 30900, crc, key)
    assert commands.last_result is Result.PENDING
    if end == "fault":
        bench.virtual.inputs.press_stop()
    elif end == "withdrawn":
        commands.command(Opcode.CONFIRM, 30901, 0, key)
    else:
        commands.command(Opcode.QUICK_STOP, 30901, 0, 0)
    bench.pass_samples(1)
    assert machine.handover.result is Result.WRONG_STATE
    assert machine.banks.active == OLD
    assert (machine.fault is Fault.STO) == (end == "fault")


@pytest.mark.parametrize("state", [State.STOPPING, State.MOVING, State.ARMED, State.CHECKING])
def test_in_a_stop_a_motion_or_with_a_trajectory_armed_it_is_refused(state: State) -> None:
    bench = Coming()
    bench.board.stage_gains(NEW)
    bench.virtual.machine.state = state
    commands = bench.virtual._commands
    commands.command(Opcode.COMMIT_RUNNING, 30900, crc32(encode_gains(NEW)), bench.key)
    assert commands._result is Result.WRONG_STATE
    assert bench.virtual.machine.handover.offered is None


def test_a_command_of_a_host_that_does_not_hold_the_board_withdraws_nothing() -> None:
    bench = Coming()
    commands = bench.virtual._commands
    bench.board.stage_gains(NEW)
    commands.command(Opcode.COMMIT_RUNNING, 30900, crc32(encode_gains(NEW)), bench.key)
    commands.command(Opcode.DISABLE, 30901, 0, bench.key + 1)
    bench.pass_samples(1)
    assert bench.virtual.machine.banks.active == NEW


def test_a_quick_stop_after_the_exchange_rolls_back_once_at_rest() -> None:
    bench = Coming()
    bench.efforts_nm(1, NEW)
    bench.virtual._commands.command(Opcode.QUICK_STOP, 30900, 0, 0)
    bench.pass_samples(2)
    assert bench.virtual.machine.state is State.STOPPING
    assert bench.virtual.machine.banks.active == NEW  # never in a motion
    bench.pass_samples(400)
    assert bench.virtual.machine.banks.active == OLD
    assert bench.virtual.machine.state is State.IDLE


def test_a_beginning_too_near_to_the_end_of_the_travel_is_refused() -> None:
    narrow = replace(DEFAULT_LIMITS, travel_rad=10.0)
    bench = Coming(limits=dict.fromkeys(AXES, narrow))
    machine = bench.virtual.machine
    inside = max(abs(s.position_rad) for s in machine._setpoints.current)
    machine.handover._limits = [replace(narrow, travel_rad=0.9 * inside)] * 2
    bench.efforts_nm(1, NEW)
    assert machine.handover.result is Result.TRAJECTORY_LIMITS
    assert machine.banks.active == OLD


@pytest.mark.parametrize(("patience_s", "left"), [(0.6, True), (0.4, False)])
def test_a_host_leaves_the_axes_alone_if_the_watchdog_bears_it(
    patience_s: float, left: bool
) -> None:
    """The longest stop, from the limit of the speed, takes half a second."""
    board = Coming(patience_s=patience_s).board
    board.leave_to_rest()
    assert board.coming_to_rest == left
    board.settle()
    assert not board.coming_to_rest
    assert board.status().state is State.IDLE
    board.settle()  # which changes nothing


# ---- boards that cannot


@pytest.mark.parametrize(
    "settings",
    [
        {"map_version": 4},
        {"limits": dict.fromkeys(AXES, replace(DEFAULT_LIMITS, effort_jump_nm=0.0))},
    ],
    ids=["map 4", "switched off"],
)
def test_a_board_that_cannot_says_so_and_does_not_know_the_command(
    settings: dict[str, Any],
) -> None:
    bench = Bench(**settings)
    bench.board.stage_gains(OLD)
    with pytest.raises(BoardError, match="does not know this command"):
        bench.board.commit_running()
    assert bench.board.limits()["x"].effort_jump_nm == 0.0
    bench.wait(0.1)
    bench.start(SHORT)
    for _ in bench.board.capture_pages():
        pass
    bench.board.leave_to_rest()  # which waits for rest here
    assert not bench.board.coming_to_rest
    assert bench.board.status().state is State.IDLE
    bench.board.commit()
    assert bench.board.status().unconfirmed


def test_a_limit_that_is_no_number_fails_the_self_test() -> None:
    for jump, sound in ((-1.0, False), (math.nan, False), (math.inf, False), (0.0, True)):
        limits = dict.fromkeys(AXES, replace(DEFAULT_LIMITS, effort_jump_nm=jump))
        assert settings_sound(BoardSettings(limits=limits)) is sound
