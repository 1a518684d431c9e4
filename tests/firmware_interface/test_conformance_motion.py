"""Both boards move alike: the reference, the law, the limits, the faults, the capture."""

import math
import time
from dataclasses import replace

import numpy as np
import pytest
from board_bench import NEW, long_motion
from conformance_boards import (
    BoardCommand,
    command,
    put_gains,
    refused,
    serving,
    until,
    until_fault,
)

from firmware_interface.board import Board, CapturePage
from firmware_interface.codec import decode_page, encode
from firmware_interface.errors import BoardError, LinkError
from firmware_interface.motion import (
    Multisine,
    SineComponent,
    Staircase,
    Trajectory,
    reference,
    stop_duration_s,
)
from firmware_interface.registers import (
    MAP_CRC,
    PAGE_ADDRESS,
    PAGE_SLOTS,
    PAGE_WORDS,
    REGISTERS,
    Fault,
    Opcode,
    Result,
    State,
    WatchdogAction,
)
from firmware_interface.virtual.controller import AxisController, Setpoint
from firmware_interface.virtual.settings import CONSERVATIVE_GAINS, DEFAULT_LIMITS

COUNT_RAD = 2.0 * np.pi / 8400
PERIOD_S = 0.0025


def start(board: Board, motion: Trajectory) -> None:
    board.write_trajectory(motion)
    board.arm()
    board.start()


def capture(board: Board, motion: Trajectory) -> list[CapturePage]:
    start(board, motion)
    pages = list(board.capture_pages())
    board.finish()
    return pages


def joined(pages: list[CapturePage], column: str) -> np.ndarray:
    return np.vstack([getattr(page, column) for page in pages])


def sines(*components: tuple[float, float, float]) -> Multisine:
    return Multisine(tuple(SineComponent(*component) for component in components))


RICH = Trajectory(
    {
        "x": sines((0.5, 2.0, 0.3), (0.1, -7.0, 1.0), (0.02, 40.0, -20.0), (0.3, 0.0, 1.5)),
        "z": sines((0.4, 1.5, 100.0)),
    },
    duration_s=701 * PERIOD_S,
    lead_in_s=2.0,  # enough to get there from wherever the motion before ended
)
SHORT = replace(RICH, duration_s=421 * PERIOD_S)
LONG = replace(long_motion(), lead_in_s=2.0)
STAIRS = Trajectory(
    {
        "x": Staircase((0.4, -0.7, 0.0, 0.3), 0.3331, 3.0),
        "z": Staircase((-0.2, 0.9), 0.0, 1.5),
    },
    duration_s=2.5,
    lead_in_s=0.5,
)


@pytest.mark.parametrize("motion", [RICH, STAIRS], ids=["multisine", "staircase"])
def test_the_reference_is_that_of_the_motion(either_board: Board, motion: Trajectory) -> None:
    """To half a count; a staircase counts from where the axis rested, which is read half a count
    off."""
    pages = capture(either_board, motion)
    followed = joined(pages, "position_rad") + joined(pages, "following_error_rad")
    times = np.arange(len(followed)) * PERIOD_S
    for n, axis in enumerate(either_board.axes):
        wanted = reference(motion.axes[axis], times, motion.lead_in_s, 0.0).position_rad
        start_rad = followed[0, n] - wanted[0] if motion is STAIRS else 0.0
        slack = 1.02 if motion is STAIRS else 0.51
        np.testing.assert_allclose(followed[:, n], start_rad + wanted, atol=slack * COUNT_RAD)


def test_pages_are_whole_consecutive_and_end_with_the_motion(either_board: Board) -> None:
    pages = capture(either_board, SHORT)
    assert [page.first_sample for page in pages] == list(range(0, 421, 14))
    assert len(pages[-1].position_rad) == 1  # 30 full pages and the rest
    status = either_board.status()
    assert (status.pages_written, status.samples_captured, status.overflows) == (31, 421, 0)
    slot = PAGE_ADDRESS + 30 * 128
    assert decode_page(either_board._link.read(slot, PAGE_WORDS)).index == 30
    assert either_board._link.read(slot + 13, PAGE_WORDS - 15) == [0] * (PAGE_WORDS - 15)


def test_the_effort_is_that_of_the_law(either_board: Board) -> None:
    """The documented law, from the captured positions, gives the captured effort to a count.

    What it remembers from before the capture fades with the velocity filter; the first of two
    motions leaves out the integral part, which does not.
    """
    gains = {axis: replace(NEW[axis], proportional=64.0, derivative=8.0) for axis in NEW}
    put_gains(either_board, gains)
    pages = capture(either_board, RICH)
    position, effort = joined(pages, "position_rad"), joined(pages, "effort_nm")
    times = np.arange(len(position)) * PERIOD_S
    for n, axis in enumerate(either_board.axes):
        followed = reference(RICH.axes[axis], times, RICH.lead_in_s, 0.0)
        law = AxisController(gains[axis], PERIOD_S, DEFAULT_LIMITS.effort_nm)
        law.reset(float(position[0, n]))
        rows = zip(*(np.asarray(c).tolist() for c in vars(followed).values()), strict=True)
        wanted = [
            law.effort_nm(Setpoint(*row), p)
            for row, p in zip(rows, position[:, n].tolist(), strict=True)
        ]
        np.testing.assert_allclose(effort[60:, n], wanted[60:], atol=0.0061)


AT_ZERO = Trajectory(dict.fromkeys("xz", sines((0.0, 1.0, 0.0))), 0.1, 2.0)
STANDING = Trajectory(dict.fromkeys("xz", Staircase((0.0,), 1.0, 1.0)), 0.1, 0.1)


def test_the_lead_in_feeds_its_own_acceleration_forward(either_board: Board) -> None:
    """A third of a radian in 0.3 s takes 9 N*m, which soft feedback alone does not bring."""
    exact = replace(
        CONSERVATIVE_GAINS,
        proportional=60.0,
        inertia_feedforward=0.4,
        viscous_feedforward=0.8,
        coulomb_feedforward=1.2,
        coulomb_smoothing_rad_s=0.02,
    )
    put_gains(either_board, dict.fromkeys("xz", exact))
    capture(either_board, AT_ZERO)
    step = Trajectory(dict.fromkeys("xz", sines((0.35, 0.0, np.pi / 2))), 0.1, 0.3)
    errors = joined(capture(either_board, step), "following_error_rad")
    assert np.abs(errors).max() < 0.03


def test_after_the_motion_the_reference_stops_along_its_cubic(either_board: Board) -> None:
    """Where it rests, half the speed times the duration of the stop further on."""
    pages = capture(either_board, SHORT)
    last = pages[-1].position_rad[-1] + pages[-1].following_error_rad[-1]
    pages = capture(either_board, STANDING)
    resting = pages[0].position_rad + pages[0].following_error_rad
    times = [420 * PERIOD_S]
    ends = [reference(SHORT.axes[axis], times, SHORT.lead_in_s, 0.0) for axis in "xz"]
    speeds = np.array([end.velocity_rad_s[0] for end in ends])
    way = speeds * max(map(stop_duration_s, speeds)) / 2.0
    assert np.all(np.abs(way) > 20 * COUNT_RAD)
    np.testing.assert_allclose(resting, np.broadcast_to(last + way, resting.shape), atol=COUNT_RAD)


def test_a_commit_at_rest_moves_nothing(either_board: Board) -> None:
    """Friction holds the axes off their setpoints; stiffer gains must not pull them there."""
    capture(either_board, SHORT)
    before = joined(capture(either_board, STANDING), "position_rad")
    stiffer = replace(CONSERVATIVE_GAINS, proportional=300.0, derivative=25.0)
    put_gains(either_board, dict.fromkeys("xz", stiffer))
    pages = capture(either_board, STANDING)
    after, errors = joined(pages, "position_rad"), joined(pages, "following_error_rad")
    np.testing.assert_allclose(after[-1], before[-1], atol=2.1 * COUNT_RAD)
    np.testing.assert_allclose(errors, 0.0, atol=2.1 * COUNT_RAD)


def test_one_motion_per_token_and_repeated_frames_are_ignored(either_board: Board) -> None:
    either_board.write_trajectory(SHORT)
    either_board.arm()
    for _ in range(3):
        assert command(either_board, Opcode.START, 40000, MAP_CRC) is Result.DONE
    pages = list(either_board.capture_pages())
    assert len(pages) == 31
    until(either_board, lambda status: status.state is State.DONE)
    either_board.finish()
    either_board.arm()
    command(either_board, Opcode.START, 40000, MAP_CRC)  # a frame that comes very late
    assert either_board.status().state is State.ARMED


def test_start_needs_arm_and_the_map_crc(either_board: Board) -> None:
    assert command(either_board, Opcode.START, 41000, MAP_CRC) is Result.WRONG_STATE
    either_board.write_trajectory(SHORT)
    either_board.arm()
    assert command(either_board, Opcode.START, 41001, MAP_CRC ^ 1) is Result.WRONG_ARGUMENT
    assert command(either_board, Opcode.ARM, 41002) is Result.WRONG_STATE
    assert either_board.status().state is State.ARMED
    assert command(either_board, Opcode.QUICK_STOP, 41003) is Result.DONE
    assert either_board.status().state is State.IDLE


def test_the_board_waits_for_the_last_page(either_board: Board) -> None:
    start(either_board, SHORT)
    until(either_board, lambda status: status.state is State.DRAINING)
    time.sleep(0.1)
    status = either_board.status()
    assert (status.state, status.samples_captured) == (State.DRAINING, 421)
    assert command(either_board, Opcode.FINISH, 42000) is Result.WRONG_STATE
    list(either_board.capture_pages())
    until(either_board, lambda status: status.state is State.DONE)
    either_board.finish()


@pytest.mark.parametrize(
    ("motion", "why"),
    [
        (sines((10.5, 0.2, 1.5)), "travel or speed limits"),
        (sines((2.0, 2.5, 0.0)), "travel or speed limits"),
        (sines((5.0, 0.0, 1.5708), (4.9, 0.75, 0.0)), "travel or speed limits"),  # the way to rest
        (Staircase((1.0, 4.1), 0.1, 50.0), "travel or speed limits"),
        (Staircase((-3.0,), 3.5, 1.0), "travel or speed limits"),
        (sines(), "incomplete or not finite"),
        (sines((math.inf, 1.0, 0.0)), "incomplete or not finite"),
        (sines((0.1, 1.0, math.nan)), "incomplete or not finite"),
        (Staircase((), 1.0, 1.0), "incomplete or not finite"),
        (Staircase((1.0,), 1.0, 0.0), "incomplete or not finite"),
        (Staircase((1.0,), -1.0, 1.0), "incomplete or not finite"),
        (Staircase((math.nan,), 1.0, 1.0), "incomplete or not finite"),
    ],
)
def test_motions_that_may_not_be_are_not_armed(
    either_board: Board, motion: Multisine | Staircase, why: str
) -> None:
    harmless: Multisine | Staircase = sines((0.1, 1.0, 0.0))
    if isinstance(motion, Staircase):
        harmless = Staircase((0.1,), 1.0, 1.0)
    axes = {"x": harmless, "z": motion}
    either_board.write_trajectory(Trajectory(axes, 5.0, 1.0))  # type: ignore[arg-type]
    with pytest.raises(BoardError, match=why):
        either_board.arm()
    assert either_board.status().state is State.IDLE


def test_an_unknown_kind_of_motion_is_not_armed(either_board: Board) -> None:
    either_board.write_trajectory(SHORT)
    either_board._link.write(REGISTERS["trajectory.kind"].address, [3])
    assert command(either_board, Opcode.ARM, 43000) is Result.BAD_TRAJECTORY


SOFT = replace(CONSERVATIVE_GAINS, proportional=6.0, derivative=0.0)
STIFF = replace(CONSERVATIVE_GAINS, proportional=360.0, derivative=0.0)
FAULTS = {
    # 6 N*m/rad lag by 0.6 rad against friction of 3.6 N*m, and more while speeding up
    Fault.FOLLOWING_ERROR: (SOFT, Staircase((2.4,), 3.0, 4.0)),
    # without damping a step of the speed overshoots
    Fault.SPEED: (STIFF, Staircase((0.1, 3.9), 0.5, 60.0)),
    # 2 N*m too much push a slow axis 0.15 rad ahead of a reference that ends 0.1 rad inside
    Fault.TRAVEL: (replace(SOFT, offset_feedforward=2.2), Staircase((0.1, 2.0, 0.05), 3.67, 2.0)),
}


@pytest.mark.parametrize("fault", FAULTS, ids=lambda fault: fault.name)
def test_limits_are_enforced_during_the_motion(fresh_board: Board, fault: Fault) -> None:
    gains, stairs = FAULTS[fault]
    put_gains(fresh_board, dict.fromkeys("xz", gains))
    start(fresh_board, Trajectory({"x": stairs, "z": stairs}, 15.0, 2.0))
    assert until_fault(fresh_board) is fault
    status = fresh_board.status()
    assert 0 < status.fault_sample <= status.clock_samples


def test_a_fault_stays_until_it_is_cleared(either_board: Board) -> None:
    either_board._link.write(REGISTERS["watchdog.timeout"].address, [100])
    start(either_board, LONG)
    time.sleep(0.3)
    until_fault(either_board)
    either_board._link.write(REGISTERS["watchdog.timeout"].address, [1000])
    for opcode in (Opcode.ARM, Opcode.COMMIT, Opcode.FINISH, Opcode.START):
        assert command(either_board, opcode, 44000 + opcode, MAP_CRC) is Result.WRONG_STATE
    either_board.quick_stop()
    assert either_board.status().fault is Fault.WATCHDOG
    either_board.clear_fault()
    status = either_board.status()
    assert (status.state, status.fault, status.fault_sample) == (State.IDLE, Fault.NONE, 0)


@pytest.mark.parametrize(
    ("action", "state"),
    [(WatchdogAction.QUICK_STOP, State.STOPPING), (WatchdogAction.COAST, State.FAULT)],
    ids=lambda code: code.name,
)
def test_the_board_stops_by_itself_when_the_host_is_gone(
    command_of_either: BoardCommand, action: WatchdogAction, state: State
) -> None:
    """Five times slower than time, a stop under control takes more than a second."""
    with serving(command_of_either(speed=0.2)) as served, served.connected() as board:
        board._link.write(REGISTERS["watchdog.timeout"].address, [100, action])
        start(board, replace(LONG, lead_in_s=0.1))
        until(board, lambda status: status.samples_captured > 0)
        time.sleep(0.3)
        status = board.status()
        assert (status.state, status.fault) == (state, Fault.WATCHDOG)
        assert until_fault(board) is Fault.WATCHDOG
        board.clear_fault()  # carried out at rest only


def test_any_valid_frame_keeps_the_watchdog_quiet_even_a_refused_one(either_board: Board) -> None:
    either_board._link.write(REGISTERS["watchdog.timeout"].address, [150])
    start(either_board, LONG)
    for _ in range(8):
        time.sleep(0.05)
        assert refused(either_board, REGISTERS["identity.magic"].address, [0]) == 2
    assert either_board.status().state is State.MOVING
    either_board._link.write(REGISTERS["watchdog.timeout"].address, [1000])


def test_quick_stop_decelerates_and_leaves_the_board_idle(either_board: Board) -> None:
    start(either_board, LONG)
    until(either_board, lambda status: status.samples_captured > 100)
    either_board.quick_stop()
    until(either_board, lambda status: status.state is not State.STOPPING)
    status = either_board.status()
    assert (status.state, status.fault) == (State.IDLE, Fault.NONE)


def test_an_overrun_ring_counts_what_was_lost(either_board: Board) -> None:
    start(either_board, LONG)
    until(either_board, lambda status: status.overflows >= 3, timeout_s=10.0)
    first = decode_page(either_board._link.read(PAGE_ADDRESS, PAGE_WORDS))
    assert (first.index, first.first_sample) == (PAGE_SLOTS, PAGE_SLOTS * 14)
    with pytest.raises(LinkError, match="overwritten before they were fetched"):
        list(either_board.capture_pages())


def test_the_ring_goes_round_while_the_host_acknowledges(either_board: Board) -> None:
    motion = replace(LONG, duration_s=10.5)  # 300 pages in 256 slots
    pages = capture(either_board, motion)
    assert [page.first_sample for page in pages] == list(range(0, 4200, 14))
    assert either_board.status().overflows == 0


def test_acknowledge_is_a_number_of_pages_and_starts_at_zero(either_board: Board) -> None:
    register = REGISTERS["capture.pages_acknowledged"]
    either_board._link.write(register.address, encode(register.name, 31))
    start(either_board, SHORT)
    assert either_board._link.read(register.address, 2) == [0, 0]
