"""What only the C firmware can show: its inputs, its permanent memory, its decoder, its builds."""

import json
import shutil
import subprocess
import sys
import time
from pathlib import Path

import pytest
from board_bench import NEW
from conformance_boards import (
    SOURCE,
    build_firmware,
    c_command,
    put_gains,
    serving,
    until,
    until_fault,
)

from firmware_interface.errors import BoardError
from firmware_interface.gains import AxisGains
from firmware_interface.motion import Multisine, SineComponent, Trajectory
from firmware_interface.registers import Fault, State
from firmware_interface.virtual.feed_drive import FEED_DRIVE, reduced_truth

SLOT_BYTES = 512


def test_optimised_it_builds_without_a_warning(tmp_path: Path) -> None:
    build_firmware(tmp_path, "all")
    assert (tmp_path / "firmware").is_file()


@pytest.mark.skipif(shutil.which("arm-none-eabi-gcc") is None, reason="needs arm-none-eabi-gcc")
def test_it_builds_for_a_cortex_m4_and_fits_one_with_128_kib(tmp_path: Path) -> None:
    command = ["make", "-j2", "-s", "-C", str(SOURCE), f"BUILD={tmp_path}", "size"]
    built = subprocess.run(command, capture_output=True, text=True, check=True)
    text, data, bss = map(int, built.stdout.splitlines()[-1].split()[:3])
    assert text + data < 16 * 1024
    assert data + bss < 72 * 1024


def test_nothing_but_the_port_calls_the_operating_system() -> None:
    allowed = {"math.h", "stdbool.h", "stddef.h", "stdint.h", "string.h"}
    for path in SOURCE.glob("*.[ch]"):
        lines = path.read_text("utf-8").splitlines()
        included = {
            line.split("<")[1].rstrip(">") for line in lines if line.startswith("#include <")
        }
        assert included <= allowed, path.name


@pytest.mark.parametrize("seed", ["1", "2", "3"])
def test_random_bytes_bring_nothing_but_frames_and_no_effort_in_fault(
    firmware: Path, seed: str
) -> None:
    command = [str(firmware / "fuzz_frames"), "100000", seed]
    ran = subprocess.run(command, capture_output=True, text=True, check=False)
    assert ran.returncode == 0, ran.stderr
    numbers = [int(word) for word in ran.stdout.split() if word.isdigit()]
    rounds, replies, exceptions, samples_with_effort, samples_in_fault = numbers
    assert rounds > replies > exceptions > 1000
    assert min(replies - exceptions, samples_with_effort, samples_in_fault) > 1000


def test_the_wired_stop_cuts_the_effort_and_latches(firmware: Path) -> None:
    sine = Multisine((SineComponent(0.5, 1.0, 0.0),))
    with serving(c_command(firmware)) as served, served.connected() as board:
        board.write_trajectory(Trajectory({"x": sine, "z": sine}, 60.0, 1.0))
        board.arm()
        board.start()
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


def test_a_whole_run_ends_with_new_gains(firmware: Path, tmp_path: Path) -> None:
    """Identify, write, verify, confirm and store on the rigid plant, ten times real time."""
    run = [sys.executable, "-c", "from edge_ident.cli import main; main()", "run", "--store"]
    with serving([str(firmware / "firmware"), "--speed", "10"]) as served:
        command = [*run, "--device", served.url, "--json", "--output", str(tmp_path)]
        ran = subprocess.run(command, capture_output=True, text=True, timeout=120, check=False)
    assert ran.returncode == 0, ran.stderr
    document = json.loads(ran.stdout)
    assert document["confirmed"]
    assert document["stored"]
    for axis, mechanics in FEED_DRIVE.items():
        found, truth = (
            document["identification"]["axes"][axis]["parameters"],
            reduced_truth(mechanics),
        )
        assert found["inertia"]["value"] == pytest.approx(truth.inertia, rel=0.01)
        assert found["coulomb_friction"]["value"] == pytest.approx(truth.coulomb_friction, rel=0.01)
        assert document["verification"][axis]["ratio"] > 5
