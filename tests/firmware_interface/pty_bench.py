"""A watched virtual board behind a faulty line between two pseudo-terminals, by the wall clock."""

import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Final

from board_thread import SharedBoard, served
from fault_line import FaultyLine
from fault_proxy import FaultProxy
from witness import SETTINGS, Witness

from firmware_interface.board import Board
from firmware_interface.connection import open_link
from firmware_interface.virtual.board import WallClock

TIMEOUT_S: Final = 0.3


class PtyBench:
    """What a host can do on that line, and what can happen to it.

    Attributes
    ----------
    line : FaultyLine
    witness : Witness
        Of the board.
    """

    watchdog_s = 1.2

    def __init__(self, proxy: FaultProxy, board: SharedBoard) -> None:
        self.line = proxy.line
        self.witness = Witness(board, board.lock)
        self.url = proxy.url
        self.hang_up = proxy.hang_up
        self.come_back = proxy.come_back

    def connect(self) -> Board:
        """A new host on the line."""
        return connected_board(self.url)

    def wait(self, seconds: float) -> None:
        """Nobody asks the board anything for so long."""
        time.sleep(seconds)


def connected_board(url: str, timeout_s: float = TIMEOUT_S) -> Board:
    """The host's verbs for the board at a device; the device is let go if there is none."""
    link = open_link(url, timeout_s=timeout_s)
    try:
        return Board.connect(link)
    except BaseException:
        link.close()
        raise


@contextmanager
def pty_bench(folder: Path, line: FaultyLine, speed: float = 1.0) -> Iterator[PtyBench]:
    """A board of its own for each; `speed` times faster than time."""
    board = SharedBoard(SETTINGS, WallClock(speed))
    with served(board, "pty") as url, FaultProxy(url, folder, line) as proxy:
        yield PtyBench(proxy, board)
