"""What a virtual board keeps over a power cut, where it counts from, and how its time passes."""

from dataclasses import replace

import pytest
from board_bench import NEW, Bench, long_motion

from firmware_interface.board import Board
from firmware_interface.motion import Multisine, SineComponent, Trajectory
from firmware_interface.registers import REGISTERS, Fault, Opcode, Result, State
from firmware_interface.virtual.drive import RAD_PER_COUNT


def test_stores_are_counted_in_permanent_memory_and_only_what_differs_is_written() -> None:
    bench = Bench()
    bench.board.store()
    assert bench.board.status().stores == 0  # they stood there
    bench.commit()
    bench.board.confirm()
    for _ in range(2):
        bench.board.store()
        assert bench.board.status().stores == 1
    bench.virtual.power_cycle()
    board = Board.connect(bench.virtual)
    assert (board.status().stores, board.active_gains()) == (1, NEW)


@pytest.mark.parametrize(
    ("homed", "kept"), [(0, (False, False)), (1, (True, False)), (3, (True, True))]
)
def test_travel_counts_from_the_reference_mark_or_from_power_up(
    homed: int, kept: tuple[bool, bool]
) -> None:
    bench = Bench(homed=homed)
    bench.start(replace(long_motion(), duration_s=1.0))
    list(bench.board.capture_pages())
    bench.board.finish()
    before = bench.virtual.machine.drive.position_rad
    assert all(abs(position) > 0.1 for position in before)
    bench.virtual.power_cycle()
    after = bench.virtual.machine.drive.position_rad
    wanted = [position if stays else 0.0 for position, stays in zip(before, kept, strict=True)]
    assert after == pytest.approx(wanted, abs=1.5 * RAD_PER_COUNT)
    assert bench.virtual.read(REGISTERS["status.homed"].address, 1) == [homed]


def test_time_passes_in_stretches_for_a_host_that_waits_for_a_motion_only() -> None:
    bench = Bench()
    clock = bench.board.status().clock_samples
    assert bench.board.status().clock_samples == clock + 1
    bench.start(long_motion())
    clock = bench.virtual.machine.samples
    bench.virtual.read(REGISTERS["identity.nonce"].address, 2)
    bench.board.heartbeat()
    assert bench.virtual.machine.samples == clock + 2
    bench.board.status()
    assert bench.virtual.machine.samples == clock + 2 + 112


def test_a_motion_on_the_virtual_board_is_the_same_every_time(short_motion: Trajectory) -> None:
    captures = []
    for _ in range(2):
        bench = Bench()
        bench.wait(1.0)
        bench.start(short_motion)
        captures.append([page.position_rad.tolist() for page in bench.board.capture_pages()])
        bench.board.finish()
    assert captures[0] == captures[1]


def test_arm_takes_the_longest_trajectory_a_bounded_stretch_at_a_time() -> None:
    """Six hours of capture: the board answers all the while."""
    bench = Bench()
    bench.board.enable()
    sine = Multisine((SineComponent(0.5, 1.0, 0.0),))
    bench.board.write_trajectory(Trajectory({"x": sine, "z": sine}, 21600.0, 1.0))
    crc = bench.board._trajectory_crc
    assert bench.command(Opcode.ARM, 30500, crc) is Result.PENDING
    left = bench.board.status().samples_to_check
    assert 8_000_000 < left < 8_640_400
    assert left - bench.board.status().samples_to_check <= 1024
    for opcode in (Opcode.ARM, Opcode.START, Opcode.COMMIT, Opcode.DISABLE):
        assert bench.command(opcode, 30501 + opcode, crc) is Result.WRONG_STATE
    assert bench.virtual.machine.state is State.CHECKING
    bench.board.quick_stop()
    assert bench.board.status().samples_to_check == 0


def test_a_fault_ends_the_check() -> None:
    bench = Bench()
    bench.board.enable()
    bench.board.write_trajectory(replace(long_motion(), duration_s=3600.0))
    assert bench.command(Opcode.ARM, 30500, bench.board._trajectory_crc) is Result.PENDING
    bench.virtual.inputs.press_stop()
    status = bench.board.status()
    assert (status.state, status.fault) == (State.FAULT, Fault.STO)
    assert (status.last_result, status.samples_to_check) == (Result.WRONG_STATE, 0)
