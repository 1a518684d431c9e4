"""Who gets a place at a TCP board: a stop always, and nobody takes that of the host that moves."""

import asyncio
import threading
from collections.abc import Callable, Coroutine, Iterator
from contextlib import contextmanager, suppress
from typing import Any

import pytest
from board_bench import long_motion
from board_thread import served
from raw_line import mbap

from edge_ident.commissioning.safety import stop_machine
from firmware_interface.board import Board
from firmware_interface.connection import open_link
from firmware_interface.errors import StoppedError
from firmware_interface.registers import REGISTERS, State
from firmware_interface.virtual import server
from firmware_interface.virtual.board import VirtualBoard, WallClock

READ_MAGIC = mbap(bytes([3, 0, 0, 0, 2]))
REPLY_BYTES = 13
WAIT_S = 10.0
"""For a reply, however busy the computer is: only who is hung up on connects again."""
PLACES = 4
PLACES_IN_ALL = server.CONNECTION_LIMIT

Streams = tuple[asyncio.StreamReader, asyncio.StreamWriter]
Client = Callable[[int], Coroutine[Any, Any, None]]


def on_few_places(
    monkeypatch: pytest.MonkeyPatch, story: Callable[[int], Coroutine[Any, Any, None]]
) -> None:
    """Serve a board with PLACES places while the story goes on."""
    monkeypatch.setattr(server, "CONNECTION_LIMIT", PLACES)

    async def told() -> None:
        board = VirtualBoard()
        ready = asyncio.get_running_loop().create_future()
        task = asyncio.create_task(server.serve_tcp(board, 0, board.idle, ready.set_result))
        try:
            await story(int((await ready).rpartition(":")[2]))
        finally:
            task.cancel()
            await asyncio.gather(task, return_exceptions=True)

    asyncio.run(told())


async def connect(port: int) -> Streams:
    return await asyncio.open_connection(server.LOOPBACK, port)


async def ask(client: Streams, request: bytes = READ_MAGIC, size: int = REPLY_BYTES) -> bool:
    """Whether a request is answered, or the board has hung up."""
    with suppress(ConnectionError, asyncio.IncompleteReadError):
        client[1].write(request)
        return bool(await client[0].readexactly(size))
    return False


async def asked(port: int) -> Streams:
    """A client that has asked once."""
    client = await connect(port)
    assert await ask(client)
    return client


async def holding(port: int) -> Streams:
    """A client that holds the board."""
    client, key = await connect(port), REGISTERS["session.key"].address
    write = bytes([16]) + key.to_bytes(2, "big") + bytes([0, 2, 4, 0, 1, 0, 7])
    assert await ask(client, mbap(write), 12)
    return client


def test_the_client_that_was_silent_longest_gives_way(monkeypatch: pytest.MonkeyPatch) -> None:
    async def story(port: int) -> None:
        clients = [await asked(port) for _ in range(PLACES)]
        assert await ask(clients[0])
        newest = await asked(port)
        assert [await ask(client) for client in clients] == [True, False, True, True]
        assert await ask(newest)

    on_few_places(monkeypatch, story)


def test_who_never_asked_gives_way_first(monkeypatch: pytest.MonkeyPatch) -> None:
    """However many knock, whoever has asked once keeps a place."""

    async def story(port: int) -> None:
        clients = [await asked(port) for _ in range(PLACES - 1)]
        knocking = [await connect(port) for _ in range(5 * PLACES)]
        assert all([await ask(client) for client in clients])
        assert await ask(knocking[-1])

    on_few_places(monkeypatch, story)


def test_the_host_that_holds_the_board_never_gives_way(monkeypatch: pytest.MonkeyPatch) -> None:
    async def story(port: int) -> None:
        holder = await holding(port)
        others = [await asked(port) for _ in range(5 * PLACES)]
        assert await ask(holder)
        assert not await ask(others[0])

    on_few_places(monkeypatch, story)


def test_a_key_that_holds_nothing_keeps_no_place(monkeypatch: pytest.MonkeyPatch) -> None:
    async def story(port: int) -> None:
        former = await holding(port)
        for _ in range(100):  # board time passes, until it is sure that the axes stand
            assert await ask(former)
        release = REGISTERS["session.release"].address
        write = bytes([16]) + release.to_bytes(2, "big") + bytes([0, 2, 4, 0, 1, 0, 7])
        assert await ask(former, mbap(write), 12)
        others = [await asked(port) for _ in range(PLACES)]
        assert not await ask(former)
        assert await ask(others[0])

    on_few_places(monkeypatch, story)


async def idle(port: int) -> None:
    reader, writer = await connect(port)
    await reader.read()
    writer.close()


async def asking(port: int) -> None:
    """Asks and asks, and comes back where it is hung up on."""
    while True:
        with suppress(OSError):
            client = await connect(port)
            while await ask(client):
                pass
            client[1].close()


async def knocking(port: int) -> None:
    """Asks nothing, and comes back."""
    while True:
        with suppress(OSError):
            await idle(port)


@contextmanager
def crowd(count: int, client: Client, port: int) -> Iterator[None]:
    """So many clients of a kind, in a thread of their own."""
    ended, begun = threading.Event(), threading.Event()

    async def together() -> None:
        tasks = [asyncio.create_task(client(port)) for _ in range(count)]
        while not ended.is_set():
            await asyncio.sleep(0.05)
            begun.set()
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)

    thread = threading.Thread(target=lambda: asyncio.run(together()))
    thread.start()
    try:
        begun.wait()
        yield
    finally:
        ended.set()
        thread.join()


@pytest.mark.parametrize(
    ("count", "client"),
    [(8, idle), (8, asking), (50, asking), (PLACES_IN_ALL, idle), (50, knocking)],
)
def test_a_crowd_shuts_out_no_stop_and_takes_no_host_its_place(count: int, client: Client) -> None:
    board = VirtualBoard(clock=WallClock(1.0))
    with served(board, "tcp") as url:
        link = open_link(url, timeout_s=WAIT_S)
        host = Board.connect(link)
        host.write_register("watchdog.timeout", 5.0)
        host.enable()
        host.write_trajectory(long_motion())
        host.arm()
        host.start()
        socket = link._client.socket  # type: ignore[attr-defined]
        with crowd(count, client, int(url.rpartition(":")[2])):
            for _ in range(10):
                host.heartbeat()
            assert link._client.socket is socket  # type: ignore[attr-defined] # never hung up on
            assert board.machine.state is State.MOVING
            status = stop_machine(url, 115200, lambda text: None)
            assert (status.at_rest, status.enabled) == (True, False)
        with pytest.raises(StoppedError):
            host.heartbeat()
        host.close()
