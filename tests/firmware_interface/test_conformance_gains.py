"""Both boards exchange gains alike: all old or all new, confirmed or rolled back."""

import math
from dataclasses import replace

import pytest
from board_bench import NEW, long_motion
from conformance_boards import ask, put_gains, refused_value, start, until, until_abandoned

from firmware_interface.board import Board
from firmware_interface.codec import addresses, crc32, encode
from firmware_interface.errors import BoardError
from firmware_interface.gains import AxisGains, bank_spans, encode_gains, span_of, staged_writes
from firmware_interface.registers import STORE_SIGNATURE, Opcode, Result, State

LONG = replace(long_motion(), lead_in_s=2.0)


def commit(board: Board) -> None:
    board.stage_gains(NEW)
    board.commit()


def move(board: Board) -> None:
    """Into the capture of a long motion."""
    start(board, LONG)
    until(board, lambda status: status.samples_captured > 0)


def test_a_commit_puts_the_staged_gains_in_force_until_confirmed(either_board: Board) -> None:
    old = either_board.active_gains()
    either_board.stage_gains(NEW)
    status = either_board.status()
    assert (status.staged_crc_ok, status.unconfirmed) == (True, False)
    assert either_board.active_gains() == old
    either_board.commit()
    assert either_board.active_gains() == NEW == either_board.staged_gains()
    status = either_board.status()
    assert status.unconfirmed
    assert 115.0 < status.confirm_remaining_s <= 120.0
    either_board.confirm()
    status = either_board.status()
    assert (status.unconfirmed, status.confirm_remaining_s) == (False, 0.0)
    assert either_board.active_gains() == NEW


def test_roll_back_returns_to_the_gains_before(either_board: Board) -> None:
    old = either_board.active_gains()
    commit(either_board)
    either_board.roll_back()
    assert either_board.active_gains() == old
    assert not either_board.status().unconfirmed
    with pytest.raises(BoardError, match="no unconfirmed gains"):
        either_board.confirm()
    with pytest.raises(BoardError, match="no unconfirmed gains"):
        either_board.roll_back()


def test_unconfirmed_gains_bar_the_next_commit_and_the_store(either_board: Board) -> None:
    commit(either_board)
    for action in (either_board.commit, either_board.store):
        with pytest.raises(BoardError, match="not confirmed yet"):
            action()
    assert either_board.active_gains() == NEW


WORDS = [*addresses([*bank_spans("shadow"), span_of("shadow.crc")])]


@pytest.mark.parametrize("word", [0, 47, 95, 96, 97, 279, 280, 463, 464, 465])
def test_a_bank_that_differs_from_its_crc_is_refused(either_board: Board, word: int) -> None:
    old = either_board.active_gains()
    either_board.stage_gains(NEW)
    value = WORDS[word // 2 * 2]
    words = either_board._link.read(value, 2)
    words[word % 2] ^= 1
    either_board._link.write(value, words)
    assert not either_board.status().staged_crc_ok
    with pytest.raises(BoardError, match="does not match its CRC"):
        either_board.commit()
    assert either_board.active_gains() == old


@pytest.mark.parametrize(
    "bad",
    [
        {"proportional": 601.0},
        {"proportional": 30.0 + 0.61 * 600.0},  # within the maximum, but too much at once
        {"derivative": -1.0},
        {"derivative": math.nan},
        {"integral": math.inf},
        {"velocity_filter_s": -0.01},
        {"coulomb_smoothing_rad_s": 0.0},
        {"coulomb_smoothing_rad_s": -0.0},
        {"offset_feedforward": -5.1},
        {"stribeck_feedforward": -0.1},
        {"stribeck_speed_rad_s": 0.0},
        {"viscous_difference_feedforward": -5.1},
        {"ripple_cosine": (0.0, 0.0, 0.0, 5.1)},
        {"ripple_sine": (-3.1, 0.0, 0.0, 0.0)},  # too much at once
        {"ripple_period_rad": (1.0, 0.0, 1.0, 1.0)},
        {"friction_top_speed_rad_s": 0.0},
        {"friction_forward": (0.0,) * 11 + (5.1,)},
        {"friction_backward": (math.nan,) + (0.0,) * 11},
        {"table_start_rad": -20.1},
        {"table_step_rad": 0.0},
        {"load_table": (0.0,) * 23 + (math.nan,)},
        {"local_friction_table": (0.0,) * 12 + (3.2,) + (0.0,) * 11},  # too much at once
        {"table_fade_speed_rad_s": -1.0},
        {"ripple_fade_speed_rad_s": (0.0, 0.0, 20.1, 0.0)},
        {"presliding_feedforward": -0.1},
        {"presliding_distance_rad": 0.0},
        {"backlash_offset_rad": 0.21},
        {"backlash_distance_rad": -1.0},
        {"deadband_inverse": math.inf},
        {"deadband_smoothing": 0.0},
        {"cross_inertia_feedforward": -2.1},
        {"cross_viscous_feedforward": 5.1},
        {"cross_coulomb_feedforward": math.nan},
        {"transmission_loss": 0.91},
        {"transmitted_inertia": -0.1},
        {"transmitted_friction": -0.1},
    ],
    ids=lambda bad: next(iter(bad)),
)
@pytest.mark.parametrize("axis", ["x", "z"])
def test_gains_outside_the_boards_limits_are_refused(
    either_board: Board, axis: str, bad: dict[str, float]
) -> None:
    old = either_board.active_gains()
    writes, crc = staged_writes(NEW | {axis: replace(NEW[axis], **bad)})
    for address, words in writes:
        either_board._link.write(address, words)
    assert either_board.status().staged_crc_ok
    assert ask(either_board, Opcode.COMMIT, crc) is Result.GAIN_LIMITS
    assert either_board.active_gains() == old


def test_gains_that_may_be_negative_and_that_change_by_the_whole_step(
    either_board: Board,
) -> None:
    old = either_board.active_gains()["x"]
    furthest = replace(
        old,
        proportional=old.proportional + 359.0,
        offset_feedforward=-2.9,
        viscous_difference_feedforward=-2.9,
        ripple_cosine=(-2.9, 0.0, 0.0, 2.9),
        ripple_sine=(0.0, -2.9, 2.9, 0.0),
        friction_forward=(-2.9, *[0.0] * 10, 2.9),
        friction_backward=(2.9, *[0.0] * 10, -2.9),
        table_start_rad=-11.9,
        load_table=(-2.9, *[0.0] * 22, 2.9),
        local_friction_table=(2.9, *[0.0] * 22, -2.9),
        cross_inertia_feedforward=-1.1,
        cross_viscous_feedforward=-2.9,
        cross_coulomb_feedforward=-2.9,
    )
    either_board.stage_gains(dict.fromkeys("xz", furthest))
    either_board.commit()
    assert either_board.active_gains() == either_board.staged_gains()
    either_board.roll_back()


@pytest.mark.parametrize("state", [State.ARMED, State.MOVING])
def test_gains_change_only_in_idle(either_board: Board, state: State) -> None:
    either_board.stage_gains(NEW)
    old = either_board.active_gains()
    either_board.enable()
    either_board.write_trajectory(LONG)
    either_board.arm()
    if state is State.MOVING:
        either_board.start()
    for opcode in (Opcode.COMMIT, Opcode.CONFIRM, Opcode.ROLL_BACK, Opcode.STORE):
        assert ask(either_board, opcode, STORE_SIGNATURE) is Result.WRONG_STATE
    assert either_board.active_gains() == old


@pytest.mark.parametrize("done", [0, 1, 48, 49, 50, 139, 140, 141, 231, 232])
def test_a_bank_that_was_staged_in_part_is_never_committed(either_board: Board, done: int) -> None:
    """Value by value: until the last one and the CRC are there, neither CRC means what is there."""
    old = either_board.active_gains()
    either_board.stage_gains(old)
    before = crc32(encode_gains(old))
    after, places = encode_gains(NEW), WORDS[:464]
    for n in range(0, 2 * done, 2):
        either_board._link.write(places[n], after[n : n + 2])
    assert ask(either_board, Opcode.COMMIT, crc32(after)) is Result.GAIN_CRC
    if done > 0:
        assert not either_board.status().staged_crc_ok
        assert ask(either_board, Opcode.COMMIT, before) is Result.GAIN_CRC
    assert either_board.active_gains() == old
    either_board._link.write(WORDS[464], encode("shadow.crc", crc32(after)))
    whole = done == len(after) // 2
    wanted = Result.DONE if whole else Result.GAIN_CRC
    assert ask(either_board, Opcode.COMMIT, crc32(after)) is wanted
    assert either_board.active_gains() == (NEW if whole else old)


def test_the_active_bank_has_a_crc_of_its_own(either_board: Board) -> None:
    """So that what takes several transfers to read is known to be of one bank."""
    assert either_board.register_values("active.crc") == (
        crc32(encode_gains(either_board.active_gains())),
    )
    commit(either_board)
    assert either_board.register_values("active.crc") == (crc32(encode_gains(NEW)),)
    either_board.roll_back()
    assert either_board.register_values("active.crc") != (crc32(encode_gains(NEW)),)


def test_the_shadow_bank_may_be_written_at_any_time(either_board: Board) -> None:
    move(either_board)
    either_board.stage_gains(NEW)
    assert either_board.status().staged_crc_ok


def test_unconfirmed_gains_are_rolled_back_when_the_window_ends(fresh_board: Board) -> None:
    old = fresh_board.active_gains()
    commit(fresh_board)
    assert 0.5 < fresh_board.status().confirm_remaining_s <= 1.0
    assert fresh_board.active_gains() == NEW
    until(fresh_board, lambda status: not status.unconfirmed)
    assert fresh_board.active_gains() == old
    assert fresh_board.status().confirm_remaining_s == 0.0


def test_the_window_does_not_change_gains_during_a_motion(fresh_board: Board) -> None:
    old = fresh_board.active_gains()
    commit(fresh_board)
    move(fresh_board)
    until(fresh_board, lambda status: status.confirm_remaining_s == 0.0)
    later = fresh_board.status().clock_samples + 400  # the last hundredth of a second reads as none
    status = until(fresh_board, lambda status: status.clock_samples > later)
    assert (status.state, status.unconfirmed) == (State.MOVING, True)
    assert fresh_board.active_gains() == NEW
    fresh_board.quick_stop()
    until(fresh_board, lambda status: not status.unconfirmed)
    assert fresh_board.active_gains() == old


def test_what_was_armed_is_forgotten_with_the_gains_it_was_checked_with(
    fresh_board: Board,
) -> None:
    commit(fresh_board)
    fresh_board.enable()
    fresh_board.write_trajectory(LONG)
    fresh_board.arm()
    until(fresh_board, lambda status: not status.unconfirmed)
    assert fresh_board.status().state is State.IDLE


@pytest.mark.parametrize("end", ["quick stop", "watchdog"])
def test_a_stop_with_unconfirmed_gains_rolls_back_once_at_rest(
    either_board: Board, end: str
) -> None:
    old: dict[str, AxisGains] = either_board.active_gains()
    commit(either_board)
    move(either_board)
    if end == "quick stop":
        either_board.quick_stop()
    else:
        until_abandoned(either_board, lambda status: status.state is State.FAULT)
    until(either_board, lambda status: not status.unconfirmed)
    assert either_board.active_gains() == old


def test_a_quick_stop_at_rest_rolls_back_at_once(either_board: Board) -> None:
    old = either_board.active_gains()
    commit(either_board)
    either_board.quick_stop()
    assert not either_board.status().unconfirmed
    assert either_board.active_gains() == old


def test_store_needs_its_signature(either_board: Board) -> None:
    assert ask(either_board, Opcode.STORE, 0x12345678) is Result.WRONG_ARGUMENT
    assert ask(either_board, Opcode.STORE, STORE_SIGNATURE) is Result.DONE


def test_only_what_differs_is_stored_and_every_time_counts(fresh_board: Board) -> None:
    """Permanent memory wears out."""
    commit(fresh_board)
    fresh_board.confirm()
    before = fresh_board.status().stores
    for _ in range(3):
        fresh_board.store()
        assert fresh_board.status().stores == before + 1
    put_gains(fresh_board, dict.fromkeys("xz", replace(NEW["x"], proportional=96.0)))
    fresh_board.store()
    assert fresh_board.status().stores == before + 2


def test_the_count_of_stores_cannot_be_written(either_board: Board) -> None:
    assert refused_value(either_board, "status.stores", 0) == 2
