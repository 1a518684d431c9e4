"""When a board must not be used, or refuses: the checks and what they tell the user."""

import math
import threading
import time
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from typing import Final, TypeVar

import numpy as np

from firmware_interface import board_types, codec, errors, registers
from firmware_interface.link import Line, Link

_T = TypeVar("_T")


_CLOCK_STALL_S: Final = 2.0
STOPPED: Final = "another host or edge-ident stop has stopped this one"
# What a gateway has swapped, by the magic number that comes of it.
_SWAPPED: Final = {
    (registers.MAGIC & 0xFFFF) << 16 | registers.MAGIC >> 16: "words",
    int.from_bytes(registers.MAGIC.to_bytes(4, "little"), "big"): "words and bytes",
    int.from_bytes(
        ((registers.MAGIC & 0xFFFF) << 16 | registers.MAGIC >> 16).to_bytes(4, "little"), "big"
    ): "bytes",
}
# What a status shows of a command that was carried out.
_EFFECTS: Final[Mapping[registers.Opcode, Callable[[board_types.BoardStatus], bool]]] = {
    registers.Opcode.QUICK_STOP: lambda status: (
        status.at_rest or status.state is registers.State.STOPPING
    ),
    registers.Opcode.CLEAR_FAULT: lambda status: not status.fault,
    registers.Opcode.CONFIRM: lambda status: not status.unconfirmed,
    registers.Opcode.ROLL_BACK: lambda status: not status.unconfirmed,
    registers.Opcode.ENABLE: lambda status: status.enabled,
    registers.Opcode.DISABLE: lambda status: not status.enabled,
}
CLOCK_RANGE: Final = 2**32
"""A board's clock wraps around after so many samples."""


def check_map(link: Link) -> None:
    """Make sure that the board speaks a register map that this host knows; nothing is written."""

    def value(name: str) -> float:
        register = registers.REGISTERS[f"identity.{name}"]
        return codec.decode(register.name, link.read(register.address, register.words))

    magic = int(value("magic"))
    if magic in _SWAPPED:
        raise errors.BoardError(
            f"{_SWAPPED[magic]} of each value come in the wrong order (magic {magic:#010x})",
            f"switch off the swapping of {_SWAPPED[magic]} in the gateway between host and board",
        )
    if magic != registers.MAGIC:
        raise errors.BoardError(
            f"the device answers Modbus but is not an edge-ident board (magic {magic:#010x})",
            "check which port or address belongs to the board",
        )
    if board_types.MAP_CRCS.get(int(value("map_version"))) != value("map_crc"):
        raise errors.BoardError(
            f"the board speaks register map {value('map_version'):.0f} with CRC "
            f"{int(value('map_crc')):#010x}, this host {_known_maps()}",
            "install the same release on board and host",
        )
    if value("float_test") != np.float32(registers.FLOAT_TEST):
        raise errors.BoardError(
            f"the float test value reads {value('float_test')!r}, not {registers.FLOAT_TEST}",
            "switch off word swapping in the gateway between host and board",
        )


def _known_maps() -> str:
    newest_first = sorted(board_types.MAP_CRCS.items(), reverse=True)
    return " or ".join(f"{version} with {crc:#010x}" for version, crc in newest_first)


def fault_error(status: board_types.BoardStatus) -> errors.BoardError:
    """What a latched fault or the emergency stop means, and what to do.

    The stop is named beside another fault: boards of older firmware do not put it in the place of
    WATCHDOG.
    """
    fault = status.fault or registers.Fault.STO  # a board says so from its next sample on
    meaning, next_step = registers.FAULT_TEXTS[fault]
    cause = f"fault {fault.name} at sample {status.fault_sample}: {meaning}"
    if status.emergency_stop and fault is not registers.Fault.STO:
        cause += f"; {registers.FAULT_TEXTS[registers.Fault.STO][0]}, too"
        next_step = f"{registers.RESULT_TEXTS[registers.Result.STO_ACTIVE][1]}; {next_step}"
    return _kind(fault)(cause, next_step)


def _kind(fault: registers.Fault) -> type[errors.BoardError]:
    return errors.SilentError if fault is registers.Fault.WATCHDOG else errors.BoardError


def check_capture(status: board_types.BoardStatus) -> None:
    """Make sure that the motion still runs, or ran to its end, and that no page was lost."""
    if status.state is registers.State.FAULT:
        raise fault_error(status)
    if status.state not in (registers.State.MOVING, registers.State.DRAINING, registers.State.DONE):
        early = f"the motion was stopped before its end; the board is {status.state.name}"
        meaning, next_step = registers.FAULT_TEXTS[status.fault]
        if status.fault:
            raise _kind(status.fault)(f"{early} because {meaning}", next_step)
        raise errors.StoppedError(f"{early}: {STOPPED}")
    if status.overflows:
        raise errors.LinkError(
            f"{status.overflows} capture pages were overwritten before they were fetched",
            "use a faster link or a less busy host, then repeat the motion",
        )


def went_back(before: int, now: int) -> bool:
    """Whether a board's clock cannot have gone on from one to the other; it wraps around."""
    return (now - before) % CLOCK_RANGE >= CLOCK_RANGE // 2


class MotionWatch:
    """Makes sure that a motion ends: no board is waited for, or fetched from, for ever.

    Parameters
    ----------
    samples : int
        From start to the end of the capture.
    """

    def __init__(self, samples: int) -> None:
        self._samples = samples
        self._first_clock: int | None = None
        self._clock = 0
        self._moved_s = 0.0

    def look(self, status: board_types.BoardStatus) -> None:
        """Compare the board's counters with what the motion can have brought.

        Raises
        ------
        BoardError
            Its clock stands still, the motion is overdue, or there are more pages than samples.
        """
        now_s = time.monotonic()
        if self._first_clock is None:
            self._first_clock, self._moved_s = status.clock_samples, now_s
        elif status.clock_samples != self._clock:
            self._moved_s = now_s
        self._clock = status.clock_samples
        elapsed = (self._clock - self._first_clock) % CLOCK_RANGE
        if status.state is registers.State.MOVING and (
            elapsed > self._samples or now_s - self._moved_s > _CLOCK_STALL_S
        ):
            raise errors.BoardError(
                f"the motion of {self._samples} samples does not end: the board's clock has gone "
                f"{elapsed} samples on",
                "look at the machine; use the wired emergency stop if it moves",
            )
        if status.pages_written > math.ceil(self._samples / registers.PAGE_SAMPLES):
            raise errors.BoardError(
                f"the board reports {status.pages_written} pages of a motion of "
                f"{self._samples} samples",
                "install the same release on board and host",
            )


def refusal(opcode: registers.Opcode, status: board_types.BoardStatus) -> errors.BoardError:
    """Why the board refused a command."""
    if status.last_result is registers.Result.WRONG_STATE and status.state is registers.State.FAULT:
        fault = fault_error(status)
        return type(fault)(f"{opcode.name} refused: {fault.cause}", fault.next_step)
    if status.last_result is registers.Result.NOT_HELD and not status.session_remaining_s:
        return errors.BoardError(
            f"{opcode.name} refused: this host does not control the board, or no longer does",
            "start again: another host may have armed or committed something on the board",
        )
    meaning, next_step = registers.RESULT_TEXTS[status.last_result]
    limits = status.last_result is registers.Result.TRAJECTORY_LIMITS
    kind = errors.MotionRefusedError if limits else errors.BoardError
    return kind(f"{opcode.name} refused: {meaning} (board is {status.state.name})", next_step)


def check_effect(opcode: registers.Opcode, status: board_types.BoardStatus) -> None:
    """Make sure that a command which the board says it carried out was this one.

    A board tells commands apart by their tokens: it cannot know that the line, or another host's
    command of the same token, has put another one in its place.

    Raises
    ------
    BoardError
        The status does not show what it does.
    """
    shows = _EFFECTS.get(opcode)
    if shows is None or shows(status):
        return
    if status.fault:
        raise fault_error(status)
    raise errors.BoardError(
        f"{opcode.name} had no effect: another command came in its place",
        "check the cable, make sure that no other host talks to the board, then: edge-ident stop",
    )


# Words to and from a board: read back what is written, and notice what comes late or restarts.
#
# The heartbeat's thread shares the line: each transfer is whole before the next begins.

_TRIES: Final = 3


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
        self._unsaid: errors.RestartedError | None = None  # what the heartbeat's thread met
        self._nonce = board_types.read_nonce(self.read)
        self._first_status = board_types.read_status(self.read)
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
            except errors.RestartedError as error:
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
            with suppress(errors.NoReplyError):  # what counts is what reads back
                self.write(address, words)
        found = codec.read_spans(self.read, [(address, len(words)) for address, words in writes])
        for address, words in writes:
            if [found[there] for there in codec.addresses([(address, len(words))])] != words:
                raise errors.LinkError(
                    f"registers from {address:#06x} read back differently from what was written",
                    "check the cable and that no other host talks to the board, then try again",
                )

    def status(self) -> board_types.BoardStatus:
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
        raise errors.LinkError(
            f"late replies continue to arrive: the clock of the board reads "
            f"{status.clock_samples} samples after {before}",
            "check the cable and all devices between host and board, then try again",
        )

    def _agreeing_status(self) -> board_types.BoardStatus:
        for _ in range(_TRIES):
            status = board_types.read_status(self.read)
            if _agrees(status):
                return status
        raise errors.ChangedWordError("what the board says of its state contradicts itself")

    def _check_nonce(self) -> None:
        """Make sure that it is the board of before, which has not restarted."""
        nonce = board_types.read_nonce(self.read)
        if nonce != self._nonce:
            self._restarted(nonce)
            raise errors.RestartedError(nonce)

    def _restarted(self, nonce: int) -> None:
        """Its clock began anew."""
        self._nonce, self._clock = nonce, 0


def _agrees(status: board_types.BoardStatus) -> bool:
    """Whether what it says twice is the same; a word that the line changed may show so."""
    full, rest = divmod(status.samples_captured, registers.PAGE_SAMPLES)
    pages = (full, full + 1) if rest else (full,)
    return status.enabled == status.brake_released and status.pages_written in pages
