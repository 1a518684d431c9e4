"""Every kind of board holds its axes, and moves one by an angle, as bring-up does."""

import math

import pytest

from edge_ident import commissioning
from firmware_interface.board import Board
from firmware_interface.registers import State
from tests.short_runs import Silent

FIVE_DEGREES = math.radians(5.0)
SHORT_RAD = 1.4 / 30.0
"""Friction of axis x over the first proportional gain."""


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_first_move_goes_the_right_way_and_ends_without_effort(
    either_board: Board, sign: float
) -> None:
    before = either_board.status().position_rad
    way = commissioning.homing.move_by(either_board, {"x": sign * FIVE_DEGREES}, Silent()).ways["x"]
    assert way.to_rad == pytest.approx(before["x"] + sign * FIVE_DEGREES, abs=0.001)
    assert abs(way.to_rad - way.reached_rad) <= SHORT_RAD * 1.2
    status = either_board.status()
    assert (status.state, status.enabled) == (State.IDLE, False)
    assert status.position_rad["z"] == pytest.approx(before["z"], abs=0.002)


def test_held_axes_stand(either_board: Board) -> None:
    before = either_board.status().position_rad
    held = commissioning.homing.hold(either_board, 1.0, Silent())
    assert set(held) == {"x", "z"}
    assert max(abs(one.pushed_rad) for one in held.values()) < 0.002
    status = either_board.status()
    assert not status.enabled
    assert status.position_rad == pytest.approx(before, abs=0.002)
