"""From a device's name to an open link."""

from typing import TYPE_CHECKING, Final

from firmware_interface.errors import LinkError
from firmware_interface.link import Link

if TYPE_CHECKING:
    from firmware_interface.plant.plant import Plant
    from firmware_interface.virtual.register_file import Identifier

DEFAULT_BAUD_RATE: Final = 115200


def open_link(
    url: str,
    *,
    baud_rate: int = DEFAULT_BAUD_RATE,
    timeout_s: float = 0.3,
    plant: "Plant | None" = None,
    identifier: "Identifier | None" = None,
) -> Link:
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
    plant : Plant, optional
        The drive behind a board `virtual`; by default a sound one.
    identifier : Identifier, optional
        Of a board `virtual`; by default it does not identify by itself.

    Raises
    ------
    LinkError
        No such device, no permission, connection refused, no Modbus device at the other end.
    """
    if url == "virtual":
        # a host of a real board need not wait until a simulated drive has loaded
        from firmware_interface.virtual.board import VirtualBoard

        return VirtualBoard(plant=plant, identifier=identifier)
    # nor need that of a virtual one wait for pymodbus, which takes 6 MiB
    from firmware_interface.modbus import open_serial, open_tcp

    if not url.startswith("tcp://"):
        return open_serial(url, baud_rate, timeout_s)
    host, colon, port = url.removeprefix("tcp://").rpartition(":")
    if not colon or not host or not port.isdecimal():
        raise LinkError(f"{url}: no port given", "write it as tcp://HOST:PORT")
    return open_tcp(host, int(port), timeout_s)
