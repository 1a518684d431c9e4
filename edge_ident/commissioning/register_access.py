"""Single registers, read as they stand and written with guards."""

from collections.abc import Sequence

from edge_ident.errors import BoardError
from edge_ident.support.words import listed, plain_number
from firmware_interface import codec, received, registers
from firmware_interface.board import Board
from firmware_interface.errors import ValueRefusedError
from firmware_interface.register import Register
from firmware_interface.registers import REGISTERS, State


def code_name(register: Register, value: float) -> str | None:
    """Name of a code, where the register holds one that is known."""
    if not register.enum or not received.valid_value(register, value):
        return None
    return str(getattr(registers, register.enum)(int(value)).name)


def parse_values(register: Register, texts: Sequence[str]) -> tuple[float, ...]:
    """Values from what a person wrote: numbers, or names of codes.

    Raises
    ------
    ValueError
        Neither, too few or too many.
    """
    if len(texts) != register.count:
        raise ValueError(f"{register.name} takes {register.count} values, {len(texts)} were given")
    codes = getattr(registers, register.enum).__members__ if register.enum else {}
    try:
        return tuple(float(codes[text]) if text in codes else plain_number(text) for text in texts)
    except ValueError as error:
        known = f"; its codes are {listed(codes)}" if codes else ""
        raise ValueError(f"{register.name} takes numbers{known}") from error


def check_write(register: Register, values: Sequence[float]) -> None:
    """Refuse what may not be written to a single register, before a board is asked.

    Raises
    ------
    BoardError
        It may only be read, or is a command's.
    ValueRefusedError
        A value is not finite, outside the range, no known code, or does not fit.
    """
    if register.access != "rw":
        raise BoardError(f"{register.name} may only be read", "choose a register with access rw")
    if register.name.startswith(("command.", "session.")):
        raise BoardError(
            f"{register.name} is used by commands and is not a setting",
            "use the commands run, capture, home, stop or gains",
        )
    for value in values:
        if not received.valid_value(register, value):
            raise ValueRefusedError(f"{register.name} = {value:g} is refused", _allowed(register))
    try:
        codec.encode(register.name, *values)
    except ValueError as error:
        raise ValueRefusedError(str(error), "give a value that fits the register") from error


def _allowed(register: Register) -> str:
    if register.enum:
        return "allowed are " + ", ".join(getattr(registers, register.enum).__members__)
    if register.minimum is None:
        return "give a finite number"
    return f"allowed are {register.minimum:g} to {register.maximum:g} {register.unit}"


def write_register(board: Board, register: Register, values: Sequence[float]) -> None:
    """Write a register of a board that is IDLE, and read it back.

    Raises
    ------
    BoardError
        See `check_write`; or the board is busy, or another host holds it.
    LinkError
        What was read back differs.
    """
    check_write(register, values)
    state = board.status().state
    if state is not State.IDLE:
        raise BoardError(
            f"the board is {state.name}",
            "write registers only while the board is IDLE and no other command uses it",
        )
    board.claim()
    board.write_register(register.name, *values)


def registers_named(name: str | None) -> list[Register]:
    """All registers, one, or those of a group such as `limits.x`; none where there is no such."""
    if name is None:
        return list(REGISTERS.values())
    return [r for r in REGISTERS.values() if r.name == name or r.name.startswith(f"{name}.")]


def registers_of(board: Board, chosen: Sequence[Register]) -> list[Register]:
    """The registers among those chosen that a board's map has.

    Raises
    ------
    BoardError
        It has none of them.
    """
    version = board.identity.map_version
    found = [register for register in chosen if register.since <= version]
    if not found:
        raise BoardError(
            f"the board speaks register map {version}, which does not have {chosen[0].name}",
            "install the firmware of this release on the board",
        )
    return found
