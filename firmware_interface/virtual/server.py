"""Puts a virtual board behind a pseudo-terminal or a TCP port."""

import asyncio
import logging
import os
import select
import signal
import time
import tty
from collections.abc import Callable, Coroutine, Sequence
from contextlib import suppress
from typing import Any, Final

from firmware_interface.errors import LinkError
from firmware_interface.link import Link
from firmware_interface.modbus_server import RtuSession, TcpSession
from firmware_interface.plant.plant import Plant
from firmware_interface.virtual.clock import RequestClock, WallClock
from firmware_interface.virtual.failures import FailingBoard, Failure
from firmware_interface.virtual.identification import Identifier
from firmware_interface.virtual.settings import BoardSettings

LOOPBACK: Final = "127.0.0.1"
"""Reached from this host alone."""
CONNECTION_LIMIT: Final = 64
"""TCP clients at one time. Each costs a few kilobytes; that many leave a new one the time to ask,
and to ask again, before as many others have come."""
IDLE_TIMEOUT_S: Final = 120.0
"""Time after which a TCP client that asks nothing is hung up on."""
_IDLE_S: Final = 0.005
_LOG: Final = logging.getLogger(__name__)


def serve(
    *,
    on_ready: Callable[[str], None],
    pty: bool = False,
    tcp_port: int | None = None,
    bind: str = LOOPBACK,
    speed: float | None = 1.0,
    settings: BoardSettings | None = None,
    plant: Plant | None = None,
    identifier: Identifier | None = None,
    failures: Sequence[Failure] = (),
    on_failure: Callable[[str], object] = _LOG.warning,
) -> None:
    """Serve a new board until Ctrl-C or SIGTERM; SIGUSR1 pulls its wired stop, SIGUSR2 releases it.

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
    plant : Plant, optional
        The drive behind the board; by default a sound one.
    identifier : Identifier, optional
        The board's own network, loaded; by default it has none.
    failures : sequence of Failure
        What fails, each at its time.
    on_failure : callable
        Gets a line when one begins or ends.

    Raises
    ------
    LinkError
        The port is in use.
    """
    if pty == (tcp_port is not None):
        raise ValueError("choose one of pty and tcp_port")
    clock = RequestClock() if speed is None else WallClock(speed)
    board = FailingBoard(failures, settings, clock, plant, identifier, on_failure)
    if tcp_port is None:
        serving = serve_pty(board, board.idle, on_ready)
    else:
        serving = serve_tcp(board, tcp_port, board.idle, on_ready, bind)
    # the loop would take the two in any order, and so release before it pulls
    signal.signal(signal.SIGUSR1, lambda *_: board.inputs.press_stop())
    signal.signal(signal.SIGUSR2, lambda *_: board.inputs.release_stop())
    with suppress(KeyboardInterrupt, asyncio.CancelledError):
        asyncio.run(_until_terminated(serving))


async def _until_terminated(serving: Coroutine[None, None, None]) -> None:
    loop, task = asyncio.get_running_loop(), asyncio.ensure_future(serving)
    loop.add_signal_handler(signal.SIGTERM, task.cancel)
    await task


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
    loop.set_exception_handler(_AcceptErrors())
    sessions: set[TcpSession] = set()

    def look_after() -> None:
        idle()
        quiet_since_s = time.monotonic() - IDLE_TIMEOUT_S
        for session in [session for session in sessions if session.heard_s < quiet_since_s]:
            session.hang_up()

    try:
        server = await loop.create_server(
            lambda: TcpSession(link, sessions, CONNECTION_LIMIT), bind, port
        )
    except OSError as error:
        raise LinkError(
            f"port {port} on {bind} cannot be served: {error.strerror}",
            "choose another port or address, or stop the program that uses it",
        ) from error
    try:
        on_ready(f"tcp://{bind}:{server.sockets[0].getsockname()[1]}")
        await _forever(look_after)
    finally:
        server.close()
        for session in list(sessions):
            session.hang_up()


class _AcceptErrors:
    """Says once that connections cannot be accepted: the loop says so every second."""

    def __init__(self) -> None:
        self._said = False

    def __call__(self, loop: asyncio.AbstractEventLoop, context: dict[str, Any]) -> None:
        if not isinstance(context.get("exception"), OSError) or "accept" not in context["message"]:
            loop.default_exception_handler(context)
        elif not self._said:
            self._said = True
            _LOG.warning("no further connection can be accepted: %s", context["exception"])


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
        session = RtuSession(link, lambda frame: _write_pty(master, slave, frame))
        loop.add_reader(master, lambda: session.data_received(_read_pty(master)))
        on_ready(os.ttyname(slave))

        def look_after() -> None:
            session.idle()
            idle()

        await _forever(look_after)
    finally:
        loop.remove_reader(master)
        os.close(master)
        os.close(slave)


def _read_pty(master: int) -> bytes:
    with suppress(BlockingIOError):
        return os.read(master, 4096)
    return b""


def _write_pty(master: int, slave: int, frame: bytes) -> None:
    while _read_pty(master):  # what came before the answer left
        pass
    with suppress(BlockingIOError):  # nobody reads: the bytes are lost, as on a real line
        os.write(master, frame)
    # a thread of the kernel moves them, which a busy computer lets wait for seconds, and the host
    # with it: so does the board, to look at the other end waits for that thread
    select.select([slave], [], [], 0.0)


async def _forever(look_after: Callable[[], None]) -> None:
    while True:
        look_after()
        await asyncio.sleep(_IDLE_S)
