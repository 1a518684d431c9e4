"""Gain banks over a link: what is in force, what is staged, and what a board's law can take."""

from collections.abc import Mapping
from typing import Final

from firmware_interface.board_types import BoardIdentity, ReadWords
from firmware_interface.codec import crc32, decode_integer
from firmware_interface.errors import BoardError, LinkError
from firmware_interface.gain_words import addresses, bank_spans, decode_gains, read_spans, span_of
from firmware_interface.gains import OFF, AxisGains
from firmware_interface.received import checked_gains
from firmware_interface.registers import REGISTERS

_TRIES: Final = 3


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
