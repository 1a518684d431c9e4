"""What the virtual board does by itself: watchdog, limits, roll back, tokens, ring, memory."""

from collections.abc import Iterator
from dataclasses import replace
from itertools import islice

import numpy as np
import pytest
from board_bench import NEW, OLD, Bench, long_motion

from firmware_interface.board import Board
from firmware_interface.codec import crc32, encode
from firmware_interface.errors import BoardError, LinkError
from firmware_interface.gains import encode_gains
from firmware_interface.motion import Trajectory
from firmware_interface.registers import (
    MAP_CRC,
    REGISTERS,
    Fault,
    Opcode,
    Result,
    State,
    WatchdogAction,
)
from firmware_interface.virtual import setpoints
from firmware_interface.virtual.board import VirtualBoard, WallClock
from firmware_interface.virtual.drive import RAD_PER_COUNT
from firmware_interface.virtual.settings import DEFAULT_LIMITS


@pytest.mark.parametrize("action", list(WatchdogAction))
def test_the_board_stops_by_itself_when_the_host_is_gone(action: WatchdogAction) -> None:
    bench = Bench()
    bench.virtual.write(REGISTERS["watchdog.action"].address, [action])
    bench.start(long_motion())
    bench.wait(0.6)
    assert bench.virtual.machine.state is State.MOVING
    bench.wait(3.0)
    machine = bench.virtual.machine
    assert (machine.state, machine.fault) == (State.FAULT, Fault.WATCHDOG)
    assert np.max(np.abs(machine.drive.plant.output_rad_s)) < 1e-3
    with pytest.raises(BoardError, match="the host that started the motion fell silent"):
        list(bench.board.capture_pages())


def test_heartbeats_keep_the_watchdog_quiet_and_reading_does_not() -> None:
    bench = Bench()
    bench.start(long_motion())
    for _ in range(5):
        bench.wait(0.6)
        bench.board.heartbeat()
    assert bench.virtual.machine.state is State.MOVING
    for _ in range(3):
        bench.wait(0.6)
        bench.virtual.read(REGISTERS["identity.nonce"].address, 2)
    assert bench.virtual.machine.fault is Fault.WATCHDOG


def test_a_shorter_watchdog_time_counts() -> None:
    bench = Bench()
    bench.virtual.write(REGISTERS["watchdog.timeout"].address, encode("watchdog.timeout", 0.3))
    bench.start(long_motion())
    bench.wait(1.5)
    assert bench.virtual.machine.fault is Fault.WATCHDOG


def test_silence_at_rest_is_no_fault() -> None:
    bench = Bench()
    bench.wait(5.0)
    assert bench.virtual.machine.state is State.IDLE


@pytest.mark.parametrize(
    ("fault", "limit"),
    [
        (Fault.TRAVEL, {"travel_rad": 0.5}),
        (Fault.SPEED, {"speed_rad_s": 0.2}),
        (Fault.FOLLOWING_ERROR, {"following_error_rad": 0.02}),
    ],
)
def test_the_board_enforces_its_limits_during_the_motion(
    fault: Fault, limit: dict[str, float], monkeypatch: pytest.MonkeyPatch
) -> None:
    bench = Bench(limits=dict.fromkeys("xz", replace(DEFAULT_LIMITS, **limit)))
    # a motion within limits that goes astray: the check before the motion is not what is tested
    monkeypatch.setattr(setpoints, "_at_most", lambda *_arguments: True)
    bench.start(long_motion())
    with pytest.raises(BoardError, match=f"fault {fault.name}"):
        list(bench.board.capture_pages())
    bench.wait(1.0)
    machine = bench.virtual.machine
    assert machine.state is State.FAULT
    assert machine.fault_sample > 0
    assert np.max(np.abs(machine.drive.plant.output_rad_s)) < 1e-3


def test_effort_is_clipped_at_its_limit(short_motion: Trajectory) -> None:
    weak = dict.fromkeys("xz", replace(DEFAULT_LIMITS, effort_nm=2.0))
    bench = Bench(limits=weak)
    bench.start(short_motion)
    efforts = [abs(page.effort_nm).max() for page in bench.board.capture_pages()]
    assert max(efforts) == pytest.approx(2.0, abs=0.004)


def test_quick_stop_decelerates_instead_of_dropping_the_effort() -> None:
    bench = Bench()
    bench.start(long_motion())
    bench.wait(0.6)
    bench.board.quick_stop()
    machine = bench.virtual.machine
    assert machine.state is State.IDLE
    assert machine.drive.powered
    assert np.max(np.abs(machine.drive.plant.output_rad_s)) < 1e-3


def test_unconfirmed_gains_are_rolled_back_when_the_window_ends() -> None:
    bench = Bench(confirm_window_s=2.0)
    bench.commit()
    bench.wait(1.9)
    assert bench.board.active_gains() == NEW
    assert 0.0 < bench.board.status().confirm_remaining_s < 0.2
    bench.wait(0.2)
    assert bench.board.active_gains() == OLD
    with pytest.raises(BoardError, match="window may have expired"):
        bench.board.confirm()


def test_the_window_does_not_change_gains_during_a_motion(short_motion: Trajectory) -> None:
    bench = Bench(confirm_window_s=0.3)
    bench.commit()
    bench.start(short_motion)
    bench.wait(0.5)
    bench.board.heartbeat()
    assert bench.board.status().state is State.MOVING
    assert bench.board.active_gains() == NEW
    list(bench.board.capture_pages())
    bench.board.finish()
    assert bench.board.active_gains() == OLD


@pytest.mark.parametrize("end", ["quick stop", "watchdog"])
def test_a_stop_with_unconfirmed_gains_rolls_back_once_at_rest(end: str) -> None:
    bench = Bench()
    bench.commit()
    bench.start(long_motion())
    bench.wait(0.6)
    if end == "quick stop":
        bench.board.quick_stop()
    else:
        bench.wait(3.0)
    assert not bench.board.status().unconfirmed
    assert bench.board.active_gains() == OLD


def test_committed_gains_are_those_that_the_controllers_use() -> None:
    """Twice the stiffness, without anything else, halves the lag behind a constant speed."""
    lags = []
    for scale in (1.0, 2.0):
        bench = Bench()
        old = OLD["x"]
        stiffer = replace(
            old, proportional=scale * old.proportional, derivative=scale * old.derivative
        )
        bench.board.stage_gains(dict.fromkeys("xz", stiffer))
        bench.board.commit()
        bench.start(long_motion())
        page = next(islice(bench.board.capture_pages(), 30, None))
        lags.append(page.following_error_rad[0])
    assert lags[1] == pytest.approx(lags[0] / 2.0, rel=0.1)


def test_a_commit_at_rest_moves_nothing() -> None:
    """Friction holds the axis off its setpoint; ten times the stiffness must not pull it there."""
    bench = Bench()
    bench.start(long_motion())
    list(bench.board.capture_pages())
    bench.board.finish()
    before = bench.virtual.machine.drive.position_rad
    stiffer = replace(OLD["x"], proportional=300.0, derivative=25.0)
    bench.board.stage_gains(dict.fromkeys("xz", stiffer))
    bench.board.commit()
    bench.wait(1.0)
    assert bench.virtual.machine.drive.position_rad == pytest.approx(before, abs=2 * RAD_PER_COUNT)


def test_a_token_seen_before_is_ignored_even_if_not_the_last() -> None:
    bench = Bench()
    bench.board.stage_gains(NEW)
    crc = crc32(encode_gains(NEW))
    assert bench.command(Opcode.COMMIT, 30101, crc) is Result.DONE
    assert bench.command(Opcode.ROLL_BACK, 30102) is Result.DONE
    assert bench.command(Opcode.COMMIT, 30101, crc) is Result.DONE  # still the result of 30102
    assert bench.board.status().last_token == 30102
    assert bench.board.active_gains() == OLD


def test_start_needs_the_map_crc(short_motion: Trajectory) -> None:
    bench = Bench()
    bench.arm(short_motion)
    assert bench.command(Opcode.START, 30900, MAP_CRC ^ 1) is Result.WRONG_ARGUMENT
    assert bench.command(99, 30901) is Result.UNKNOWN_COMMAND
    assert bench.command(Opcode.START, 30902, MAP_CRC) is Result.DONE


def test_registers_keep_their_access_and_ranges() -> None:
    board = VirtualBoard()
    for address, words in (
        (REGISTERS["identity.magic"].address, [0, 0]),
        (REGISTERS["active.x.proportional"].address, [0, 0]),
        (REGISTERS["watchdog.timeout"].address, [0]),
        (REGISTERS["command.opcode"].address, [Opcode.ARM]),  # without token and argument
        (0x0F00, [1]),
        (0xFFFF, [1]),
    ):
        with pytest.raises(BoardError):
            board.write(address, words)
    with pytest.raises(BoardError, match="no registers to read"):
        board.read(0x0F00, 1)


def test_time_stands_still_while_the_ring_is_full() -> None:
    """At full speed nothing is lost, however late the host fetches."""
    bench = Bench()
    bench.start(replace(long_motion(), duration_s=12.0))
    for _ in range(60):
        bench.board.heartbeat()
        bench.board.status()
    assert bench.board.status().pages_written == 256
    pages = list(bench.board.capture_pages())
    assert [page.first_sample for page in pages] == list(range(0, 4800, 14))


def test_a_ring_that_overflows_in_real_time_is_reported(monkeypatch: pytest.MonkeyPatch) -> None:
    now = 0.0
    monkeypatch.setattr(WallClock, "now_s", lambda self: now)
    virtual = VirtualBoard(clock=WallClock(1.0))

    def passing() -> Iterator[None]:
        nonlocal now
        while True:
            now += 0.02
            yield

    ticks = passing()
    read = virtual.read
    monkeypatch.setattr(virtual, "read", lambda a, n: (next(ticks), read(a, n))[1])
    board = Board.connect(virtual)
    board.enable()
    board.write_trajectory(long_motion())
    board.arm()
    board.start()
    while board.status().overflows == 0:
        board.heartbeat()
    with pytest.raises(LinkError, match="overwritten before they were fetched"):
        list(board.capture_pages())
