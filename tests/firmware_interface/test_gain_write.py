"""Safe writes: staged, committed, confirmed or rolled back, and what is refused."""

from dataclasses import replace
from typing import Any

import pytest
from board_bench import BETTER, NEW, OLD, Bench

from firmware_interface.errors import BoardError
from firmware_interface.gains import staged_writes
from firmware_interface.virtual.settings import DEFAULT_LIMITS


def test_gains_go_all_the_way_to_permanent_memory() -> None:
    bench = Bench()
    board, banks = bench.board, bench.virtual.machine.banks
    assert board.active_gains() == OLD
    board.stage_gains(NEW)
    assert board.staged_gains() == NEW
    assert board.active_gains() == OLD
    board.commit()
    assert board.active_gains() == NEW
    assert board.status().unconfirmed
    board.confirm()
    assert not board.status().unconfirmed
    assert banks.stored == OLD
    board.store()
    assert banks.stored == NEW


def test_roll_back_returns_the_old_gains() -> None:
    board = Bench().board
    board.stage_gains(NEW)
    board.commit()
    board.roll_back()
    assert board.active_gains() == OLD
    with pytest.raises(BoardError, match="no unconfirmed gains"):
        board.confirm()


def test_commit_twice_without_confirm_is_refused() -> None:
    board = Bench().board
    board.stage_gains(NEW)
    board.commit()
    with pytest.raises(BoardError, match="not confirmed yet"):
        board.commit()


def test_commit_and_store_of_unfinished_business_are_refused() -> None:
    board = Bench().board
    with pytest.raises(BoardError, match="CRC"):
        board.commit()  # nothing was staged
    board.stage_gains(NEW)
    board.commit()
    with pytest.raises(BoardError, match="not confirmed yet"):
        board.store()


@pytest.mark.parametrize(
    "bad",
    [
        {"proportional": 601.0},
        {"derivative": -1.0},
        {"coulomb_smoothing_rad_s": 0.0},
        {"offset_feedforward": -5.1},
        {"stribeck_feedforward": -0.1},
        {"stribeck_speed_rad_s": 0.0},
        {"viscous_difference_feedforward": -5.1},
        {"ripple_cosine": (0.0, 0.0, 0.0, 5.1)},
        {"ripple_sine": (-3.1, 0.0, 0.0, 0.0)},  # too much at once
        {"ripple_period_rad": (1.0, 0.0, 1.0, 1.0)},
        {"friction_top_speed_rad_s": 0.0},
        {"friction_backward": (0.0,) * 11 + (-5.1,)},
        {"load_table": (0.0,) * 23 + (5.1,)},
        {"local_friction_table": (-3.1,) + (0.0,) * 23},  # too much at once
        {"table_step_rad": -0.1},
        {"presliding_feedforward": -0.1},
        {"backlash_offset_rad": -0.001},
        {"transmission_loss": 0.91},
        {"proportional": 30.0 + 0.61 * 600.0},  # within the maximum, but too much at once
    ],
)
def test_gains_outside_the_boards_limits_are_refused(bad: dict[str, Any]) -> None:
    board = Bench().board
    board.stage_gains({"x": BETTER, "z": replace(BETTER, **bad)})
    with pytest.raises(BoardError, match="outside the board's limits"):
        board.commit()
    assert board.active_gains() == OLD


def test_a_gain_that_is_no_number_is_not_committed() -> None:
    """The host does not ask for it: it reads the bank back first. The boards refuse it, too
    (`test_conformance_gains.py`)."""
    board = Bench().board
    gains = {"x": BETTER, "z": replace(BETTER, inertia_feedforward=float("nan"))}
    for address, words in staged_writes(gains)[0]:
        board._link.write(address, words)
    with pytest.raises(BoardError, match=r"nan as shadow\.z\.inertia_feedforward"):
        board.commit()
    assert board.active_gains() == OLD


def test_a_board_with_tighter_limits_refuses_what_another_takes() -> None:
    tight = replace(DEFAULT_LIMITS, gain_maximum=replace(DEFAULT_LIMITS.gain_maximum, derivative=9))
    board = Bench(limits={"x": tight, "z": DEFAULT_LIMITS}).board
    board.stage_gains(NEW)
    with pytest.raises(BoardError, match="outside the board's limits"):
        board.commit()
