"""The narrow seam between host and board: read words, write words."""

from collections.abc import Callable
from typing import Protocol, runtime_checkable


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
