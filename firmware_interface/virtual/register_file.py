"""The board's registers as words, with access and ranges as the map says."""

from firmware_interface.codec import decode, encode
from firmware_interface.errors import BoardError, ValueRefusedError
from firmware_interface.registers import (
    PAGE_ADDRESS,
    PAGE_SLOT_REGISTERS,
    PAGE_SLOTS,
    REGISTERS,
)

_END = PAGE_ADDRESS + PAGE_SLOTS * PAGE_SLOT_REGISTERS


class RegisterFile:
    """Words by address: the firmware puts and takes values, the host reads and writes words."""

    def __init__(self) -> None:
        self._words = [0] * _END
        self._readable = bytearray(_END)
        self._writable = bytearray(_END)
        self._readable[PAGE_ADDRESS:] = b"\1" * (_END - PAGE_ADDRESS)
        for register in REGISTERS.values():
            span = slice(register.address, register.address + register.words)
            self._readable[span] = b"\1" * register.words
            if register.access == "rw":
                self._writable[span] = b"\1" * register.words
        self._ranged = [r for r in REGISTERS.values() if r.minimum is not None]

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
        register = REGISTERS[name]
        return decode(name, self.words(register.address, register.words))

    def words(self, address: int, count: int) -> list[int]:
        """A copy."""
        return self._words[address : address + count]

    def put_words(self, address: int, words: list[int]) -> None:
        """Set consecutive registers."""
        self._words[address : address + len(words)] = words

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

    def host_write(self, address: int, words: list[int]) -> None:
        """Words from the host; all or none.

        Raises
        ------
        BoardError
            There is no such register, or it is read-only.
        ValueRefusedError
            A value would leave its range, be it touched only in part.
        """
        end = address + len(words)
        if address < 0 or end > _END or not all(self._writable[address:end]):
            raise _no_register(address, len(words), "write")
        after = [*self._words[:address], *words, *self._words[end:PAGE_ADDRESS]]
        for register in self._ranged:
            touched = address < register.address + register.words and register.address < end
            if touched and register.minimum is not None:
                value = decode(register.name, after, 0)
                if not register.minimum <= value <= (register.maximum or value):
                    raise ValueRefusedError(
                        f"{register.name} = {value:g} {register.unit} is refused",
                        f"allowed are {register.minimum:g} to {register.maximum:g}",
                    )
        self.put_words(address, words)


def _no_register(address: int, count: int, verb: str) -> BoardError:
    return BoardError(
        f"the board has no registers to {verb} from {address:#06x}, {count} of them",
        "bring firmware and host to the same release",
    )
