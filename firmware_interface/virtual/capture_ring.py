"""The capture: samples into pages, pages into the ring of slots that the host reads."""

import numpy as np

from firmware_interface.codec import RawPage, encode, encode_page
from firmware_interface.registers import (
    PAGE_ADDRESS,
    PAGE_SAMPLES,
    PAGE_SLOT_REGISTERS,
    PAGE_SLOTS,
)
from firmware_interface.virtual.drive import DriveSample
from firmware_interface.virtual.register_file import RegisterFile


class CaptureRing:
    """Fills the slots and keeps their books.

    Attributes
    ----------
    pages_written, samples, overflows : int
        Since the last `clear`.
    """

    def __init__(self, registers: RegisterFile) -> None:
        self._registers = registers
        self.clear()

    def clear(self) -> None:
        """Begin a new capture."""
        self.pages_written = self.samples = self.overflows = 0
        self._pending: list[DriveSample] = []
        self._acknowledged = 0
        self._registers.put("capture.pages_acknowledged", 0)

    def acknowledge(self, pages: int) -> None:
        """The host holds so many pages; fewer than before is old news."""
        self._acknowledged = max(pages, self._acknowledged)
        self._registers.put("capture.pages_acknowledged", self._acknowledged)

    @property
    def drained(self) -> bool:
        """The host holds every page."""
        return self._acknowledged >= self.pages_written

    @property
    def full(self) -> bool:
        """The next page would overwrite one that the host does not hold."""
        return self.pages_written - self._acknowledged >= PAGE_SLOTS

    def add(self, sample: DriveSample) -> None:
        """Take a sample; write the page that it completes."""
        self._pending.append(sample)
        self.samples += 1
        if len(self._pending) == PAGE_SAMPLES:
            self.flush()

    def flush(self) -> None:
        """Write the samples that are pending, as a short page if need be."""
        if not self._pending:
            return
        self.overflows += self.full
        position, effort, following_error = zip(*self._pending, strict=True)
        page = RawPage(
            self.pages_written,
            self.samples - len(self._pending),
            np.array(position),
            np.array(effort),
            np.array(following_error),
        )
        slot = PAGE_ADDRESS + self.pages_written % PAGE_SLOTS * PAGE_SLOT_REGISTERS
        self._registers.put_words(slot, encode_page(page))
        self.pages_written += 1
        self._pending = []

    def publish(self) -> None:
        """Put the counters where the host reads them."""
        self._registers.put_words(
            self._registers.address("capture.pages_written"),
            encode("capture.pages_written", self.pages_written)
            + encode("capture.samples_captured", self.samples)
            + encode("capture.overflows", self.overflows),
        )
