"""What only the C firmware can show: its inputs, its permanent memory, its decoder, its builds."""

import json
import re
import shutil
import subprocess
import sys
import time
from dataclasses import replace
from graphlib import TopologicalSorter
from pathlib import Path

import pytest
from board_bench import NEW
from conformance_boards import (
    SOURCE,
    build_firmware,
    c_command,
    key_of,
    put_gains,
    serving,
    start,
    until,
    until_fault,
)

from firmware_interface.board import Board
from firmware_interface.codec import encode
from firmware_interface.errors import BoardError
from firmware_interface.gains import AxisGains
from firmware_interface.motion import Multisine, SineComponent, Trajectory
from firmware_interface.plant.feed_drive import FEED_DRIVE
from firmware_interface.registers import REGISTERS, Fault, Opcode, State
from tests.repetitions import a_few

SLOT_BYTES = 1024
PARTS = [*SOURCE.glob("*.[ch]"), *SOURCE.glob("identification/*.[ch]")]


def test_optimised_it_builds_without_a_warning(tmp_path: Path) -> None:
    build_firmware(tmp_path, "all")
    assert (tmp_path / "firmware").is_file()


@pytest.mark.skipif(shutil.which("arm-none-eabi-gcc") is None, reason="needs arm-none-eabi-gcc")
def test_it_builds_for_a_cortex_m4_and_fits_one_with_128_kib(tmp_path: Path) -> None:
    command = ["make", "-j2", "-s", "-C", str(SOURCE), f"BUILD={tmp_path}", "size"]
    built = subprocess.run(command, capture_output=True, text=True, check=True)
    text, data, bss = map(int, built.stdout.splitlines()[-1].split()[:3])
    assert text + data < 24 * 1024
    assert data + bss < 72 * 1024


def test_nothing_but_the_port_calls_the_operating_system() -> None:
    allowed = {"math.h", "stdbool.h", "stddef.h", "stdint.h", "string.h"}
    for path in PARTS:
        lines = path.read_text("utf-8").splitlines()
        included = {
            line.split("<")[1].rstrip(">") for line in lines if line.startswith("#include <")
        }
        assert included <= allowed, path.name


def test_its_modules_do_not_call_each_other_in_a_circle() -> None:
    uses: dict[str, set[str]] = {}
    for path in PARTS:
        included = re.findall(r'#include "(?:\.\./)?(\w+)\.h"', path.read_text("utf-8"))
        uses.setdefault(path.stem, set()).update(set(included) - {path.stem})
    TopologicalSorter(uses).prepare()  # raises CycleError with the circle


CHECKS = (
    "power_up_leaves_the_effort_off",
    "bad_settings_fail_the_self_test_for_good",
    "stop_pulse_between_two_samples_is_seen",
    "a_pressed_limit_switch_lets_an_axis_only_away",
    "store_writes_only_what_changed_and_counts",
    "gains_that_map_3_stored_stay_in_force",
    "time_to_confirm_is_shown_saturating",
    "of_frames_back_to_back_the_first_is_carried_out",
    "every_other_function_is_refused",
    "full_torque_from_finite_numbers",
    "setpoint_that_is_no_number_switches_the_effort_off",
    "effort_that_is_no_number_switches_both_axes_off",
    "clamps_and_conversions_take_any_number",
    "encoder_counts_may_wrap_around",
    "quick_stop_in_a_stop_is_no_longer",
    "long_trajectories_do_not_block_the_line",
    "fault_during_the_check_ends_it",
    "efforts_and_jumps_are_limits_of_a_trajectory",
    "exchange_on_the_way_to_rest_does_not_step_the_effort",
    "jump_beyond_its_limit_leaves_all_as_it_is",
    "stops_and_the_next_command_come_first",
    "power_cut_at_any_step_leaves_the_old_gains_whole",
    "board_without_a_limit_does_not_know_the_command",
    "a_loop_that_keeps_an_axis_swinging_is_ended",
    "a_coupling_that_breaks_in_a_motion_is_seen",
    "a_hand_that_pushes_is_no_oscillation",
    "a_stop_ends_whatever_moves",
    "the_window_ends_whatever_moves",
    "the_watchdog_ends_whatever_moves",
    "a_silent_host_loses_the_board_though_an_axis_moves",
    "an_effort_that_would_jump_is_refused_at_rest",
    "feedback_that_is_unstable_as_stated_is_refused",
    "board_without_a_network_says_nothing",
)


def test_no_check_in_simulated_time_is_forgotten(firmware: Path) -> None:
    listed = subprocess.run([firmware / "checks"], capture_output=True, text=True, check=True)
    assert tuple(listed.stdout.split()) == CHECKS


@pytest.mark.parametrize("name", CHECKS)
def test_in_simulated_time(firmware: Path, name: str) -> None:
    """Looks from inside, sample by sample, where no host can: `simulated/checks_*.c`."""
    ran = subprocess.run([firmware / "checks", name], capture_output=True, text=True, check=False)
    assert ran.returncode == 0, ran.stderr


def test_the_wired_stop_cuts_the_effort_and_latches(firmware: Path) -> None:
    sine = Multisine((SineComponent(0.5, 1.0, 0.0),))
    with serving(c_command(firmware)) as served, served.connected() as board:
        start(board, Trajectory({"x": sine, "z": sine}, 60.0, 1.0))
        served.press_stop(True)
        assert until_fault(board) is Fault.STO
        until(board, lambda status: status.sto_active)
        time.sleep(0.05)
        with pytest.raises(BoardError, match="the wired emergency stop is active"):
            board.clear_fault()
        served.press_stop(False)
        until(board, lambda status: not status.sto_active)
        board.clear_fault()
        assert board.status().state is State.IDLE
        assert board.register_values("status.enabled") == (0,)


def test_a_pulse_of_the_wired_stop_shorter_than_a_sample_is_seen(firmware: Path) -> None:
    """In real time a sample takes 2.5 ms; press and release are microseconds apart."""
    with serving(c_command(firmware, speed=1.0)) as served, served.connected() as board:
        for _ in range(10):
            board.enable()
            served.press_stop(True)
            served.press_stop(False)
            assert until_fault(board) is Fault.STO
            assert board.register_values("status.sto_latched") == (1,)
            assert board.register_values("status.enabled") == (0,)
            until(board, lambda status: not status.sto_active)
            board.clear_fault()
            assert board.register_values("status.sto_latched") == (0,)


def test_the_line_is_served_while_a_long_trajectory_is_checked(firmware: Path) -> None:
    """Two hours of eight sines on each axis, in real time: only counts are compared, no times."""
    sines = Multisine(tuple(SineComponent(0.05, 0.3 + 0.1 * n, 0.0) for n in range(8)))
    motion = Trajectory({"x": sines, "z": sines}, duration_s=7_200.0, lead_in_s=600.0)
    with serving(c_command(firmware, speed=1.0)) as served, served.connected() as board:
        board.enable()
        board.write_trajectory(motion)
        board.claim()
        token = board.status().last_token + 1
        words = trajectory_command(board, token)
        board._link.write(REGISTERS["command.opcode"].address, words)
        left = []
        while board.status().state is State.CHECKING:
            left += board.register_values("status.samples_to_check")
            board.heartbeat()
        assert board.status().state is State.ARMED
        assert len(left) > 20
        assert left == sorted(left, reverse=True)
        assert left[0] > 2_500_000


def trajectory_command(board: Board, token: int) -> list[int]:
    """Words of ARM, to be sent without waiting for its end."""
    return [
        *encode("command.opcode", Opcode.ARM),
        *encode("command.token", token),
        *encode("command.argument", board._trajectory_crc),
        *encode("command.key", key_of(board)),
    ]


def test_main_loop_and_sample_interrupt_share_nothing_without_the_lock(tmp_path: Path) -> None:
    """ThreadSanitizer watches every verb while samples go on; a report is an exit code."""
    build_firmware(tmp_path, "threads")
    programs = tmp_path / "threads"
    probe = subprocess.run(
        [programs / "firmware", "?"], capture_output=True, text=True, check=False
    )
    if probe.returncode != 2:
        pytest.skip(f"ThreadSanitizer does not run here: {probe.stderr.strip()}")
    sine = Multisine((SineComponent(0.3, 1.0, 0.0),))
    motion = Trajectory({"x": sine, "z": sine}, 1.0, 0.5)
    with serving(c_command(programs, window_s=0.2)) as served, served.connected() as board:
        board.enable()
        board.write_trajectory(motion)
        for end in (board.finish, board.quick_stop):
            board.arm()
            board.start()
            list(board.capture_pages())
            end()
        put_gains(board, NEW)
        board.store()
        board.commit()
        board.roll_back()
        board.commit()
        until(board, lambda status: not status.unconfirmed)
        board.arm()
        board.start()
        served.press_stop(True)
        until_fault(board)
        served.press_stop(False)
        until(board, lambda status: not status.sto_active)
        board.clear_fault()


def powered(
    firmware: Path, memory: Path, store: dict[str, AxisGains] | None
) -> dict[str, AxisGains]:
    """Gains at power-up with this permanent memory; then others are stored."""
    with (
        serving(c_command(firmware, "--store", str(memory))) as served,
        served.connected() as board,
    ):
        found = board.active_gains()
        if store is not None:
            put_gains(board, store)
            board.store()
        return dict(found)


def test_stored_gains_outlast_a_power_cut_and_a_torn_write_leaves_the_ones_before(
    firmware: Path, tmp_path: Path
) -> None:
    memory = tmp_path / "memory"
    softer = {axis: AxisGains(96.0, 12.0, *[0.0] * 5, 0.5, 0.0) for axis in "xz"}
    first = powered(firmware, memory, NEW)
    assert powered(firmware, memory, softer) == NEW
    assert powered(firmware, memory, None) == softer
    whole = memory.read_bytes()
    assert len(whole) > SLOT_BYTES
    for cut in range(SLOT_BYTES, len(whole), 29):  # power fails in the middle of the second store
        memory.write_bytes(whole[:cut] + b"\xff" * (len(whole) - cut))  # the rest is erased flash
        assert powered(firmware, memory, None) == NEW
    memory.write_bytes(bytes(len(whole)))
    assert powered(firmware, memory, None) == first


def test_memory_is_written_only_for_other_gains_and_counts_its_writes_across_power_cuts(
    firmware: Path, tmp_path: Path
) -> None:
    memory = tmp_path / "memory"
    command = c_command(firmware, "--store", str(memory))
    for before in (0, 2):
        with serving(command) as served, served.connected() as board:
            assert board.register_values("status.stores") == (before,)
            if before == 0:
                put_gains(board, NEW)
                board.store()
                put_gains(board, {axis: replace(NEW[axis], derivative=10.0) for axis in "xz"})
            board.store()
            written = memory.read_bytes()
            board.store()
            assert memory.read_bytes() == written
            assert board.register_values("status.stores") == (2,)


def test_gains_that_are_not_stored_do_not_outlast_a_power_cut(
    firmware: Path, tmp_path: Path
) -> None:
    memory = tmp_path / "memory"
    with (
        serving(c_command(firmware, "--store", str(memory))) as served,
        served.connected() as board,
    ):
        first = board.active_gains()
        put_gains(board, NEW)
    assert powered(firmware, memory, None) == first


def test_a_memory_that_fails_is_reported(firmware: Path, tmp_path: Path) -> None:
    absent = tmp_path / "absent" / "memory"
    with (
        serving(c_command(firmware, "--store", str(absent))) as served,
        served.connected() as board,
    ):
        with pytest.raises(BoardError, match="permanent memory did not take the gains"):
            board.store()
        assert board.status().state is State.IDLE


def test_every_power_up_draws_another_nonce(firmware: Path) -> None:
    nonces = set()
    for _ in range(3):
        with serving(c_command(firmware)) as served, served.connected() as board:
            nonces.add(tuple(board._link.read(0x000A, 2)))
    assert len(nonces) == 3


@pytest.mark.parametrize("programs", a_few(["firmware", "fpga"], ["fpga"]))
def test_a_whole_run_ends_with_new_gains(
    programs: str, request: pytest.FixtureRequest, tmp_path: Path
) -> None:
    """Identify, write, verify, confirm and store on the rigid plant, ten times real time.

    Behind the simulated FPGA too: pulses, edges and a power stage lie between law and plant.
    """
    run = [sys.executable, "-m", "edge_ident", "run", "--store"]
    program = request.getfixturevalue(programs) / "firmware"
    with serving([str(program), "--speed", "10"]) as served:
        command = [*run, "--device", served.url, "--json", "--output", str(tmp_path)]
        ran = subprocess.run(command, capture_output=True, text=True, timeout=120, check=False)
    assert ran.returncode == 0, ran.stderr
    document = json.loads(ran.stdout)
    assert document["confirmed"]
    assert document["stored"]
    for axis, mechanics in FEED_DRIVE.items():
        found, truth = (
            document["identification"]["axes"][axis]["parameters"],
            mechanics,
        )
        assert found["inertia"]["value"] == pytest.approx(truth.inertia, rel=0.01)
        assert found["coulomb_friction"]["value"] == pytest.approx(truth.coulomb_friction, rel=0.01)
        assert document["verification"][axis]["ratio"] > 5
