"""What TCP clients may cost the board: a few connections, for a while, a few kilobytes each."""

import asyncio
import logging
import os
import resource
import struct
from collections.abc import Callable, Coroutine
from typing import Any

import pytest
from raw_line import mbap

from firmware_interface.modbus_server import REQUESTS_AT_ONCE, UNSENT_LIMIT, TcpSession
from firmware_interface.registers import MAGIC, PAGE_ADDRESS
from firmware_interface.virtual import server
from firmware_interface.virtual.board import VirtualBoard

READ_MAGIC = bytes([3, 0, 0, 0, 2])
MAGIC_REPLY = bytes([3, 4]) + MAGIC.to_bytes(4, "big")
HALVE_TIMEOUT = bytes.fromhex("06 00a0 01f4")
MUCH = bytes([3]) + struct.pack(">HH", PAGE_ADDRESS, 125)
WAIT_S = 30.0

Streams = tuple[asyncio.StreamReader, asyncio.StreamWriter]
Story = Callable[[int, VirtualBoard], Coroutine[Any, Any, None]]


def on_a_served_board(story: Story) -> None:
    """Serve a board on a port while the story goes on."""

    async def told() -> None:
        board = VirtualBoard()
        ready = asyncio.get_running_loop().create_future()
        task = asyncio.create_task(server.serve_tcp(board, 0, board.idle, ready.set_result))
        try:
            await story(int((await ready).rpartition(":")[2]), board)
        finally:
            task.cancel()
            await asyncio.gather(task, return_exceptions=True)

    asyncio.run(told())


async def connect(port: int) -> Streams:
    return await asyncio.open_connection(server.LOOPBACK, port)


async def reply(reader: asyncio.StreamReader) -> bytes:
    """The next whole one; nothing once the board has hung up."""
    try:
        async with asyncio.timeout(WAIT_S):
            head = await reader.readexactly(6)
            return head + await reader.readexactly(int.from_bytes(head[4:], "big"))
    except (asyncio.IncompleteReadError, ConnectionResetError):
        return b""


async def answers(streams: Streams) -> bool:
    streams[1].write(mbap(READ_MAGIC))
    return await reply(streams[0]) == mbap(MAGIC_REPLY)


def test_every_request_of_a_burst_is_answered_in_its_turn() -> None:
    count = 5 * REQUESTS_AT_ONCE

    async def story(port: int, board: VirtualBoard) -> None:
        reader, writer = await connect(port)
        requests = [READ_MAGIC, HALVE_TIMEOUT, b"\x41"] * (count // 3)
        wanted = [MAGIC_REPLY, HALVE_TIMEOUT, b"\xc1\x01"] * (count // 3)
        writer.write(b"".join(mbap(body, 1, n) for n, body in enumerate(requests)))
        for n, body in enumerate(wanted):
            assert await reply(reader) == mbap(body, 1, n)

    on_a_served_board(story)


def test_a_request_in_pieces_is_one_request() -> None:
    async def story(port: int, board: VirtualBoard) -> None:
        reader, writer = await connect(port)
        for byte in mbap(READ_MAGIC):
            writer.write(bytes([byte]))
            await asyncio.sleep(0.001)
        assert await reply(reader) == mbap(MAGIC_REPLY)

    on_a_served_board(story)


@pytest.mark.parametrize(("unit", "known"), [(0, True), (1, True), (255, True), (2, False)])
def test_units_0_and_255_are_the_board_itself(unit: int, known: bool) -> None:
    async def story(port: int, board: VirtualBoard) -> None:
        reader, writer = await connect(port)
        writer.write(mbap(READ_MAGIC, unit))
        assert await reply(reader) == mbap(MAGIC_REPLY if known else b"\x83\x0b", unit)

    on_a_served_board(story)


WRONG_HEADERS = {
    "another protocol": struct.pack(">HHHB", 7, 1, 4, 1),
    "no unit": struct.pack(">HHHB", 7, 0, 0, 1),
    "no function": struct.pack(">HHHB", 7, 0, 1, 1),
    "longer than any": struct.pack(">HHHB", 7, 0, 255, 1),
    "as long as can be said": struct.pack(">HHHB", 7, 0, 0xFFFF, 1),
    "a serial frame": bytes.fromhex("01 06 00a0 01f4 8828"),
}


@pytest.mark.parametrize("what", WRONG_HEADERS)
def test_a_wrong_header_ends_the_connection_and_nothing_is_written(what: str) -> None:
    """What came whole before it is answered; what follows cannot be told apart."""

    async def story(port: int, board: VirtualBoard) -> None:
        reader, writer = await connect(port)
        writer.write(mbap(READ_MAGIC) + WRONG_HEADERS[what] + HALVE_TIMEOUT + mbap(HALVE_TIMEOUT))
        assert await reply(reader) == mbap(MAGIC_REPLY)
        assert await reply(reader) == b""
        assert board.read(0xA0, 1) == [1000]
        assert await answers(await connect(port))

    on_a_served_board(story)


def test_a_header_too_short_for_its_request_ends_the_connection_too() -> None:
    """The rest of the request is no header."""

    async def story(port: int, board: VirtualBoard) -> None:
        reader, writer = await connect(port)
        writer.write(struct.pack(">HHHB", 7, 0, 4, 1) + HALVE_TIMEOUT + b"\xff" * 8)
        assert await reply(reader) == mbap(b"\x86\x03")
        assert await reply(reader) == b""
        assert board.read(0xA0, 1) == [1000]

    on_a_served_board(story)


def test_a_client_that_asks_nothing_is_hung_up_on(monkeypatch: pytest.MonkeyPatch) -> None:
    """Half a request is nothing."""

    async def story(port: int, board: VirtualBoard) -> None:
        silent, slow = await connect(port), await connect(port)
        slow[1].write(mbap(READ_MAGIC)[:5])
        monkeypatch.setattr(server, "IDLE_TIMEOUT_S", 0.2)
        assert await reply(silent[0]) == b""
        assert await reply(slow[0]) == b""
        assert await answers(await connect(port))

    on_a_served_board(story)


def test_a_client_that_never_reads_is_not_listened_to() -> None:
    """Its requests wait where they are; what it costs stays bounded, and others are served."""

    async def story(port: int, board: VirtualBoard) -> None:
        loop = asyncio.get_running_loop()
        _, writer = await connect(port)
        writer.transport.pause_reading()  # type: ignore[attr-defined]
        served = 0
        read = board.read

        def counted(address: int, count: int) -> list[int]:
            nonlocal served
            served += 1
            return read(address, count)

        board.read = counted  # type: ignore[method-assign]
        writer.write(mbap(MUCH) * 200_000)  # 2.4 MB, and replies of 52 MB
        before = -1
        while served != before:  # until nothing more goes on
            before = served
            other = await connect(port)
            assert await answers(other)
            served -= 1
            other[1].close()
            await asyncio.sleep(0.3)
        assert served < 60_000
        sessions = [t for t in _sessions(loop) if t._blocked]
        assert len(sessions) == 1
        session = sessions[0]
        assert session._transport is not None
        assert session._transport.get_write_buffer_size() <= UNSENT_LIMIT + 260
        assert len(session._received) <= 512 * 1024
        writer.transport.abort()

    on_a_served_board(story)


def _sessions(loop: asyncio.AbstractEventLoop) -> list[TcpSession]:
    """The board's ends of all connections."""
    transports = list(loop._transports.values())  # type: ignore[attr-defined]
    protocols = [transport.get_protocol() for transport in transports]
    return [protocol for protocol in protocols if isinstance(protocol, TcpSession)]


def test_a_client_that_reads_late_gets_everything() -> None:
    async def story(port: int, board: VirtualBoard) -> None:
        reader, writer = await connect(port)
        writer.transport.pause_reading()  # type: ignore[attr-defined]
        writer.write(b"".join(mbap(MUCH, 1, n) for n in range(3000)))
        await asyncio.sleep(0.3)
        writer.transport.resume_reading()  # type: ignore[attr-defined]
        for n in range(3000):
            assert int.from_bytes((await reply(reader))[:2], "big") == n

    on_a_served_board(story)


def test_that_no_connection_can_be_accepted_is_said_once(caplog: pytest.LogCaptureFixture) -> None:
    """Out of file descriptors, the event loop by itself says so every second."""
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)

    async def story(port: int, board: VirtualBoard) -> None:
        kept = await connect(port)
        assert await answers(kept)
        lowest = os.dup(0)
        os.close(lowest)
        knocking = asyncio.get_running_loop()
        resource.setrlimit(resource.RLIMIT_NOFILE, (lowest + 1, hard))
        client = asyncio.create_task(connect(port))  # takes the last one
        await asyncio.sleep(2.5)
        assert await answers(kept)
        resource.setrlimit(resource.RLIMIT_NOFILE, (soft, hard))
        assert knocking.is_running()
        assert await answers(await client)

    with caplog.at_level(logging.WARNING):
        try:
            on_a_served_board(story)
        finally:
            resource.setrlimit(resource.RLIMIT_NOFILE, (soft, hard))
    said = [record for record in caplog.records if "accept" in record.getMessage()]
    assert len(said) == 1
