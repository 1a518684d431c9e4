"""Puts a virtual board behind a pseudo-terminal or a TCP port."""

import asyncio
import os
import tty
from collections.abc import Callable
from contextlib import suppress
from typing import Final

from firmware_interface.errors import LinkError
from firmware_interface.link import Link
from firmware_interface.modbus import ServerSession
from firmware_interface.virtual.board import VirtualBoard
from firmware_interface.virtual.clock import RequestClock, WallClock
from firmware_interface.virtual.settings import BoardSettings

LOOPBACK: Final = "127.0.0.1"
"""Reached from this host alone."""
_IDLE_S: Final = 0.005


def serve(
    *,
    on_ready: Callable[[str], None],
    pty: bool = False,
    tcp_port: int | None = None,
    bind: str = LOOPBACK,
    speed: float | None = 1.0,
    settings: BoardSettings | None = None,
) -> None:
    """Serve a new board until Ctrl-C.

    Parameters
    ----------
    on_ready : callable
        Gets the device URL once a client can connect.
    pty : bool
        Serve Modbus RTU on a new pseudo-terminal; this or `tcp_port`.
    tcp_port : int, optional
        Serve Modbus TCP on this port; 0 takes a free one.
    bind : str
        Address of this host that a TCP port is bound to. Modbus has no authentication: whoever
        reaches the port commands the board.
    speed : float or None
        Board time per wall time; None lets every request advance it, as fast as it can.
    settings : BoardSettings, optional

    Raises
    ------
    LinkError
        The port is in use.
    """
    if pty == (tcp_port is not None):
        raise ValueError("choose one of pty and tcp_port")
    board = VirtualBoard(settings, RequestClock() if speed is None else WallClock(speed))
    if tcp_port is None:
        serving = serve_pty(board, board.idle, on_ready)
    else:
        serving = serve_tcp(board, tcp_port, board.idle, on_ready, bind)
    try:
        asyncio.run(serving)
    except KeyboardInterrupt:
        return


async def serve_tcp(
    link: Link,
    port: int,
    idle: Callable[[], None],
    on_ready: Callable[[str], None],
    bind: str = LOOPBACK,
) -> None:
    """Serve a link's registers as Modbus TCP until cancelled.

    Parameters
    ----------
    link : Link
    port : int
        0 takes a free one.
    idle : callable
        Called every few milliseconds.
    on_ready : callable
        Gets the device URL.
    bind : str
        Address of this host.

    Raises
    ------
    LinkError
        The address or port is in use, not allowed or not this host's.
    """
    loop = asyncio.get_running_loop()
    try:
        server = await loop.create_server(lambda: ServerSession(link), bind, port)
    except OSError as error:
        raise LinkError(
            f"port {port} on {bind} cannot be served: {error.strerror}",
            "choose another port or address, or stop the program that uses it",
        ) from error
    async with server:
        on_ready(f"tcp://{bind}:{server.sockets[0].getsockname()[1]}")
        await _idle_forever(idle)


async def serve_pty(link: Link, idle: Callable[[], None], on_ready: Callable[[str], None]) -> None:
    """Serve a link's registers as Modbus RTU on a new pseudo-terminal until cancelled.

    Parameters are those of `serve_tcp`.
    """
    loop = asyncio.get_running_loop()
    # the board's own hold on the client's side keeps the line up between clients
    master, slave = os.openpty()
    try:
        tty.setraw(slave)
        os.set_blocking(master, False)
        session = ServerSession(link, lambda frame: _write_pty(master, frame))
        loop.add_reader(master, lambda: session.data_received(os.read(master, 4096)))
        on_ready(os.ttyname(slave))
        await _idle_forever(idle)
    finally:
        loop.remove_reader(master)
        os.close(master)
        os.close(slave)


def _write_pty(master: int, frame: bytes) -> None:
    with suppress(BlockingIOError):  # nobody reads: the bytes are lost, as on a real line
        os.write(master, frame)


async def _idle_forever(idle: Callable[[], None]) -> None:
    while True:
        idle()
        await asyncio.sleep(_IDLE_S)
