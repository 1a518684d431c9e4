"""Both boards move alike: the reference, the law, the stop, the capture."""

from dataclasses import replace

import numpy as np
import pytest
from board_bench import NEW, long_motion
from conformance_boards import command, put_gains, refused_value, sines, start, until

from firmware_interface.board import Board, CapturePage
from firmware_interface.codec import decode_page
from firmware_interface.errors import LinkError
from firmware_interface.gains import CONSERVATIVE_GAINS
from firmware_interface.motion import Staircase, Trajectory, reference, stop_duration_s
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
)
from firmware_interface.virtual.controller import AxisController, Setpoint
from firmware_interface.virtual.settings import DEFAULT_LIMITS

COUNT_RAD = 2.0 * np.pi / 8400
PERIOD_S = 0.0025


def capture(board: Board, motion: Trajectory) -> list[CapturePage]:
    start(board, motion)
    pages = list(board.capture_pages())
    board.finish()
    return pages


def joined(pages: list[CapturePage], column: str) -> np.ndarray:
    return np.vstack([getattr(page, column) for page in pages])


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

    All terms of the law but the integral part act. What it remembers from before the capture fades
    with the velocity filter and along the reference.
    """
    softer = {"proportional": 64.0, "derivative": 8.0, "inertia_feedforward": 0.125}
    gains = {axis: replace(NEW[axis], **softer) for axis in NEW}
    put_gains(either_board, gains)
    pages = capture(either_board, RICH)
    position, effort = joined(pages, "position_rad"), joined(pages, "effort_nm")
    times = np.arange(len(position)) * PERIOD_S
    followed = [
        vars(reference(RICH.axes[axis], times, RICH.lead_in_s, 0.0)) for axis in either_board.axes
    ]
    setpoints = [
        [Setpoint(*row) for row in zip(*(c.tolist() for c in way.values()), strict=True)]
        for way in followed
    ]
    for n, axis in enumerate(either_board.axes):
        law = AxisController(gains[axis], PERIOD_S, DEFAULT_LIMITS.effort_nm)
        law.reset(float(position[0, n]))
        wanted = [
            law.effort_nm(own, p, other)
            for own, other, p in zip(
                setpoints[n], setpoints[1 - n], position[:, n].tolist(), strict=True
            )
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
    # what friction held off the old setpoint holds the new one off with the same effort
    held_nm = stiffer.proportional * errors
    assert np.all(np.ptp(errors, axis=0) < 2.1 * COUNT_RAD)
    assert np.all(np.abs(held_nm) < 2.4)


def test_one_motion_per_token_and_repeated_frames_are_ignored(either_board: Board) -> None:
    either_board.enable()
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
    either_board.enable()
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
    status = until(either_board, lambda status: status.state is State.DRAINING)
    later = status.clock_samples + 400  # long after the axes came to rest
    status = until(either_board, lambda status: status.clock_samples > later)
    assert (status.state, status.samples_captured) == (State.DRAINING, 421)
    assert command(either_board, Opcode.FINISH, 42000) is Result.WRONG_STATE
    list(either_board.capture_pages())
    until(either_board, lambda status: status.state is State.DONE)
    either_board.finish()


def test_quick_stop_decelerates_and_leaves_the_board_idle(either_board: Board) -> None:
    start(either_board, LONG)
    until(either_board, lambda status: status.samples_captured > 100)
    either_board.quick_stop()
    until(either_board, lambda status: status.state is not State.STOPPING)
    status = either_board.status()
    assert (status.state, status.fault) == (State.IDLE, Fault.NONE)


def test_an_overrun_ring_counts_what_was_lost(either_board: Board) -> None:
    start(either_board, LONG)
    until(either_board, lambda status: status.overflows >= 3)
    first = decode_page(either_board._link.read(PAGE_ADDRESS, PAGE_WORDS))
    assert (first.index, first.first_sample) == (PAGE_SLOTS, PAGE_SLOTS * 14)
    with pytest.raises(LinkError, match="overwritten before they were fetched"):
        list(either_board.capture_pages())


def test_the_ring_goes_round_while_the_host_acknowledges(either_board: Board) -> None:
    motion = replace(LONG, duration_s=10.5)  # 300 pages in 256 slots
    pages = capture(either_board, motion)
    assert [page.first_sample for page in pages] == list(range(0, 4200, 14))
    assert either_board.status().overflows == 0


def test_acknowledged_pages_only_grow_and_start_at_zero(either_board: Board) -> None:
    register = REGISTERS["capture.pages_acknowledged"]
    capture(either_board, SHORT)
    for fewer in (30, 0, 31):
        assert refused_value(either_board, register.name, fewer) == 0
        assert either_board._link.read(register.address, 2) == [0, 31]
    assert refused_value(either_board, register.name, 32) == 3
    start(either_board, SHORT)
    assert either_board._link.read(register.address, 2) == [0, 0]


def test_a_quick_stop_during_a_stop_does_not_begin_it_anew(either_board: Board) -> None:
    """Half the speed times the duration of one stop is all the way there is."""
    stiff = replace(CONSERVATIVE_GAINS, proportional=300.0, derivative=25.0)
    put_gains(either_board, dict.fromkeys("xz", stiff))
    motion = Trajectory(dict.fromkeys("xz", sines((2.0, 1.5, 0.0))), 30.0, 6.0)
    start(either_board, motion)
    until(either_board, lambda status: status.samples_captured > 0)
    command(either_board, Opcode.QUICK_STOP, 42100)
    for token in range(42101, 42120):
        command(either_board, Opcode.QUICK_STOP, token)
    status = until(either_board, lambda status: status.state is State.IDLE)
    last_s = [(status.samples_captured - 1) * PERIOD_S]
    end = reference(motion.axes["x"], last_s, motion.lead_in_s, 0.0)
    speed = float(end.velocity_rad_s[0])
    rest = float(end.position_rad[0]) + speed * stop_duration_s(speed) / 2.0
    assert abs(speed) > 2.0
    for position in status.position_rad.values():
        assert position == pytest.approx(rest, abs=0.02)


def test_a_trajectory_is_copied_before_it_is_checked(either_board: Board) -> None:
    """What is written meanwhile is another motion."""
    either_board.enable()
    either_board.write_trajectory(SHORT)
    either_board.arm()
    crc, samples = either_board._trajectory_crc, either_board._motion_samples
    either_board.write_trajectory(AT_ZERO)
    either_board._trajectory_crc, either_board._motion_samples = crc, samples
    either_board.start()
    followed = joined(list(either_board.capture_pages()), "position_rad")
    either_board.finish()
    assert len(followed) == 421
    assert np.ptp(followed[:, 0]) > 0.3
