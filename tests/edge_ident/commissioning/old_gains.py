"""That a board is as it was before a job."""

import pytest

from firmware_interface.board import Board
from firmware_interface.gains import CONSERVATIVE_GAINS
from firmware_interface.virtual.board import VirtualBoard


def assert_old_gains(virtual: VirtualBoard) -> None:
    """The board has the gains that it started with, and none wait to be confirmed."""
    old = CONSERVATIVE_GAINS.numbers()
    board = Board.connect(virtual)
    assert board.active_gains()["x"].numbers() == pytest.approx(old, rel=1e-6)
    assert not board.status().unconfirmed
