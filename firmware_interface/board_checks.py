"""When a board must not be used, or refuses: the checks and what they tell the user."""

import numpy as np

from firmware_interface.board_types import BoardStatus
from firmware_interface.codec import decode
from firmware_interface.errors import BoardError, LinkError
from firmware_interface.link import Link
from firmware_interface.registers import (
    FAULT_TEXTS,
    FLOAT_TEST,
    MAGIC,
    MAP_CRC,
    MAP_VERSION,
    REGISTERS,
    RESULT_TEXTS,
    Opcode,
    Result,
    State,
)


def check_map(link: Link) -> None:
    """Make sure that the board speaks this register map, before anything is written to it."""

    def value(name: str) -> float:
        register = REGISTERS[f"identity.{name}"]
        return decode(register.name, link.read(register.address, register.words))

    if value("magic") != MAGIC:
        raise BoardError(
            f"the device answers Modbus but is no such board (magic {int(value('magic')):#010x})",
            "check which port or address belongs to the board",
        )
    if value("map_version") != MAP_VERSION or value("map_crc") != MAP_CRC:
        raise BoardError(
            f"the board speaks register map {value('map_version'):.0f} with CRC "
            f"{int(value('map_crc')):#010x}, this host {MAP_VERSION} with {MAP_CRC:#010x}",
            "bring firmware and host to the same release",
        )
    if value("float_test") != np.float32(FLOAT_TEST):
        raise BoardError(
            f"the float test value reads {value('float_test')!r}, not {FLOAT_TEST}",
            "switch off word swapping in the gateway between host and board",
        )


def fault_error(status: BoardStatus) -> BoardError:
    """What a latched fault means, and what to do."""
    meaning, next_step = FAULT_TEXTS[status.fault]
    return BoardError(
        f"fault {status.fault.name} at sample {status.fault_sample}: {meaning}", next_step
    )


def check_capture(status: BoardStatus) -> None:
    """Make sure that the motion still runs, or ran to its end, and that no page was lost."""
    if status.state is State.FAULT:
        raise fault_error(status)
    if status.state not in (State.MOVING, State.DRAINING, State.DONE):
        meaning, next_step = FAULT_TEXTS[status.fault]
        raise BoardError(
            f"the motion was stopped before its end; the board is {status.state.name}"
            + (f" because {meaning}" if status.fault else ""),
            next_step if status.fault else "start it again",
        )
    if status.overflows:
        raise LinkError(
            f"{status.overflows} capture pages were overwritten before they were fetched",
            "use a faster link or a less busy host, then repeat the motion",
        )


def refusal(opcode: Opcode, status: BoardStatus) -> BoardError:
    """Why the board refused a command."""
    if status.last_result is Result.WRONG_STATE and status.state is State.FAULT:
        meaning, next_step = FAULT_TEXTS[status.fault]
        return BoardError(f"{opcode.name} refused: fault {status.fault.name}, {meaning}", next_step)
    meaning, next_step = RESULT_TEXTS[status.last_result]
    return BoardError(f"{opcode.name} refused: {meaning} (board is {status.state.name})", next_step)
