"""The FPGA beside the reference firmware: its pins in simulation, and the firmware on it.

The conformance tests that reach the hardware run against it as well (conftest.py).
"""

import shutil
import subprocess
from pathlib import Path

import pytest
from conformance_boards import (
    FPGA_SOURCE,
    FPGA_SPEED,
    c_command,
    serving,
    start,
    until,
    until_fault,
)

from firmware_interface.motion import Multisine, SineComponent, Trajectory
from firmware_interface.registers import Fault, State

SINE = Multisine((SineComponent(0.5, 1.0, 0.0),))

CHECKS = (
    "counters_count_up_and_down",
    "both_counts_and_the_time_are_latched_at_one_edge",
    "a_tick_between_two_reads_mixes_no_samples",
    "counters_wrap_around",
    "a_lost_count_stops_the_effort_and_is_remembered",
    "without_enable_no_pulse_leaves",
    "density_of_pulses_is_the_effort",
    "effort_saturates_at_the_limit",
    "efforts_come_into_force_together_and_on_time",
    "counters_cannot_be_set_while_enabled",
    "the_watchdog_drops_the_effort_when_nobody_feeds_it",
    "a_program_that_runs_in_a_circle_does_not_feed",
    "the_stop_needs_no_clock_and_stays_latched",
    "a_stop_between_two_clock_edges_is_seen",
    "switches_are_told",
)


def test_no_check_of_the_pins_is_forgotten(fpga: Path) -> None:
    listed = subprocess.run([fpga / "fpga_checks"], capture_output=True, text=True, check=True)
    assert tuple(listed.stdout.split()) == CHECKS


@pytest.mark.parametrize("name", CHECKS)
def test_at_the_pins(fpga: Path, name: str) -> None:
    """`hdl/simulation/checks_*.cpp`."""
    ran = subprocess.run([fpga / "fpga_checks", name], capture_output=True, text=True, check=False)
    assert ran.returncode == 0, ran.stderr


@pytest.mark.skipif(shutil.which("verilator") is None, reason="needs verilator")
def test_no_tool_complains_about_the_sources(tmp_path: Path) -> None:
    command = ["make", "-s", "-C", str(FPGA_SOURCE), f"BUILD={tmp_path}", "lint"]
    said = subprocess.run(command, capture_output=True, text=True, check=False)
    assert (said.returncode, said.stderr) == (0, "")


def test_the_wired_stop_ends_a_motion_and_latches(fpga: Path) -> None:
    with serving(c_command(fpga, speed=FPGA_SPEED)) as served, served.connected() as board:
        start(board, Trajectory({"x": SINE, "z": SINE}, 60.0, 1.0))
        served.press_stop(True)
        assert until_fault(board) is Fault.STO
        until(board, lambda status: status.sto_active)
        served.press_stop(False)
        until(board, lambda status: not status.sto_active)
        board.clear_fault()
        assert board.status().state is State.IDLE
