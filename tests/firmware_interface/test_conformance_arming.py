"""Both boards let the same motions pass: ARM looks at all of a trajectory, and at this one only."""

import math
from dataclasses import replace

import pytest
from conformance_boards import (
    ask,
    fresh_token,
    key_of,
    put_gains,
    refused_value,
    send,
    sines,
    until,
    until_abandoned,
)

from firmware_interface.board import Board
from firmware_interface.codec import encode
from firmware_interface.gains import CONSERVATIVE_GAINS
from firmware_interface.motion import Multisine, Staircase, Trajectory
from firmware_interface.registers import (
    MAP_CRC,
    REGISTERS,
    STORE_SIGNATURE,
    Fault,
    Opcode,
    Result,
    State,
)

ILLEGAL_VALUE = 3
FASTEST = math.pi / 0.0025
HARMLESS = {Multisine: sines((0.1, 1.0, 0.0)), Staircase: Staircase((0.1,), 1.0, 1.0)}
LONGEST = Trajectory(dict.fromkeys("xz", sines((0.1, 1.0, 0.0))), 21600.0, 1.0)


def armed(board: Board, motion: Multisine | Staircase, axis: str = "z") -> Result:
    """What ARM says to a motion of one axis."""
    axes = dict.fromkeys("xz", HARMLESS[type(motion)]) | {axis: motion}
    board.enable()
    board.write_trajectory(Trajectory(axes, 5.0, 1.0))  # type: ignore[arg-type]
    return ask(board, Opcode.ARM, board._trajectory_crc)


BAD = {
    "no sines": sines(),
    "an endless amplitude": sines((math.inf, 1.0, 0.0)),
    "an amplitude that is no number": sines((math.nan, 1.0, 0.0)),
    "a frequency that is no number": sines((0.1, math.nan, 0.0)),
    "a phase that is no number": sines((0.1, 1.0, math.nan)),
    "a frequency whose square is endless, nearly without amplitude": sines((1e-30, 1e25, 0.0)),
    "a frequency beyond the sampling, without amplitude": sines((0.0, 3e38, 0.0)),
    "half a turn a sample": sines((1e-9, FASTEST * 1.0001, 0.0)),
    "half a turn back a sample": sines((1e-9, -FASTEST * 1.0001, 0.0)),
    "no levels": Staircase((), 1.0, 1.0),
    "no acceleration": Staircase((1.0,), 1.0, 0.0),
    "a negative acceleration": Staircase((1.0,), 1.0, -1.0),
    "an endless acceleration": Staircase((1.0,), 1.0, math.inf),
    "a negative dwell": Staircase((1.0,), -1.0, 1.0),
    "a dwell that is no number": Staircase((1.0,), math.nan, 1.0),
    "a speed that is no number": Staircase((math.nan,), 1.0, 1.0),
    "an endless speed": Staircase((1.0, -math.inf), 1.0, 1.0),
}
OUTSIDE = {
    "too far": sines((10.5, 0.2, 1.5)),
    "too fast": sines((2.0, 2.5, 0.0)),
    "too far on the way to rest": sines((5.0, 0.0, 1.5708), (4.9, 0.75, 0.0)),
    "accelerated too much": sines((0.0063, 100.0, 0.0)),
    "further than numbers go": sines((3e38, 1.0, 0.0), (3e38, 1.0, 0.0)),
    "back and forth beyond numbers": sines((3e38, 1.0, 0.0), (-3e38, 1.0, 0.0), (3e38, 1.0, 1.0)),
    "accelerated beyond numbers": sines((3e36, 1250.0, 0.0)),
    "a level too fast": Staircase((1.0, 4.1), 0.1, 50.0),
    "a level too long": Staircase((-3.0,), 3.5, 1.0),
    "a level beyond numbers": Staircase((3e38,), 3e38, 1.0),
    "a ramp too steep": Staircase((1.0, -1.0), 0.5, 61.0),
    "a ramp between two samples": Staircase((0.5, -0.5), 0.00125, 3e38),
    "a ramp that never ends": Staircase((3.9,), 1e-3, 1e-38),
}
INSIDE = {
    "as fast as can be": sines((1.9, 2.0, 0.0)),
    "accelerated nearly as much as may be": sines((0.0058, 100.0, 0.0)),
    "nearly half a turn a sample, nearly still": sines((1e-6, FASTEST * 0.999, 0.0)),
    "a huge phase": sines((0.1, 1.0, 1e30)),
    "ramps as steep as may be": Staircase((0.5, -0.5), 0.3, 60.0),
}


@pytest.mark.parametrize("what", BAD)
def test_trajectories_that_are_none_are_refused(either_board: Board, what: str) -> None:
    """Full torque came from finite numbers: 1e-30 rad at 1e25 rad/s."""
    for axis in "xz":
        assert armed(either_board, BAD[what], axis) is Result.BAD_TRAJECTORY
    status = either_board.status()
    assert (status.state, status.fault) == (State.IDLE, Fault.NONE)


@pytest.mark.parametrize("what", OUTSIDE)
def test_trajectories_outside_the_limits_are_refused(either_board: Board, what: str) -> None:
    for axis in "xz":
        assert armed(either_board, OUTSIDE[what], axis) is Result.TRAJECTORY_LIMITS
    assert either_board.status().state is State.IDLE


@pytest.mark.parametrize("what", INSIDE)
def test_trajectories_inside_the_limits_are_armed(either_board: Board, what: str) -> None:
    assert armed(either_board, INSIDE[what]) is Result.DONE
    assert either_board.status().state is State.ARMED


def test_a_trajectory_that_asks_for_too_much_effort_is_refused(either_board: Board) -> None:
    """Of the feed-forward in force: 11 rad/s^2 of 1.19 kg*m^2 are more than 12 N*m."""
    motion = sines((0.11, 10.0, 0.0))
    assert armed(either_board, motion) is Result.DONE
    either_board.quick_stop()
    heavy = replace(CONSERVATIVE_GAINS, inertia_feedforward=1.1875)
    put_gains(either_board, {"x": CONSERVATIVE_GAINS, "z": heavy})
    assert armed(either_board, motion, "x") is Result.DONE
    either_board.quick_stop()
    assert armed(either_board, motion, "z") is Result.TRAJECTORY_LIMITS


def test_what_an_axis_must_bear_for_the_other_one_counts(either_board: Board) -> None:
    """11 rad/s^2 of the one take 1.19 kg*m^2 times as much of the other, which stands."""
    motion = sines((0.11, 10.0, 0.0))
    coupled = replace(CONSERVATIVE_GAINS, cross_inertia_feedforward=-1.1875)
    put_gains(either_board, {"x": coupled, "z": CONSERVATIVE_GAINS})
    assert armed(either_board, motion, "x") is Result.DONE
    either_board.quick_stop()
    assert armed(either_board, motion, "z") is Result.TRAJECTORY_LIMITS


def test_a_motion_that_begins_too_far_away_is_refused(either_board: Board) -> None:
    """Three radians in a lead-in of a tenth of a second."""
    either_board.enable()
    far = Trajectory(dict.fromkeys("xz", sines((3.0, 0.0, math.pi / 2.0))), 1.0, 0.1)
    either_board.write_trajectory(far)
    crc = either_board._trajectory_crc
    assert ask(either_board, Opcode.ARM, crc) is Result.TRAJECTORY_LIMITS


def test_an_unknown_kind_of_motion_cannot_be_written(either_board: Board) -> None:
    either_board.write_trajectory(Trajectory(dict.fromkeys("xz", sines((0.1, 1.0, 0.0))), 1.0, 1.0))
    assert refused_value(either_board, "trajectory.kind", 3) == ILLEGAL_VALUE


@pytest.mark.parametrize(
    ("name", "value"),
    [("trajectory.capture_samples", 401), ("trajectory.z.dwell", 1.0), ("trajectory.kind", 2)],
)
def test_a_trajectory_that_another_host_changed_is_not_armed(
    either_board: Board, name: str, value: float
) -> None:
    """Writing needs no session; but ARM says which trajectory it means."""
    motion = Trajectory(dict.fromkeys("xz", sines((0.1, 1.0, 0.0))), 1.0, 1.0)
    either_board.enable()
    either_board.write_trajectory(motion)
    either_board._link.write(REGISTERS[name].address, encode(name, value))
    crc = either_board._trajectory_crc
    assert ask(either_board, Opcode.ARM, crc) is Result.BAD_TRAJECTORY
    either_board.write_trajectory(motion)
    either_board.arm()


def check_the_longest(board: Board) -> None:
    """Six hours of capture."""
    board.enable()
    board.write_trajectory(LONGEST)
    send(board, Opcode.ARM, fresh_token(board), board._trajectory_crc, key_of(board))


def test_a_long_check_leaves_the_board_free_to_answer(either_board: Board) -> None:
    check_the_longest(either_board)
    status = either_board.status()
    assert (status.state, status.last_result) == (State.CHECKING, Result.PENDING)
    assert status.samples_to_check > 1_000_000
    left = status.samples_to_check
    until(either_board, lambda status: status.samples_to_check < left)
    either_board.quick_stop()
    status = either_board.status()
    assert (status.state, status.last_result) == (State.IDLE, Result.DONE)
    assert (status.samples_to_check, status.enabled) == (0, True)


def test_no_other_command_is_carried_out_during_a_check(either_board: Board) -> None:
    check_the_longest(either_board)
    for opcode in set(Opcode) - {Opcode.QUICK_STOP}:
        argument = {Opcode.START: MAP_CRC, Opcode.STORE: STORE_SIGNATURE}.get(opcode, 0)
        assert ask(either_board, opcode, argument) is Result.WRONG_STATE
    assert either_board.status().state is State.CHECKING


def test_a_check_goes_on_to_its_end(either_board: Board) -> None:
    """A quarter of an hour of motion, and the last second of it too far out."""
    either_board.enable()
    stairs = Staircase((0.0001, 4.0), 900.0, 60.0)
    either_board.write_trajectory(Trajectory(dict.fromkeys("xz", stairs), 903.0, 1.0))
    crc = either_board._trajectory_crc
    assert ask(either_board, Opcode.ARM, crc) is Result.TRAJECTORY_LIMITS
    either_board.write_trajectory(Trajectory(dict.fromkeys("xz", stairs), 902.0, 1.0))
    crc = either_board._trajectory_crc
    assert ask(either_board, Opcode.ARM, crc) is Result.DONE
    assert until_abandoned(either_board, lambda status: True).state is State.ARMED
