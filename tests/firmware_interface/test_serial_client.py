"""A serial line that gives back what the host sends, as an RS-485 adapter that hears itself."""

import pytest
from board_bench import NEW

from firmware_interface.board import Board
from firmware_interface.modbus import ModbusLink, SerialClient
from firmware_interface.modbus_server import RtuSession
from firmware_interface.virtual.board import VirtualBoard


class Port:
    """What the client takes for an open port; bytes arrive in pieces of some size.

    Parameters
    ----------
    echo : bool
        What is written comes back.
    piece : int
    connected : bool
        The board hears what is written.
    """

    def __init__(self, echo: bool, piece: int, connected: bool = True) -> None:
        self.echo, self.piece, self.connected = echo, piece, connected
        self.coming = b""
        self.timeouts = 0
        self._board = RtuSession(VirtualBoard(), self._come)

    def _come(self, data: bytes) -> None:
        self.coming += data

    @property
    def in_waiting(self) -> int:
        return min(self.piece - 1, len(self.coming))

    def read(self, size: int) -> bytes:
        self.timeouts += bool(size and not self.coming)
        data, self.coming = self.coming[:size], self.coming[size:]
        return data

    def write(self, data: bytes) -> int:
        self.coming = data * self.echo
        if self.connected:
            self._board.data_received(data)
        return len(data)

    def close(self) -> None: ...


def link_through(port: Port) -> ModbusLink:
    client = SerialClient("port", timeout=10.0, retries=0)  # nothing here takes time
    client.connect = lambda: True  # type: ignore[method-assign]
    client.socket = port  # type: ignore[assignment]
    return ModbusLink(client, "port", 0.0)


@pytest.mark.parametrize("piece", [1, 2, 7, 300])
@pytest.mark.parametrize("echo", [True, False])
def test_a_line_works_with_and_without_its_echo(echo: bool, piece: int) -> None:
    port = Port(echo, piece)
    board = Board.connect(link_through(port))
    board.enable()
    board.stage_gains(NEW)
    assert (board.status().enabled, board.staged_gains()) == (True, NEW)
    assert not port.timeouts


def test_an_echo_alone_is_no_reply() -> None:
    port = Port(echo=True, piece=300)
    client = SerialClient("port", timeout=0.01, retries=0)
    client.socket = port  # type: ignore[assignment]
    port.connected = False
    client.send(b"\x01\x03\x00\x40\x00\x01\x85\xde")
    assert client.recv(None) == b""
