"""The narrow seam between host and board: read words, write words."""

from typing import Protocol

from firmware_interface.errors import LinkError


class Link(Protocol):
    """A way to the board's registers.

    Methods raise LinkError when the line is at fault (NoReplyError after a timeout) and
    BoardError when the board refuses the address.
    """

    def read(self, address: int, count: int) -> list[int]:
        """Words of consecutive registers; may be repeated inside, at the same address."""

    def write(self, address: int, words: list[int]) -> None:
        """Write consecutive registers in one transfer; never repeated."""

    def close(self) -> None:
        """Let go of the line."""


def open_link(url: str, *, baud_rate: int = 115200, timeout_s: float = 0.3) -> Link:
    """Open the way to a board.

    Parameters
    ----------
    url : str
        `/dev/ttyACM0` or any pySerial URL (Modbus RTU), `tcp://HOST:PORT` (Modbus TCP), or
        `virtual`: a board of its own, in this process, as fast as it can.
    baud_rate : int
        Of a serial line.
    timeout_s : float
        The board's worst reply time.

    Raises
    ------
    LinkError
        No such device, no permission, connection refused, no Modbus device at the other end.
    """
    if url == "virtual":
        from firmware_interface.virtual.board import VirtualBoard

        return VirtualBoard()
    from firmware_interface import modbus

    if not url.startswith("tcp://"):
        return modbus.open_serial(url, baud_rate, timeout_s)
    host, colon, port = url.removeprefix("tcp://").rpartition(":")
    if not colon or not host or not port.isdigit():
        raise LinkError(f"{url}: no port given", "write it as tcp://HOST:PORT")
    return modbus.open_tcp(host, int(port), timeout_s)
