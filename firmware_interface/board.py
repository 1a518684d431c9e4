"""The board's verbs, on top of a link.

A command carries a fresh token and is written once. What became of it is read back by that
token, so that a lost reply neither repeats a motion nor hides a refusal.
"""

import math
import secrets
import time
from collections.abc import Iterator, Mapping
from contextlib import suppress
from typing import Final, Self

from firmware_interface.board_checks import (
    MotionWatch,
    check_capture,
    check_clock,
    check_map,
    refusal,
)
from firmware_interface.board_types import (
    AxisLimits,
    BoardIdentity,
    BoardStatus,
    CapturePage,
    page_in_si,
    read_identity,
    read_limits,
    read_status,
)
from firmware_interface.codec import (
    GAIN_WORDS,
    crc32,
    decode_array,
    decode_page,
    encode,
    encode_gains,
    encode_trajectory,
)
from firmware_interface.errors import BoardError, LinkError, NoReplyError
from firmware_interface.gains import AxisGains
from firmware_interface.link import Link
from firmware_interface.motion import Trajectory
from firmware_interface.received import received_gains
from firmware_interface.registers import (
    AXES,
    MAP_CRC,
    PAGE_ADDRESS,
    PAGE_SAMPLES,
    PAGE_SLOT_REGISTERS,
    PAGE_SLOTS,
    PAGE_WORDS,
    REGISTERS,
    STORE_SIGNATURE,
    Opcode,
    Result,
    State,
)

__all__ = ["AxisLimits", "Board", "BoardIdentity", "BoardStatus", "CapturePage"]

_POLL_S: Final = 0.005
_COMMAND_TIMEOUT_S: Final = 0.5
_REST_TIMEOUT_S: Final = 10.0
_PAGE_TRIES: Final = 3
_PAGES_PER_ACKNOWLEDGE: Final = 16
_TOKEN_LEAP: Final = 128
_TOKEN_SPREAD: Final = 640
"""Sixty-four leaps, and so all that a board remembers, do not go once around all tokens."""
_BANK_WORDS: Final = REGISTERS["shadow.crc"].address - REGISTERS["shadow.x.proportional"].address


class Board:
    """A connected board; made by `Board.connect`.

    Attributes
    ----------
    axes : tuple of str
        Names, in the order of the capture's columns.
    identity : BoardIdentity
    """

    axes: Final = AXES

    def __init__(self, link: Link, identity: BoardIdentity) -> None:
        self.identity = identity
        self._link = link
        status = read_status(link.read)
        self._clock = status.clock_samples
        # beyond those of earlier hosts: the board ignores what it remembers, and last frames of a
        # host that is gone may still come
        self._token = status.last_token + _TOKEN_LEAP + secrets.randbelow(_TOKEN_SPREAD)
        self._motion_samples = 0

    @classmethod
    def connect(cls, link: Link) -> Self:
        """Check that the board speaks this register map.

        Raises
        ------
        LinkError
            No reply.
        BoardError
            No such board, another word order, another map, or stuck in its self-test.
        """
        check_map(link)
        board = cls(link, read_identity(link.read))
        board._wait_for(set(State) - {State.INIT}, "end its self-test")
        return board

    def close(self) -> None:
        """Let go of the link."""
        self._link.close()

    def status(self) -> BoardStatus:
        """State, fault, last command and counters, all of one moment.

        Raises
        ------
        BoardError
            The board has restarted since it was asked last; said once.
        """
        status = read_status(self._link.read)
        before, self._clock = self._clock, status.clock_samples
        check_clock(before, status.clock_samples)
        return status

    def limits(self) -> Mapping[str, AxisLimits]:
        """What the board enforces, by axis."""
        return {axis: read_limits(self._link.read, axis) for axis in self.axes}

    def register_values(self, name: str) -> tuple[float, ...]:
        """Values of a register as they stand there, believable or not."""
        register = REGISTERS[name]
        return decode_array(name, self._link.read(register.address, register.words))

    def write_register(self, name: str, *values: float) -> None:
        """Write one register, read back and compared; see `codec.encode` for ValueError."""
        self._write_verified(REGISTERS[name].address, encode(name, *values))

    # ---- motion

    def write_trajectory(self, trajectory: Trajectory) -> None:
        """Hand over a trajectory, read back and compared.

        Raises
        ------
        BoardError
            The board cannot represent it.
        LinkError
            What was read back differs.
        """
        try:
            writes = encode_trajectory(trajectory, self.identity.sample_period_s)
        except ValueError as error:
            raise BoardError(
                f"the board cannot follow this motion: {error}", "choose another motion"
            ) from error
        for address, words in writes:
            self._write_verified(address, words)
        motion_s = trajectory.lead_in_s + trajectory.duration_s
        self._motion_samples = math.ceil(motion_s / self.identity.sample_period_s) + 1

    def arm(self) -> None:
        """Have the board check the trajectory against its limits, from where it stands."""
        self._command(Opcode.ARM)

    def start(self) -> None:
        """Start the armed motion."""
        self._command(Opcode.START, MAP_CRC)

    def capture_pages(self) -> Iterator[CapturePage]:
        """Fetch the capture of the trajectory written before, while it runs, to its last sample.

        Raises
        ------
        BoardError
            The board is in fault, the motion was stopped or does not end.
        LinkError
            A page was lost or cannot be read.
        """
        fetched = 0
        watch = MotionWatch(self._motion_samples)
        while True:
            status = self.status()
            check_capture(status)
            watch.look(status)
            for index in range(fetched, status.pages_written):
                yield self._read_page(index)
                fetched = index + 1
                if fetched % _PAGES_PER_ACKNOWLEDGE == 0 or fetched == status.pages_written:
                    self._acknowledge(fetched)
            if status.state is not State.MOVING:
                return
            time.sleep(_POLL_S)

    def read_last_page(self) -> CapturePage:
        """The newest page of the last capture, once more; it stays until the next start.

        Raises
        ------
        BoardError
            Nothing was captured since power-up.
        """
        pages = self.status().pages_written
        if not pages:
            raise BoardError("the board holds no capture", "run a motion first")
        return self._read_page(pages - 1)

    def finish(self) -> None:
        """Wait until the machine is at rest after a capture, then leave the motion."""
        self._wait_for({State.DONE, State.FAULT, State.IDLE}, "come to rest after the motion")
        self._command(Opcode.FINISH)

    def quick_stop(self) -> None:
        """Decelerate to rest and wait for it. No safety function."""
        self._command(Opcode.QUICK_STOP)
        self._wait_for({State.IDLE, State.FAULT}, "stop")

    def clear_fault(self) -> None:
        """Leave a latched fault, once its cause is gone and the machine at rest."""
        self._command(Opcode.CLEAR_FAULT)

    # ---- gains

    def active_gains(self) -> dict[str, AxisGains]:
        """Gains in force, by axis."""
        return self._bank("active", _BANK_WORDS)

    def staged_gains(self) -> dict[str, AxisGains]:
        """Gains in the shadow bank, by axis."""
        # with its CRC: of another length than the active bank, neither passes for the other
        return self._bank("shadow", _BANK_WORDS + REGISTERS["shadow.crc"].words)

    def stage_gains(self, gains: Mapping[str, AxisGains]) -> None:
        """Write the shadow bank with its CRC, read back and compared; not in force yet."""
        words = encode_gains(gains)
        words += encode("shadow.crc", crc32(words))
        self._write_verified(_bank_address("shadow"), words)

    def commit(self) -> None:
        """Swap the shadow bank in; without `confirm` the board rolls back by itself."""
        self._command(Opcode.COMMIT)

    def confirm(self) -> None:
        """Keep the committed gains."""
        self._command(Opcode.CONFIRM)

    def roll_back(self) -> None:
        """Return to the gains before the last commit."""
        self._command(Opcode.ROLL_BACK)

    def store(self) -> None:
        """Write the confirmed gains to permanent memory."""
        self._command(Opcode.STORE, STORE_SIGNATURE)

    # ---- inside

    def _bank(self, group: str, count: int) -> dict[str, AxisGains]:
        words = self._link.read(_bank_address(group), count)
        return {
            axis: received_gains(f"{group}.{axis}", words[n * GAIN_WORDS : (n + 1) * GAIN_WORDS])
            for n, axis in enumerate(AXES)
        }

    def _write_verified(self, address: int, words: list[int]) -> None:
        with suppress(NoReplyError):  # what counts is what reads back
            self._link.write(address, words)
        if self._link.read(address, len(words)) != words:
            raise LinkError(
                f"registers from {address:#06x} read back differently from what was written",
                "check the cable and that no other host talks to the board, then try again",
            )

    def _command(self, opcode: Opcode, argument: int = 0) -> None:
        """Have a command carried out; one refused because an axis still settles, once it stands."""
        deadline = time.monotonic() + _REST_TIMEOUT_S
        while (status := self._send(opcode, argument)).last_result is Result.NOT_AT_REST:
            if time.monotonic() > deadline:
                break
            time.sleep(_POLL_S)
        if status.last_result is not Result.DONE:
            raise refusal(opcode, status)

    def _send(self, opcode: Opcode, argument: int) -> BoardStatus:
        """Write a command once and wait until the board has taken it."""
        self._token = self._token % 0xFFFF + 1
        words = encode("command.opcode", opcode) + encode("command.token", self._token)
        words += encode("command.argument", argument)
        with suppress(NoReplyError):  # the token tells whether it arrived
            self._link.write(REGISTERS["command.opcode"].address, words)
        deadline = time.monotonic() + _COMMAND_TIMEOUT_S
        while (status := self.status()).last_token != self._token:
            if time.monotonic() > deadline:
                raise LinkError(
                    f"{opcode.name} did not reach the board: nothing was carried out",
                    "check the cable, then try again",
                )
            time.sleep(_POLL_S)
        return status

    def _wait_for(self, states: set[State], what: str) -> BoardStatus:
        deadline = time.monotonic() + _REST_TIMEOUT_S
        while (status := self.status()).state not in states:
            if time.monotonic() > deadline:
                raise BoardError(
                    f"the board is still {status.state.name} after {_REST_TIMEOUT_S:g} s: "
                    f"it did not {what}",
                    "look at the machine; use the wired emergency stop if it moves",
                )
            time.sleep(_POLL_S)
        return status

    def _acknowledge(self, pages: int) -> None:
        with suppress(NoReplyError):  # the next acknowledge includes this one
            self._link.write(
                REGISTERS["capture.pages_acknowledged"].address,
                encode("capture.pages_acknowledged", pages),
            )

    def _read_page(self, index: int) -> CapturePage:
        address = PAGE_ADDRESS + index % PAGE_SLOTS * PAGE_SLOT_REGISTERS
        for _ in range(_PAGE_TRIES):
            with suppress(ValueError):
                page = decode_page(self._link.read(address, PAGE_WORDS))
                if page.index == index and page.first_sample == index * PAGE_SAMPLES:
                    return page_in_si(page, self.identity)
        raise LinkError(
            f"capture page {index} is lost: it fails its CRC or was overwritten",
            "use a faster link or a less busy host, then repeat the motion",
        )


def _bank_address(group: str) -> int:
    return REGISTERS[f"{group}.{AXES[0]}.proportional"].address
