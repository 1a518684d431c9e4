"""Words to and from a board: read back what is written, and notice what comes late or restarts.

The heartbeat's thread shares the line: each transfer is whole before the next begins.
"""

import threading
import time
from collections.abc import Callable, Sequence
from contextlib import suppress
from typing import Final, TypeVar

from firmware_interface.board_checks import went_back
from firmware_interface.board_types import BoardStatus, read_nonce, read_status
from firmware_interface.errors import ChangedWordError, LinkError, NoReplyError, RestartedError
from firmware_interface.link import Line, Link
from firmware_interface.registers import PAGE_SAMPLES
from firmware_interface.spans import addresses, read_spans

_TRIES: Final = 3
_T = TypeVar("_T")


class BoardLine:
    """A link to a board, and how far its clock was when it was asked last.

    Parameters
    ----------
    link : Link

    Attributes
    ----------
    line : Line or None
        The link, where time passes while it brings a reply.
    """

    def __init__(self, link: Link) -> None:
        self._link = link
        self.line = link if isinstance(link, Line) else None
        self._lock = threading.RLock()
        self._unsaid: RestartedError | None = None  # what the heartbeat's thread met
        self._nonce = read_nonce(self.read)
        self._first_status = read_status(self.read)
        self._clock = self._first_status.clock_samples

    def read(self, address: int, count: int) -> list[int]:
        """Words of consecutive registers."""
        return self._transfer(lambda: self._link.read(address, count))

    def write(self, address: int, words: list[int]) -> None:
        """Write consecutive registers in one transfer, once."""
        self._transfer(lambda: self._link.write(address, words))

    def _transfer(self, work: Callable[[], _T]) -> _T:
        with self._lock:
            if self._unsaid is not None:
                unsaid, self._unsaid = self._unsaid, None
                raise unsaid
            began_s = time.monotonic()
            try:
                return work()
            except RestartedError as error:
                self._restarted(error.nonce)
                raise
            finally:
                if self.line is not None:
                    took_s = time.monotonic() - began_s
                    self.line.longest_reply_s = max(self.line.longest_reply_s, took_s)

    def write_verified(self, writes: Sequence[tuple[int, list[int]]]) -> None:
        """Write registers, (address, words) each, then read all of them back and compare.

        Raises
        ------
        LinkError
            What was read back differs.
        """
        for address, words in writes:
            with suppress(NoReplyError):  # what counts is what reads back
                self.write(address, words)
        found = read_spans(self.read, [(address, len(words)) for address, words in writes])
        for address, words in writes:
            if [found[there] for there in addresses([(address, len(words))])] != words:
                raise LinkError(
                    f"registers from {address:#06x} read back differently from what was written",
                    "check the cable and that no other host talks to the board, then try again",
                )

    def status(self) -> BoardStatus:
        """State, fault, last command and counters, all of one moment.

        One that contradicts itself is asked for again. A status that is older than the one before
        came late, unless the board has restarted: its nonce decides.

        Raises
        ------
        RestartedError
            The board has restarted since it was asked last; said once.
        LinkError
            Old replies keep coming, or the line changes words.
        """
        for _ in range(_TRIES):
            status = self._agreeing_status()
            before, self._clock = self._clock, status.clock_samples
            if not went_back(before, status.clock_samples):
                return status
            self._check_nonce()
            self._clock = before
        self._clock = status.clock_samples
        raise LinkError(
            f"late replies continue to arrive: the clock of the board reads "
            f"{status.clock_samples} samples after {before}",
            "check the cable and all devices between host and board, then try again",
        )

    def _agreeing_status(self) -> BoardStatus:
        for _ in range(_TRIES):
            status = read_status(self.read)
            if _agrees(status):
                return status
        raise ChangedWordError("what the board says of its state contradicts itself")

    def _check_nonce(self) -> None:
        """Make sure that it is the board of before, which has not restarted."""
        nonce = read_nonce(self.read)
        if nonce != self._nonce:
            self._restarted(nonce)
            raise RestartedError(nonce)

    def _restarted(self, nonce: int) -> None:
        """Its clock began anew."""
        self._nonce, self._clock = nonce, 0


def _agrees(status: BoardStatus) -> bool:
    """Whether what it says twice is the same; a word that the line changed may show so."""
    full, rest = divmod(status.samples_captured, PAGE_SAMPLES)
    pages = (full, full + 1) if rest else (full,)
    return status.enabled == status.brake_released and status.pages_written in pages
