"""A serial line that goes wrong by name: bytes in at either end, bytes out at the other, later.

Nothing here knows real time: `fault_proxy` runs a line between two pseudo-terminals by the wall
clock, `memory_line` runs the same line in memory by a clock of its own.
"""

import heapq
import random
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from enum import Enum, StrEnum
from typing import Final

BITS_PER_BYTE: Final = 10
_CHUNK: Final = 16
"""Bytes that an adapter hands over at once."""


class Sender(Enum):
    """Who put a frame on the line."""

    HOST = "request"
    BOARD = "reply"


class LineFault(StrEnum):
    """What can happen to a frame."""

    LOST = "lost"
    REPEATED = "repeated"
    LATE = "late"
    TRUNCATED = "truncated"
    MERGED = "merged"
    FLIPPED = "bit-flipped"
    SWAPPED = "given to the next request"


Choose = Callable[[Sender, bytes], LineFault | None]
"""Gives what happens to a frame; asked once for each."""


@dataclass(frozen=True)
class Pace:
    """How fast bytes go.

    Attributes
    ----------
    baud_rate : int or None
        None: at once.
    jitter_s : float
        Every handful of bytes is late by up to so much; the order stays.
    """

    baud_rate: int | None = None
    jitter_s: float = 0.0


def no_fault(sender: Sender, frame: bytes) -> None:
    """A good line."""


class FaultyLine:
    """What happens to every frame between host and board.

    Parameters
    ----------
    choose : Choose
        May be exchanged at any time.
    pace : Pace
    late_s : float
        By how much a late frame is late.
    seed : int
        Of bits, cuts and jitter.

    Attributes
    ----------
    frames : int
        Frames that were put on the line.
    """

    def __init__(
        self,
        choose: Choose = no_fault,
        pace: Pace | None = None,
        late_s: float = 0.4,
        seed: int = 0,
    ) -> None:
        self.choose = choose
        self.pace = pace or Pace()
        self.late_s = late_s
        self.frames = 0
        self.seed = seed
        self._random = random.Random(seed)
        self._partial = {Sender.HOST: b"", Sender.BOARD: b""}
        self._held = {Sender.HOST: b"", Sender.BOARD: b""}
        self._swapped = b""
        self._free_s = {Sender.HOST: 0.0, Sender.BOARD: 0.0}
        self._last_s = {Sender.HOST: 0.0, Sender.BOARD: 0.0}
        self._due: list[tuple[float, int, Sender, bytes]] = []
        self._count = 0

    def accept(self, sender: Sender, data: bytes, now_s: float) -> None:
        """Take bytes from one end."""
        self._partial[sender] += data
        while length := frame_length(sender, self._partial[sender]):
            frame = self._partial[sender][:length]
            self._partial[sender] = self._partial[sender][length:]
            self.frames += 1
            self._pass_on(sender, frame, now_s)

    def due(self, now_s: float) -> Iterator[tuple[Sender, bytes]]:
        """Bytes that have arrived by now, with who sent them."""
        while self._due and self._due[0][0] <= now_s:
            _, _, sender, data = heapq.heappop(self._due)
            yield sender, data

    @property
    def next_s(self) -> float | None:
        """When the next bytes arrive."""
        return self._due[0][0] if self._due else None

    def forget(self) -> None:
        """Lose everything that is on the way: somebody pulled the cable."""
        self._due.clear()
        for parts in (self._partial, self._held):
            parts.update(dict.fromkeys(parts, b""))
        self._swapped = b""

    def _pass_on(self, sender: Sender, frame: bytes, now_s: float) -> None:
        fault = self.choose(sender, frame)
        frame, self._held[sender] = self._held[sender] + frame, b""
        if sender is Sender.HOST and self._swapped:
            self._deliver(Sender.BOARD, self._swapped, now_s)
            self._swapped = b""
        match fault:
            case LineFault.LOST:
                return
            case LineFault.REPEATED:
                self._deliver(sender, frame, now_s)
            case LineFault.LATE:
                self._put(now_s + self.late_s, sender, frame)  # others pass it
                return
            case LineFault.TRUNCATED:
                frame = frame[: self._random.randrange(1, len(frame))]
            case LineFault.MERGED:
                self._held[sender] = frame
                return
            case LineFault.FLIPPED:
                frame = self._flipped(frame)
            case LineFault.SWAPPED:
                if sender is Sender.BOARD:
                    self._swapped = frame
                return
        self._deliver(sender, frame, now_s)

    def _flipped(self, frame: bytes) -> bytes:
        changed = bytearray(frame)
        changed[self._random.randrange(len(frame))] ^= 1 << self._random.randrange(8)
        return bytes(changed)

    def _deliver(self, sender: Sender, frame: bytes, now_s: float) -> None:
        """Put bytes on their way, behind those before them."""
        byte_s = BITS_PER_BYTE / self.pace.baud_rate if self.pace.baud_rate else 0.0
        chunk = _CHUNK if self.pace.baud_rate else len(frame)
        end_s = max(now_s, self._free_s[sender])
        for start in range(0, len(frame), chunk):
            part = frame[start : start + chunk]
            end_s += byte_s * len(part)
            jitter_s = self._random.uniform(0.0, self.pace.jitter_s)
            self._last_s[sender] = max(end_s + jitter_s, self._last_s[sender])
            self._put(self._last_s[sender], sender, part)
        self._free_s[sender] = end_s

    def _put(self, when_s: float, sender: Sender, part: bytes) -> None:
        self._count += 1
        heapq.heappush(self._due, (when_s, self._count, sender, part))


def frame_length(sender: Sender, data: bytes) -> int:
    """Bytes of the frame that data begins with; 0 while it is not whole."""
    length = 8
    if len(data) < 5:
        return 0
    if sender is Sender.BOARD and data[1] & 0x80:
        length = 5
    elif sender is Sender.BOARD and data[1] == 3:
        length = 5 + data[2]
    elif sender is Sender.HOST and data[1] == 16:
        length = 9 + data[6] if len(data) > 6 else len(data) + 1
    return length if len(data) >= length else 0
