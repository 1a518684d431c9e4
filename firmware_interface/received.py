"""What a board sends, believed only after a look: finite, in its range, a known code."""

import math
from collections.abc import Sequence

from firmware_interface import codec, errors, registers
from firmware_interface.register import Register


def valid_value(register: Register, value: float) -> bool:
    """Whether a value may stand in a register: finite, within its range, one of its codes."""
    if register.enum:
        return value in {int(code) for code in getattr(registers, register.enum)}
    lowest = -math.inf if register.minimum is None else register.minimum
    highest = math.inf if register.maximum is None else register.maximum
    return math.isfinite(value) and lowest <= value <= highest


def received(name: str, words: Sequence[int], base: int | None = None) -> float:
    """Value of a register that is no array, from words as `codec.decode` takes them.

    Raises
    ------
    BoardError
        No such value may stand there.
    """
    register = registers.REGISTERS[name]
    (value,) = codec.decode_array(name, words, base)
    if not valid_value(register, value):
        raise nonsense(name, value)
    return value


def received_integer(name: str, words: Sequence[int], base: int | None = None) -> int:
    """Value of a code, counter or flag; see `received`."""
    return int(received(name, words, base))


def nonsense(name: str, value: float) -> errors.BoardError:
    """The error of a value that may not stand in a register."""
    return errors.BoardError(
        f"the board sends {value:g} as {name}, which is impossible",
        "install the same release on board and host; if they are, have the board checked",
    )
