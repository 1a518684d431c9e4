"""The board's registers as words, with access and ranges as the map says."""

import math
from array import array
from collections import deque
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Final, Protocol

import numpy as np

from firmware_interface import board_identification, board_types, codec, errors, received
from firmware_interface.register import WORDS, Register
from firmware_interface.registers import (
    AXES,
    MAP_VERSION,
    PAGE_ADDRESS,
    PAGE_SAMPLES,
    PAGE_SLOT_REGISTERS,
    PAGE_SLOTS,
    REGISTERS,
    SESSION_LEASE_S,
    IdentificationReason,
    IdentificationState,
)
from firmware_interface.virtual.drive import SAMPLE_PERIOD_S, DriveSample

_END: Final = PAGE_ADDRESS + PAGE_SLOTS * PAGE_SLOT_REGISTERS
# Registers whose values have a range or codes; an unknown opcode gets a result instead.
_CHECKED: Final = [
    register
    for register in REGISTERS.values()
    if register.access == "rw"
    and (register.minimum is not None or register.enum)
    and register.name != "command.opcode"
]


class RegisterFile:
    """Words by address: the firmware puts and takes values, the host reads and writes words.

    Parameters
    ----------
    map_version : int
        Registers that came later are not there.
    """

    def __init__(self, map_version: int = MAP_VERSION) -> None:
        self._words = array("H", bytes(2 * _END))  # a list of numbers is ten times as large
        self._values: dict[str, float] = {}  # decoded since the last word was put
        self._readable = bytearray(_END)
        self._writable = bytearray(_END)
        self._begins = bytearray(_END)
        self._readable[PAGE_ADDRESS:] = b"\1" * (_END - PAGE_ADDRESS)
        for register in REGISTERS.values():
            if register.since > map_version:
                continue
            span = slice(register.address, register.address + register.words)
            self._readable[span] = b"\1" * register.words
            if register.access == "rw":
                self._writable[span] = b"\1" * register.words
            self._begins[span] = _first_words(register)

    # ---- the firmware's side

    @staticmethod
    def address(name: str) -> int:
        """Address of a register."""
        return REGISTERS[name].address

    def put(self, name: str, value: float) -> None:
        """Set a register."""
        self.put_words(REGISTERS[name].address, codec.encode(name, value))

    def integer(self, name: str) -> int:
        """Value of a code, counter or flag."""
        return round(self.value(name))

    def value(self, name: str) -> float:
        """Value of a register."""
        if name not in self._values:
            register = REGISTERS[name]
            self._values[name] = codec.decode(name, self.words(register.address, register.words))
        return self._values[name]

    def words(self, address: int, count: int) -> list[int]:
        """A copy."""
        return self._words[address : address + count].tolist()

    def put_words(self, address: int, words: list[int]) -> None:
        """Set consecutive registers."""
        self._words[address : address + len(words)] = array("H", words)
        self._values.clear()

    def spans(self, spans: Sequence[codec.Span]) -> list[int]:
        """A copy of the words at several places, one after the other."""
        return [self._words[address] for address in codec.addresses(spans)]

    def put_spans(self, spans: Sequence[codec.Span], words: Sequence[int]) -> None:
        """Set the registers at several places."""
        for address, word in zip(codec.addresses(spans), words, strict=True):
            self._words[address] = word
        self._values.clear()

    # ---- the host's side

    def host_read(self, address: int, count: int) -> list[int]:
        """Words for the host.

        Raises
        ------
        BoardError
            There is no such register.
        """
        end = address + count
        if address < 0 or end > _END or not all(self._readable[address:end]):
            raise _no_register(address, count, "read")
        return self.words(address, count)

    def check_write(self, address: int, words: list[int]) -> None:
        """Make sure that the host may write these words; they are whole values.

        Raises
        ------
        BoardError
            There is no such register, it is read-only, or a value would be written in part.
        ValueRefusedError
            A value is outside its range, or no code.
        """
        end = address + len(words)
        if (
            address < 0
            or end > PAGE_ADDRESS
            or not all(self._writable[address:end])
            or not self._begins[address]
            or (self._writable[end] and not self._begins[end])
        ):
            raise _no_register(address, len(words), "write")
        for register in _CHECKED:
            if address <= register.address < end:
                _check_value(register, codec.decode(register.name, words, address))


def _first_words(register: Register) -> bytes:
    """1 for the first word of every value, 0 for its second."""
    words = WORDS[register.type]
    return bytes(n % words == 0 for n in range(register.words))


def _check_value(register: Register, value: float) -> None:
    if not received.valid_value(register, value):
        raise errors.ValueRefusedError(
            f"{register.name} = {value:g} {register.unit} is refused",
            "docs/registers.md says what is allowed",
        )


def _no_register(address: int, count: int, verb: str) -> errors.BoardError:
    return errors.BoardError(
        f"the board has no registers to {verb} from {address:#06x}, {count} of them",
        "install the same release on board and host",
    )


# Which host holds the board, for how long still, and when it was last heard.

FREE: Final = 0
"""No host's key."""
_STOPPED_REMEMBERED: Final = 8


class Session:
    """The holder's key, its lease, and the silence that the watchdog measures.

    Nobody else's frames count: neither a foreign host nor a mere reader keeps a motion alive.
    Whoever stops the machine ends the hold. The stopped host may know nothing of it yet, so its key
    holds the board no more; under another one it comes as a new host.

    Parameters
    ----------
    now_s : callable
        The clock of lease and watchdog.
    """

    def __init__(self, now_s: Callable[[], float]) -> None:
        self._now_s = now_s
        self._key = self._released = FREE
        self._stopped: deque[int] = deque(maxlen=_STOPPED_REMEMBERED)
        self._lease_s = self._heard_s = now_s()

    @property
    def key(self) -> int:
        """The holder's, or FREE."""
        return self._key if self.remaining_s > 0.0 else FREE

    @property
    def remaining_s(self) -> float:
        """What is left of the lease; 0 when nobody holds the board."""
        if self._key == FREE:
            return 0.0
        return max(self._lease_s + SESSION_LEASE_S - self._now_s(), 0.0)

    @property
    def silence_s(self) -> float:
        """Time since the holder was heard."""
        return self._now_s() - self._heard_s

    def may_claim(self, key: int, *, heartbeat: bool) -> bool:
        """Whether the board is free, or held by this key already, which nobody has stopped.

        A heartbeat of the host that let go last comes late.
        """
        late = heartbeat and key == self._released
        return self.key in (FREE, key) and key not in self._stopped and not late

    def heard(self, key: int) -> None:
        """The host of this key, which may claim the board, wrote it or a command."""
        self._key, self._released = key, FREE
        self._lease_s = self._heard_s = self._now_s()

    def keep(self) -> None:
        """Hold on while something guards what the host began, and will end it."""
        if self.key != FREE:
            self._lease_s = self._now_s()

    def stopped_by(self, key: int) -> None:
        """A host of this key stops the machine: the hold of another one ends, even one run out."""
        if self._key not in (FREE, key):
            self._stopped.append(self._key)
            self._key = FREE

    def release(self) -> None:
        """Nobody holds the board."""
        self._key, self._released = FREE, self._key


# The capture: samples into pages, pages into the ring of slots that the host reads.


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
        page = codec.RawPage(
            self.pages_written,
            self.samples - len(self._pending),
            np.array(position),
            np.array(effort),
            np.array(following_error),
        )
        slot = PAGE_ADDRESS + self.pages_written % PAGE_SLOTS * PAGE_SLOT_REGISTERS
        self._registers.put_words(slot, codec.encode_page(page))
        self.pages_written += 1
        self._pending = []

    def publish(self) -> None:
        """Put the counters where the host reads them."""
        self._registers.put_words(
            self._registers.address("capture.pages_written"),
            codec.encode("capture.pages_written", self.pages_written)
            + codec.encode("capture.samples_captured", self.samples)
            + codec.encode("capture.overflows", self.overflows),
        )


# The virtual board's own identification: it keeps the capture, and computes when it is asked.
#
# How it computes comes from outside, as a microcontroller gets its network: this package knows
# nothing of identification.


class Identifier(Protocol):
    """Identifies a captured motion with a network."""

    @property
    def network(self) -> int:
        """Code of the network, see `firmware_interface.board_identification.network_code`."""

    @property
    def longest_s(self) -> float:
        """How much of a motion it looks at."""

    def identify(
        self, captured: board_identification.CapturedCounts, board: board_types.BoardIdentity
    ) -> Mapping[str, board_identification.BoardAxis]:
        """What the network says of each axis."""


@dataclass
class OwnIdentification:
    """What becomes of a motion.

    The board computes when a host reads the registers, and answers that host when it is done: so
    the same requests always get the same answers.

    Parameters
    ----------
    registers : RegisterFile
    map_version : int
    identifier : Identifier or None
        Without one the board has no network.
    """

    registers: RegisterFile
    map_version: int
    identifier: Identifier | None

    def __post_init__(self) -> None:
        self._state = IdentificationState.NONE
        self._motion = 0
        self._axes: Mapping[str, board_identification.BoardAxis] = {}
        self._forget()
        longest_s = self.identifier.longest_s if self.identifier else 0.0
        self._most_samples = math.ceil(longest_s / SAMPLE_PERIOD_S)
        self._put()

    def begin(self, token: int) -> None:
        """A motion begins: what was found of another is gone."""
        self._motion, self._axes = token, {}
        self._forget()
        self._state = IdentificationState.CAPTURING
        self._put()

    def add(self, sample: DriveSample) -> None:
        """Take a captured sample."""
        if len(self._position) < self._most_samples * len(AXES):
            self._position.extend(sample.position)
            self._effort.extend(sample.effort)

    def captured(self) -> None:
        """The last sample was captured."""
        self._state = IdentificationState.RUNNING
        self._put()

    def stopped(self) -> None:
        """The motion is over; it may not have got to the end of its capture."""
        if self._state is IdentificationState.CAPTURING:
            reason = board_identification.BoardAxis(IdentificationReason.STOPPED)
            self._end(dict.fromkeys(AXES, reason))

    def asked(self) -> None:
        """A host is about to read: compute, if there is something to compute."""
        if self._state is IdentificationState.RUNNING and self.identifier is not None:
            by_sample = (
                np.array(of).reshape(-1, len(AXES)) for of in (self._position, self._effort)
            )
            counts = board_identification.CapturedCounts(*by_sample)
            board = board_types.read_identity(self.registers.words)
            self._end(self.identifier.identify(counts, board))

    def _end(self, axes: Mapping[str, board_identification.BoardAxis]) -> None:
        identified = [axis.reason is IdentificationReason.NONE for axis in axes.values()]
        self._axes = axes
        self._forget()
        self._state = IdentificationState.DONE if any(identified) else IdentificationState.FAILED
        self._put()

    def _forget(self) -> None:
        """Nothing is captured: counts (samples, axes), row after row, as a board keeps them."""
        self._position, self._effort = array("q"), array("q")

    def _put(self) -> None:
        """Put it where the host reads it."""
        if self.identifier is None or self.map_version < board_identification.SINCE:
            return
        found = board_identification.BoardIdentification(
            self._state, self._motion, self.identifier.network, self._axes
        )
        address = self.registers.address("identification.state")
        self.registers.put_words(address, board_identification.identification_words(found))
