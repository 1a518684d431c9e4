"""Gain banks over a link: in force, staged, what a board's law can take, and when."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

from firmware_interface.board_session import Session
from firmware_interface.board_types import BoardIdentity, ReadWords, checked_gains
from firmware_interface.codec import addresses, crc32, decode_integer, read_spans
from firmware_interface.errors import BoardError, BusyError, LinkError, NoReplyError, RestartedError
from firmware_interface.gains import (
    OFF,
    AxisGains,
    bank_spans,
    decode_gains,
    span_of,
    staged_writes,
)
from firmware_interface.received import received
from firmware_interface.registers import AXES, REGISTERS, STORE_SIGNATURE, Opcode, Result

_TRIES: Final = 3
# What a board says of gains that it takes at rest, but not now.
_EXPECTED: Final = (Result.EFFORT_JUMP, Result.TRAJECTORY_LIMITS)


@dataclass(frozen=True)
class RunningCommit:
    """What became of gains that were to come into force while the control law acts.

    Attributes
    ----------
    result : Result
        DONE, or why the board wants them at rest: EFFORT_JUMP or TRAJECTORY_LIMITS.
    jumps_nm : mapping of axis name to float
        Effort that the new gains ask for, less that of the old ones, which the board evens out.
    """

    result: Result
    jumps_nm: Mapping[str, float]

    @property
    def taken(self) -> bool:
        """They are in force."""
        return self.result is Result.DONE


def read_active(read: ReadWords, version: int) -> dict[str, AxisGains]:
    """Gains in force on a board of this version of the map, all of one bank.

    Raises
    ------
    BoardError
        A number is not finite.
    LinkError
        They do not match their CRC, however often they are read.
    """
    has_crc = REGISTERS["active.crc"].since <= version
    for _ in range(_TRIES):
        words, crc = _read_bank(read, "active", version, has_crc)
        gains = checked_gains("active", decode_gains(words, version))
        if crc in (None, crc32(words)):
            return gains
    raise LinkError(
        "the gains in force change while they are read, or replies are mixed up",
        "make sure that no other host talks to the board, check the cable, then try again",
    )


def read_staged(read: ReadWords, version: int) -> tuple[dict[str, AxisGains], int]:
    """Gains in the shadow bank, and the CRC of what was read.

    Another host may be at work on it: where it does not match its CRC it is read again.
    """
    for _ in range(_TRIES):
        words, crc = _read_bank(read, "shadow", version, True)
        if crc == crc32(words):
            break
    return checked_gains("shadow", decode_gains(words, version)), crc32(words)


def _read_bank(
    read: ReadWords, group: str, version: int, has_crc: bool
) -> tuple[list[int], int | None]:
    """Words of a bank, and its CRC register."""
    spans, name = bank_spans(group, version), f"{group}.crc"
    found = read_spans(read, [*spans, *([span_of(name)] if has_crc else [])])
    words = [found[address] for address in addresses(spans)]
    if not has_crc:
        return words, None
    return words, decode_integer(name, [found[address] for address in addresses([span_of(name)])])


def check_terms(gains: Mapping[str, AxisGains], identity: BoardIdentity) -> None:
    """Make sure that a board's law has every number that the gains do not leave off.

    Raises
    ------
    BoardError
        Names the number.
    """
    for axis, bank in gains.items():
        for name, value in bank.numbers().items():
            known = name.partition("[")[0] in identity.gain_fields
            if not known and value != OFF[name]:
                raise BoardError(
                    f"axis {axis}: the control law of this board has no {name} (register map "
                    f"{identity.map_version}), and the gains ask for {value:.4g}",
                    "install the firmware of this release on the board, or leave this term out",
                )


class GainVerbs:
    """The board's verbs for its gain banks.

    Parameters
    ----------
    session : Session
    identity : BoardIdentity

    Attributes
    ----------
    has_committed : bool
        Whether this host has put gains in force, or tried to.
    has_stored : bool
        Whether it has written gains to permanent memory.
    """

    def __init__(self, session: Session, identity: BoardIdentity) -> None:
        self.identity = identity
        self._session = session
        self._staged_crc: int | None = None
        self.has_committed = False
        self.has_stored = False

    def active_gains(self) -> dict[str, AxisGains]:
        """Gains in force, by axis.

        Raises
        ------
        LinkError
            They do not match their CRC, however often they are read.
        """
        return read_active(self._session.read, self.identity.map_version)

    def staged_gains(self) -> dict[str, AxisGains]:
        """Gains in the shadow bank, by axis; `commit` then means these."""
        gains, self._staged_crc = read_staged(self._session.read, self.identity.map_version)
        return gains

    def stage_gains(self, gains: Mapping[str, AxisGains]) -> None:
        """Write the shadow bank with its CRC, then read all of it back; not in force yet.

        Raises
        ------
        BoardError
            The board's law, of an older map, lacks a term that the gains use; nothing is written.
        LinkError
            What was read back differs.
        """
        version = self.identity.map_version
        check_terms(gains, self.identity)
        writes, crc = staged_writes(gains, version)
        self._session.hold()
        self._session.write_verified(writes)
        self._staged_crc = crc

    def commit(self) -> None:
        """Swap the shadow bank in, as this host staged or last read it.

        Without `confirm` the board rolls back by itself.
        """
        if self._staged_crc is None:
            self.staged_gains()
        self.has_committed = True
        self._session.command(Opcode.COMMIT, self._staged_crc or 0)

    def commit_running(self) -> RunningCommit:
        """The same while the control law acts: in IDLE, in DONE, or as the axes come to rest.

        Raises
        ------
        BoardError
            Refused, and not because the gains would have to wait for rest.
        """
        if self._staged_crc is None:
            self.staged_gains()
        self.has_committed = True
        status = self._session.command(
            Opcode.COMMIT_RUNNING, self._staged_crc or 0, expected=_EXPECTED
        )
        registers = {axis: REGISTERS[f"bumpless.{axis}.jump"] for axis in AXES}
        jumps = {
            axis: received(register.name, self._session.read(register.address, register.words))
            for axis, register in registers.items()
        }
        return RunningCommit(status.last_result, jumps)

    def takes_gains_running(self) -> bool:
        """Whether this board takes gains while its control law acts."""
        capable = REGISTERS["bumpless.capable"]
        if capable.since > self.identity.map_version:
            return False
        return bool(received(capable.name, self._session.read(capable.address, capable.words)))

    def confirm(self) -> None:
        """Keep the committed gains."""
        self._session.command(Opcode.CONFIRM)

    def roll_back(self) -> None:
        """Return to the gains before the last commit."""
        self._session.command(Opcode.ROLL_BACK)

    def store(self) -> None:
        """Write the confirmed gains to permanent memory.

        A board writes only gains that do not stand there. So where its counter has not gone on, it
        is told once more: another command may have come in place of the first.

        Raises
        ------
        NoReplyError, BusyError, RestartedError
            The board could not be asked what became of it; a note says that nobody knows.
        """
        self._session.hold()
        stores = self._session.status().stores
        try:
            if self._session.command(Opcode.STORE, STORE_SIGNATURE).stores == stores:
                self._session.command(Opcode.STORE, STORE_SIGNATURE)
        except (NoReplyError, BusyError, RestartedError, KeyboardInterrupt) as error:
            error.add_note(
                "whether the gains are stored is not known: store them again with edge-ident "
                "gains store"
            )
            raise
        self.has_stored = True
