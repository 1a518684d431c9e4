"""Serial ports, and what answers at each."""

from collections.abc import Callable
from dataclasses import dataclass

from serial.tools import list_ports

from edge_ident.errors import BoardError, LinkError
from firmware_interface.board import Board, BoardIdentity
from firmware_interface.connection import open_link


@dataclass(frozen=True)
class Port:
    """A serial port.

    Attributes
    ----------
    device, description, hardware_id : str
        As the system has them.
    board : BoardIdentity or None
        The board that answered.
    answer : str
        What answered, in words.
    next_step : str
        Where no board did.
    """

    device: str
    description: str
    hardware_id: str
    board: BoardIdentity | None
    answer: str
    next_step: str = ""


def ask_ports(baud_rate: int, on_port: Callable[[int, int], None]) -> list[Port]:
    """Ask at every serial port for a board's identity.

    Parameters
    ----------
    baud_rate : int
    on_port : callable
        Called with ports asked and ports in all.
    """
    listed = sorted(list_ports.comports(), key=lambda port: str(port.device))
    found = []
    for n, port in enumerate(listed):
        on_port(n, len(listed))
        found.append(_ask(port.device, port.description, port.hwid, baud_rate))
    on_port(len(listed), len(listed))
    return found


def _ask(device: str, description: str, hardware_id: str, baud_rate: int) -> Port:
    try:
        link = open_link(device, baud_rate=baud_rate)
        try:
            board = Board.connect(link).identity
        finally:
            link.close()
    except (LinkError, BoardError) as error:
        return Port(device, description, hardware_id, None, error.cause, error.next_step)
    answer = f"board {board.serial_number}, firmware {board.firmware_version}"
    return Port(device, description, hardware_id, board, answer)
