"""Another board in place of the one that a host knows: it gets no command."""

import pytest
from board_bench import NEW, long_motion

from firmware_interface.board import Board
from firmware_interface.errors import RestartedError
from firmware_interface.link import Link
from firmware_interface.virtual.board import VirtualBoard
from firmware_interface.virtual.settings import BoardSettings


class Exchange:
    """A link on which another board answers from some moment on, and no connection is lost."""

    def __init__(self, link: Link) -> None:
        self.link = link

    def read(self, address: int, count: int) -> list[int]:
        return self.link.read(address, count)

    def write(self, address: int, words: list[int]) -> None:
        self.link.write(address, words)

    def close(self) -> None:
        self.link.close()


def clock_ahead() -> VirtualBoard:
    """A board that has been on for longer, so that its clock says nothing."""
    other = VirtualBoard(BoardSettings(serial_number=77))
    other.machine.samples = 10**6
    return other


@pytest.fixture
def line() -> Exchange:
    return Exchange(VirtualBoard())


@pytest.fixture
def board(line: Exchange) -> Board:
    return Board.connect(line)


def test_a_board_that_came_in_place_of_another_gets_no_effort(line: Exchange, board: Board) -> None:
    line.link = other = clock_ahead()
    with pytest.raises(RestartedError):
        board.enable()
    assert not other.machine.enabled


def test_nor_does_it_get_the_gains_of_another(line: Exchange, board: Board) -> None:
    line.link = other = clock_ahead()
    with pytest.raises(RestartedError):
        board.stage_gains(NEW)
    assert Board.connect(other).staged_gains() != NEW


def test_a_board_that_came_in_place_of_a_moving_one_is_not_taken_for_a_stop(
    line: Exchange, board: Board
) -> None:
    """No lost reply asks for the nonce; what gives it away is a last token that is none of ours."""
    board.enable()
    board.write_trajectory(long_motion())
    board.arm()
    board.start()
    line.link = clock_ahead()
    with pytest.raises(RestartedError) as caught:
        board.status()
    assert "the axes of the first one may still produce effort" in caught.value.next_step
