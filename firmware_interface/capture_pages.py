"""Fetches the pages of a capture while the machine moves, and keeps the board's watchdog fed."""

import math
import time
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass
from itertools import pairwise
from statistics import median
from typing import Final, Self

from firmware_interface import board_session, codec, errors, registers
from firmware_interface.board_checks import MotionWatch, check_capture
from firmware_interface.board_types import BoardIdentity, CapturePage, page_in_si

_PAGE_TRIES: Final = 3
_TIMED_PAGES: Final = 9


def fetch_pages(
    session: board_session.Session, identity: BoardIdentity, motion_samples: int
) -> Iterator[CapturePage]:
    """Give the pages of the motion just started, as they come, to the last.

    Raises
    ------
    BoardError
        The board is in fault, the motion was stopped or does not end.
    LinkError
        A page was lost or cannot be read.
    """
    fetched = 0
    watch = MotionWatch(motion_samples)
    while True:
        status = session.status()
        check_capture(status)
        watch.look(status)
        session.keep()
        came = status.pages_written > fetched
        for index in range(fetched, status.pages_written):
            try:
                page = read_page(session, identity, index)
            except errors.LinkError:
                check_capture(session.status())  # says so where the board had to overwrite it
                raise
            yield page
            fetched = session.pages_in_hand = index + 1
            if fetched % PAGES_PER_ACKNOWLEDGE == 0 or fetched == status.pages_written:
                session.beat()
            else:
                session.keep()
        if status.state is not registers.State.MOVING:
            return
        if not came:  # while pages were read, more may have come
            time.sleep(board_session.POLL_S)


def page_s(session: board_session.Session) -> float:
    """Time that the line takes for a page, as measured now; 0 where time waits for the host.

    The median: what a busy computer holds up at times waits in the board's ring.
    """
    if session.line is None:
        return 0.0
    times_s = [time.monotonic()]
    for _ in range(_TIMED_PAGES):
        session.read(registers.PAGE_ADDRESS, registers.PAGE_WORDS)
        times_s.append(time.monotonic())
    return median(after - before for before, after in pairwise(times_s))


def read_page(session: board_session.Session, identity: BoardIdentity, index: int) -> CapturePage:
    """Read one page that the board still has.

    Raises
    ------
    LinkError
        It fails its CRC or was overwritten.
    """
    address = registers.PAGE_ADDRESS + index % registers.PAGE_SLOTS * registers.PAGE_SLOT_REGISTERS
    for _ in range(_PAGE_TRIES):
        with suppress(ValueError):
            page = codec.decode_page(session.read(address, registers.PAGE_WORDS))
            if page.index == index and page.first_sample == index * registers.PAGE_SAMPLES:
                return page_in_si(page, identity)
    raise errors.LinkError(
        f"capture page {index} is lost: its CRC is wrong or it was overwritten",
        "use a faster link or a less busy host, then repeat the motion",
    )


# Whether a line brings a motion's pages before the board overwrites them, and how long it takes.
#
# A page fills 119 of the 125 registers that one Modbus reply may have, so a reply brings one page.
# Nor do requests overlap: on a serial line a board discards what comes before its answer has left,
# and over TCP a gateway to such a line forwards one request after the other. So the time of a reply
# decides. What has not been fetched waits in the board's ring, and the end of a motion can be
# fetched after it, as long as the ring holds it.

PAGES_PER_ACKNOWLEDGE: Final = 16
# Pages that surely wait without being overwritten.
_ROOM: Final = registers.PAGE_SLOTS - PAGES_PER_ACKNOWLEDGE


@dataclass(frozen=True)
class CapturePace:
    """How fast a motion's pages are filled and fetched.

    Attributes
    ----------
    pages : int
        Of the motion.
    filled_s : float
        In which the board fills one.
    fetched_s : float
        In which the line brings one, signs of life in between included.
    """

    pages: int
    filled_s: float
    fetched_s: float

    @classmethod
    def of(cls, samples: int, sample_period_s: float, fetched_s: float) -> Self:
        """Of so many samples."""
        return cls(
            math.ceil(samples / registers.PAGE_SAMPLES),
            registers.PAGE_SAMPLES * sample_period_s,
            fetched_s,
        )

    @property
    def keeps_up(self) -> bool:
        """Whether no page waits."""
        return self.fetched_s <= self.filled_s

    @property
    def overwritten(self) -> bool:
        """Whether the board would overwrite pages."""
        return self.fetched_s > self.needed_s

    @property
    def needed_s(self) -> float:
        """Longest time for a page with which none is overwritten."""
        waiting = self.pages - _ROOM  # of these, as many must be fetched while the motion lasts
        return self.filled_s * self.pages / waiting if waiting > 0 else math.inf

    @property
    def longest_s(self) -> float:
        """Longest motion of which no page is overwritten."""
        if self.keeps_up:
            return math.inf
        return _ROOM * self.filled_s / (1.0 - self.filled_s / self.fetched_s)

    @property
    def all_fetched_s(self) -> float:
        """Time from a motion's first sample to its last page."""
        return self.pages * max(self.filled_s, self.fetched_s)
