"""The board's registers as words, with access and ranges as the map says."""

from array import array
from collections.abc import Sequence
from typing import Final

from firmware_interface.codec import decode, encode
from firmware_interface.errors import BoardError, ValueRefusedError
from firmware_interface.received import valid_value
from firmware_interface.register import WORDS, Register
from firmware_interface.registers import (
    MAP_VERSION,
    PAGE_ADDRESS,
    PAGE_SLOT_REGISTERS,
    PAGE_SLOTS,
    REGISTERS,
)
from firmware_interface.spans import Span, addresses

_END: Final = PAGE_ADDRESS + PAGE_SLOTS * PAGE_SLOT_REGISTERS
_CHECKED: Final = [
    register
    for register in REGISTERS.values()
    if register.access == "rw"
    and (register.minimum is not None or register.enum)
    and register.name != "command.opcode"
]
"""Registers whose values have a range or codes; an unknown opcode gets a result instead."""


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
        self.put_words(REGISTERS[name].address, encode(name, value))

    def integer(self, name: str) -> int:
        """Value of a code, counter or flag."""
        return round(self.value(name))

    def value(self, name: str) -> float:
        """Value of a register."""
        if name not in self._values:
            register = REGISTERS[name]
            self._values[name] = decode(name, self.words(register.address, register.words))
        return self._values[name]

    def words(self, address: int, count: int) -> list[int]:
        """A copy."""
        return self._words[address : address + count].tolist()

    def put_words(self, address: int, words: list[int]) -> None:
        """Set consecutive registers."""
        self._words[address : address + len(words)] = array("H", words)
        self._values.clear()

    def spans(self, spans: Sequence[Span]) -> list[int]:
        """A copy of the words at several places, one after the other."""
        return [self._words[address] for address in addresses(spans)]

    def put_spans(self, spans: Sequence[Span], words: Sequence[int]) -> None:
        """Set the registers at several places."""
        for address, word in zip(addresses(spans), words, strict=True):
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
                _check_value(register, decode(register.name, words, address))


def _first_words(register: Register) -> bytes:
    """1 for the first word of every value, 0 for its second."""
    words = WORDS[register.type]
    return bytes(n % words == 0 for n in range(register.words))


def _check_value(register: Register, value: float) -> None:
    if not valid_value(register, value):
        raise ValueRefusedError(
            f"{register.name} = {value:g} {register.unit} is refused",
            "docs/registers.md says what is allowed",
        )


def _no_register(address: int, count: int, verb: str) -> BoardError:
    return BoardError(
        f"the board has no registers to {verb} from {address:#06x}, {count} of them",
        "install the same release on board and host",
    )
