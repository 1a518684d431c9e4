"""Whether a line brings a motion's pages before the board overwrites them, and how long it takes.

A page fills 119 of the 125 registers that one Modbus reply may have, so a reply brings one page.
Nor do requests overlap: on a serial line a board discards what comes before its answer has left,
and over TCP a gateway to such a line forwards one request after the other. So the time of a reply
decides. What has not been fetched waits in the board's ring, and the end of a motion can be fetched
after it, as long as the ring holds it.
"""

import math
from dataclasses import dataclass
from typing import Final, Self

from firmware_interface.registers import PAGE_SAMPLES, PAGE_SLOTS

PAGES_PER_ACKNOWLEDGE: Final = 16
_ROOM: Final = PAGE_SLOTS - PAGES_PER_ACKNOWLEDGE
"""Pages that surely wait without being overwritten."""


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
        return cls(math.ceil(samples / PAGE_SAMPLES), PAGE_SAMPLES * sample_period_s, fetched_s)

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
