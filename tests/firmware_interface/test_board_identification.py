"""What a board identified by itself, as a host reads it: whole, of the right motion, in time."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import pytest

from firmware_interface.board import Board
from firmware_interface.board_identification import (
    BoardAxis,
    BoardIdentification,
    CapturedCounts,
    identification_words,
    read_identification,
    wait_for_identification,
)
from firmware_interface.board_types import BoardIdentity
from firmware_interface.errors import BoardError, LinkError
from firmware_interface.motion import Trajectory
from firmware_interface.registers import (
    AXES,
    MAP_VERSION,
    REGISTERS,
    IdentificationReason,
    IdentificationState,
    State,
)
from firmware_interface.virtual.board import VirtualBoard
from firmware_interface.virtual.settings import BoardSettings

FOUND = BoardIdentification(
    IdentificationState.DONE,
    7,
    0xC1BCCC99,
    {
        "x": BoardAxis(IdentificationReason.NONE, 5, (0.5, 1.0, 1.5, -0.25), 0.125),
        "z": BoardAxis(IdentificationReason.STANDSTILL),
    },
)
BASE = REGISTERS["identification.state"].address


class Extremes:
    """A network that says how far each axis went, and how large its effort was, in counts."""

    network = 0x12345678
    longest_s = 60.0

    def identify(self, captured: CapturedCounts, board: BoardIdentity) -> Mapping[str, BoardAxis]:
        assert board.counts_per_turn == 8400
        self.samples = len(captured.position)
        extremes = [np.ptp(captured.position, axis=0), np.ptp(captured.effort, axis=0)]
        return {
            axis: BoardAxis(IdentificationReason.NONE, 1, (*(float(e[n]) for e in extremes), 0, 0))
            for n, axis in enumerate(AXES)
        }


@pytest.fixture
def identifier() -> Extremes:
    return Extremes()


@pytest.fixture
def board(identifier: Extremes) -> Board:
    board = Board.connect(VirtualBoard(identifier=identifier))
    board.enable()
    return board


def captured(board: Board, motion: Trajectory) -> None:
    board.write_trajectory(motion)
    board.arm()
    board.start()
    list(board.capture_pages())


# ---- the registers


def test_words_and_values_are_one_to_one() -> None:
    words = identification_words(FOUND)
    assert read_identification(lambda address, count: words, MAP_VERSION) == FOUND
    last = REGISTERS["identification.crc"]
    assert len(words) == last.address + last.words - BASE


def test_a_torn_read_is_noticed_and_read_again() -> None:
    """Half of one answer, half of the next."""
    before, after = identification_words(replace(FOUND, motion=6)), identification_words(FOUND)
    replies = [before[:10] + after[10:], after]
    assert read_identification(lambda address, count: replies.pop(0), MAP_VERSION) == FOUND
    torn = before[:10] + after[10:]
    with pytest.raises(LinkError, match="CRC"):
        read_identification(lambda address, count: torn, MAP_VERSION)


def test_what_cannot_be_is_not_believed() -> None:
    words = identification_words(
        replace(FOUND, axes={"x": BoardAxis(parameters=(np.nan, 0.0, 0.0, 0.0)), "z": BoardAxis()})
    )
    with pytest.raises(BoardError, match=r"identification\.x\.inertia"):
        read_identification(lambda address, count: words, MAP_VERSION)


def test_a_host_waits_no_longer_than_it_says_and_for_its_own_motion_alone() -> None:
    running = identification_words(replace(FOUND, state=IdentificationState.RUNNING))
    asked = []

    def read(address: int, count: int) -> list[int]:
        asked.append(address)
        return running if len(asked) < 3 else identification_words(FOUND)

    found = wait_for_identification(read, MAP_VERSION, 7, 0.0)
    assert found is not None
    assert found.state is IdentificationState.RUNNING
    assert wait_for_identification(read, MAP_VERSION, 7, 60.0) == FOUND
    assert wait_for_identification(read, MAP_VERSION, 8, 60.0) is None
    assert wait_for_identification(read, MAP_VERSION, None, 60.0) is None


# ---- boards


def test_a_board_without_a_network_says_nothing(short_motion: Trajectory) -> None:
    board = Board.connect(VirtualBoard())
    board.enable()
    captured(board, short_motion)
    assert board.identification(1.0) is None
    assert set(board.register_values("identification.network")) == {0}


def test_a_board_of_an_older_map_is_not_asked(identifier: Extremes) -> None:
    board = Board.connect(VirtualBoard(BoardSettings(map_version=4), identifier=identifier))
    assert board.identification(1.0) is None
    with pytest.raises(BoardError, match="no registers"):
        board.register_values("identification.state")


def test_a_virtual_board_hands_over_the_samples_that_the_host_gets(
    board: Board, identifier: Extremes, short_motion: Trajectory
) -> None:
    assert board.identification(0.0) is None  # this host has started nothing
    board.write_trajectory(short_motion)
    board.arm()
    board.start()
    pages = list(board.capture_pages())
    found = board.identification(0.0)
    assert found is not None
    assert (found.state, found.network) == (IdentificationState.DONE, identifier.network)
    assert identifier.samples == 421
    position = np.concatenate([page.position_rad for page in pages])
    effort = np.concatenate([page.effort_nm for page in pages])
    units = board.identity.encoder_resolution_rad, board.identity.effort_per_count_nm
    for n, axis in enumerate(AXES):
        wanted = np.ptp(position[:, n]) / units[0], np.ptp(effort[:, n]) / units[1]
        assert found.axes[axis].parameters[:2] == pytest.approx(wanted)


def test_a_new_motion_takes_the_answer_away(board: Board, short_motion: Trajectory) -> None:
    captured(board, short_motion)
    first = board.identification(0.0)
    board.finish()
    board.write_trajectory(short_motion)
    board.arm()
    board.start()
    second = board.identification(0.0)
    assert first is not None
    assert second is not None
    assert second.motion != first.motion
    assert second.state is IdentificationState.CAPTURING
    assert second.axes == dict.fromkeys(AXES, BoardAxis())


def test_a_motion_that_was_stopped_has_no_answer(board: Board, short_motion: Trajectory) -> None:
    board.write_trajectory(short_motion)
    board.arm()
    board.start()
    board.quick_stop()
    found = board.identification(0.0)
    assert found is not None
    assert found.state is IdentificationState.FAILED
    assert {axis.reason for axis in found.axes.values()} == {IdentificationReason.STOPPED}
    assert board.status().state is State.IDLE
