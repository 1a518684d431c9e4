"""Gain banks as words: in which order, and at which addresses.

A bank's words stand in the order of their addresses: of all axes the numbers that map 3 had, then
of all axes those that came with map 4. Its CRC-32 is of all of them.
"""

import struct
from collections.abc import Mapping, Sequence
from typing import Final

from firmware_interface.codec import bytes_to_words, crc32, encode, words_to_bytes
from firmware_interface.gains import AxisGains
from firmware_interface.registers import AXES, MAP_VERSION, REGISTERS
from firmware_interface.spans import WRITTEN_WORDS, Span, addresses, transfers

_FIRST: Final = {3: "proportional", 4: "friction_top_speed"}
"""The first number that each version of the map brought."""
_WORDS: Final = {
    version: sum(
        register.words
        for register in REGISTERS.values()
        if register.name.startswith(f"active.{AXES[0]}.") and register.since == version
    )
    for version in _FIRST
}
"""Words of one axis that each version of the map brought."""


def encode_gains(gains: Mapping[str, AxisGains], version: int = MAP_VERSION) -> list[int]:
    """Words of the axes in a gain bank of this version of the map, without CRC."""
    left = {axis: list(bank.numbers().values()) for axis, bank in gains.items()}
    words = []
    for count in _counts(version):
        for axis in (axis for axis in AXES if axis in gains):
            words += bytes_to_words(struct.pack(f">{count}f", *left[axis][:count]))
            del left[axis][:count]
    return words


def decode_gains(
    words: Sequence[int], version: int = MAP_VERSION, axes: Sequence[str] = AXES
) -> dict[str, AxisGains]:
    """Gains of the axes from a bank's words; numbers that its map does not have are off."""
    numbers: dict[str, list[float]] = {axis: [] for axis in axes}
    first = 0
    for count in _counts(version):
        for axis in axes:
            packed = words_to_bytes(words[first : first + 2 * count])
            numbers[axis] += struct.unpack(f">{count}f", packed)
            first += 2 * count
    return {axis: AxisGains.of_numbers(numbers[axis]) for axis in axes}


def _counts(version: int) -> list[int]:
    """Numbers of one axis in each part of a bank."""
    return [words // 2 for since, words in _WORDS.items() if since <= version]


def bank_spans(group: str, version: int = MAP_VERSION, axes: Sequence[str] = AXES) -> list[Span]:
    """Where the words of a bank stand, in their order.

    Parameters
    ----------
    group : {"active", "shadow", "gain_maximum"}
    version : int
        Of the board's map.
    axes : sequence of str
    """
    return [
        (REGISTERS[f"{group}.{axis}.{_FIRST[since]}"].address, words)
        for since, words in _WORDS.items()
        if since <= version
        for axis in axes
    ]


def span_of(name: str) -> Span:
    """Where a register stands."""
    return REGISTERS[name].address, REGISTERS[name].words


def staged_writes(
    gains: Mapping[str, AxisGains], version: int = MAP_VERSION
) -> tuple[list[tuple[int, list[int]]], int]:
    """The writes, as (address, words), that stage gains, and their CRC, which goes out last."""
    bank, crc = encode_gains(gains, version), span_of("shadow.crc")
    spans = bank_spans("shadow", version)
    words = dict(zip(addresses(spans), bank, strict=True))
    words |= zip(addresses([crc]), encode("shadow.crc", crc32(bank)), strict=True)
    parts = sorted(
        transfers([*spans, crc], WRITTEN_WORDS), key=lambda part: part[0] <= crc[0] < sum(part)
    )
    return [(first, [words[a] for a in addresses([(first, n)])]) for first, n in parts], crc32(bank)
