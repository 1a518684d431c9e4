"""Fetches the pages of a capture while the machine moves, and keeps the board's watchdog fed."""

import time
from collections.abc import Iterator
from contextlib import suppress
from itertools import pairwise
from statistics import median
from typing import Final

from firmware_interface.board_checks import MotionWatch, check_capture
from firmware_interface.board_hold import POLL_S
from firmware_interface.board_session import Session
from firmware_interface.board_types import BoardIdentity, CapturePage, page_in_si
from firmware_interface.capture_pace import PAGES_PER_ACKNOWLEDGE
from firmware_interface.codec import decode_page
from firmware_interface.errors import LinkError
from firmware_interface.registers import (
    PAGE_ADDRESS,
    PAGE_SAMPLES,
    PAGE_SLOT_REGISTERS,
    PAGE_SLOTS,
    PAGE_WORDS,
    State,
)

_PAGE_TRIES: Final = 3
_TIMED_PAGES: Final = 9


def fetch_pages(
    session: Session, identity: BoardIdentity, motion_samples: int
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
            except LinkError:
                check_capture(session.status())  # says so where the board had to overwrite it
                raise
            yield page
            fetched = session.pages_in_hand = index + 1
            if fetched % PAGES_PER_ACKNOWLEDGE == 0 or fetched == status.pages_written:
                session.beat()
            else:
                session.keep()
        if status.state is not State.MOVING:
            return
        if not came:  # while pages were read, more may have come
            time.sleep(POLL_S)


def page_s(session: Session) -> float:
    """Time that the line takes for a page, as measured now; 0 where time waits for the host.

    The median: what a busy computer holds up at times waits in the board's ring.
    """
    if session.line is None:
        return 0.0
    times_s = [time.monotonic()]
    for _ in range(_TIMED_PAGES):
        session.read(PAGE_ADDRESS, PAGE_WORDS)
        times_s.append(time.monotonic())
    return median(after - before for before, after in pairwise(times_s))


def read_page(session: Session, identity: BoardIdentity, index: int) -> CapturePage:
    """Read one page that the board still has.

    Raises
    ------
    LinkError
        It fails its CRC or was overwritten.
    """
    address = PAGE_ADDRESS + index % PAGE_SLOTS * PAGE_SLOT_REGISTERS
    for _ in range(_PAGE_TRIES):
        with suppress(ValueError):
            page = decode_page(session.read(address, PAGE_WORDS))
            if page.index == index and page.first_sample == index * PAGE_SAMPLES:
                return page_in_si(page, identity)
    raise LinkError(
        f"capture page {index} is lost: its CRC is wrong or it was overwritten",
        "use a faster link or a less busy host, then repeat the motion",
    )
