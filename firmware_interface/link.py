"""The narrow seam between host and board: read words, write words."""

import os
import threading
import time
from collections.abc import Callable
from contextlib import suppress
from typing import Final, Protocol, runtime_checkable


class Link(Protocol):
    """A way to the board's registers.

    Methods raise LinkError when the line is at fault (NoReplyError after a timeout) and
    BoardError when the board refuses the address.
    """

    def read(self, address: int, count: int) -> list[int]:
        """Words of consecutive registers; may be repeated inside, at the same address."""

    def write(self, address: int, words: list[int]) -> None:
        """Write consecutive registers in one transfer; never repeated."""

    def close(self) -> None:
        """Let go of the line."""


@runtime_checkable
class Line(Link, Protocol):
    """A link over a line: a reply takes time, and the board goes on meanwhile.

    Attributes
    ----------
    longest_reply_s : float
        Longest time that a request has taken so far, its repetitions included; the host notes it.
    once_clean : callable
        Called before anything else is asked, where a reply was missing and the line works again:
        a sign of life is due then.
    """

    longest_reply_s: float
    once_clean: Callable[[], None]


# A thread that does nothing but give signs of life, however long its host computes.
#
# It also measures what could keep a sign of life from the board: the longest time that this process
# did not run when it was due, and the longest time that the line took for a request. So host and
# cable can be told apart.

LOOKS_PER_BEAT: Final = 4
"""Looks whether a sign of life is due, in the time between two: the most that one is late."""
_URGENT: Final = -10  # niceness of the thread, where the system allows it


class Heartbeat:
    """Gives signs of life from its start to its end.

    Parameters
    ----------
    line : Line
    beat : callable
        Gives a sign of life if one is due; raises nothing.
    every_s : callable
        Time between two, as it is now.
    """

    def __init__(self, line: Line, beat: Callable[[], None], every_s: Callable[[], float]) -> None:
        self._line, self._beat, self._every_s = line, beat, every_s
        self._held_up_s = 0.0
        self._damaged_before = 0
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._run, name="heartbeat", daemon=True)

    def start(self) -> None:
        """Begin."""
        self.measure_anew()
        self._line.once_clean = self._beat
        self._thread.start()

    def end(self) -> None:
        """End, and wait for the last one."""
        self._line.once_clean = lambda: None
        self._ended.set()
        self._thread.join()

    def measure_anew(self) -> None:
        """Forget what was measured so far."""
        self._held_up_s = self._line.longest_reply_s = 0.0
        self._damaged_before = self._damaged

    @property
    def silence(self) -> tuple[float, float, int]:
        """Longest time that this process did not run, longest time of a request, both in s, and how
        many replies came damaged."""
        return self._held_up_s, self._line.longest_reply_s, self._damaged - self._damaged_before

    @property
    def _damaged(self) -> int:
        return int(getattr(self._line, "damaged_replies", 0))

    def _run(self) -> None:
        with suppress(OSError, AttributeError):  # not allowed, or another system
            os.setpriority(os.PRIO_PROCESS, threading.get_native_id(), _URGENT)
        while True:
            due_s = time.monotonic() + self._every_s() / LOOKS_PER_BEAT
            if self._ended.wait(due_s - time.monotonic()):
                return
            self._held_up_s = max(self._held_up_s, time.monotonic() - due_s)
            self._beat()
