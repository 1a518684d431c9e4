"""A line with faults between two pseudo-terminals: the host opens one, the board has the other."""

import os
import select
import threading
import time
import tty
from contextlib import suppress
from pathlib import Path
from types import TracebackType
from typing import Final

from fault_line import FaultyLine, Sender

_LONGEST_WAIT_S: Final = 0.02


class FaultProxy:
    """Runs a faulty line between a new pseudo-terminal and a board's, in a thread.

    The host's end has a name that stays when its pseudo-terminal goes and another comes, as
    udev's names do.

    Parameters
    ----------
    board_url : str
        Pseudo-terminal of the board.
    folder : Path
        For the name of the host's end.
    line : FaultyLine

    Attributes
    ----------
    url : str
        What the host opens.
    """

    def __init__(self, board_url: str, folder: Path, line: FaultyLine) -> None:
        self.line = line
        self.url = str(folder / "ttyBOARD")
        self._board = os.open(board_url, os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)
        tty.setraw(self._board)
        self._board_ended = False
        self._host: int | None = None
        self._host_side = -1
        self._lock = threading.Lock()
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._run)
        self.come_back()

    def __enter__(self) -> "FaultProxy":
        self._thread.start()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self._ended.set()
        self._thread.join()
        self.hang_up()
        os.close(self._board)

    def hang_up(self) -> None:
        """The adapter is pulled: its device is gone, and what was on the way is lost."""
        with self._lock:
            if self._host is not None:
                os.close(self._host)
                os.close(self._host_side)
                Path(self.url).unlink()
            self._host = None
            self.line.forget()

    def come_back(self) -> None:
        """The adapter is plugged in again: another device under the same name."""
        with self._lock:
            self._host, self._host_side = os.openpty()
            tty.setraw(self._host_side)  # held open: the line stays up between hosts
            os.set_blocking(self._host, False)
            Path(self.url).symlink_to(os.ttyname(self._host_side))

    # ---- the thread

    def _run(self) -> None:
        while not self._ended.is_set():
            with self._lock:
                ends = {} if self._board_ended else {self._board: Sender.BOARD}
                if self._host is not None:
                    ends[self._host] = Sender.HOST
                next_s = self.line.next_s
            wait_s = _LONGEST_WAIT_S
            if next_s is not None:
                wait_s = min(max(next_s - time.monotonic(), 0.0), wait_s)
            ready: list[int] = []
            with suppress(OSError):  # hung up meanwhile
                ready = select.select(list(ends), [], [], wait_s)[0]
            for end in ready:
                self._take(end, ends[end])
            self._deliver()

    def _take(self, end: int, sender: Sender) -> None:
        with self._lock:
            if sender is Sender.HOST and end != self._host:
                return
            try:
                data = os.read(end, 4096)
            except OSError:
                data = b""
            if data:
                self.line.accept(sender, data, time.monotonic())
            elif sender is Sender.BOARD:
                self._board_ended = True  # to look at it would come back at once, for ever

    def _deliver(self) -> None:
        with self._lock:
            for sender, data in self.line.due(time.monotonic()):
                end = self._board if sender is Sender.HOST else self._host
                with suppress(OSError):  # nobody reads: the bytes are lost, as on a real line
                    if end is not None:
                        os.write(end, data)
