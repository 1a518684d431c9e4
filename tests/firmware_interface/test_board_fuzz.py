"""Whatever bytes and requests arrive at the board: it goes on, and nothing happens that may not."""

import asyncio
import math
import struct
from contextlib import suppress

from fuzzed_frames import SOME, bodies, rtu, tcp
from hypothesis import given, settings
from hypothesis import strategies as st
from witness import EffortWatch

from firmware_interface.codec import crc32
from firmware_interface.modbus_server import RtuSession, TcpSession, answer
from firmware_interface.registers import MAP_CRC, REGISTERS, Opcode
from firmware_interface.virtual.board import RequestClock, VirtualBoard
from firmware_interface.virtual.setpoints import TRAJECTORY_ADDRESS, TRAJECTORY_WORDS
from tests.repetitions import examples


class Wire(asyncio.Transport):
    """A TCP connection whose other end reads everything."""

    def __init__(self) -> None:
        super().__init__()
        self.replies: list[bytes] = []
        self.open = True

    def write(self, data: bytes | bytearray | memoryview) -> None:
        self.replies.append(bytes(data))

    def is_closing(self) -> bool:
        return not self.open

    def close(self) -> None:
        self.open = False

    def set_write_buffer_limits(self, high: int | None = None, low: int | None = None) -> None:
        pass

    def pause_reading(self) -> None:
        pass

    def resume_reading(self) -> None:
        pass


def word(number: float) -> bytes:
    """A float of the map, cut to its range; what is no number stays none."""
    with suppress(OverflowError):
        return struct.pack(">f", number)
    return struct.pack(">f", math.copysign(math.inf, number))


hostile = st.one_of(
    st.sampled_from([math.nan, math.inf, -math.inf, 3.4e38, -3.4e38, 1e25, 1e-30, 1e-45, -0.0]),
    st.floats(),
)
writes = st.builds(  # of floats and of anything, whole and wherever they may do harm
    lambda address, data: struct.pack(">BHHB", 16, address, len(data) // 2, len(data)) + data,
    st.sampled_from([0x8E, 0x90, 0x92, 0xA0, 0x100, 0x101, 0x103, 0x112, 0x122, 0x13A, 0x142,
                     0x15A, 0x15C, 0x172, 0x182, 0x380, 0x388, 0x398, 0x3E0]),
    st.one_of(
        st.lists(hostile.map(word), min_size=1, max_size=8).map(b"".join),
        st.integers(1, 8).flatmap(lambda n: st.binary(min_size=2 * n, max_size=2 * n)),
    ),
)  # fmt: skip
GO = object()
"""Instead of a frame: a command of the host that holds the board, with the right checksum."""
KEY = 0x600D
requests = st.one_of(bodies, writes, st.tuples(st.just(GO), st.sampled_from(Opcode)))


def commanded(board: VirtualBoard, opcode: Opcode, token: int) -> bytes:
    """A command as its holder sends it, about what stands in the registers."""
    registers = board._registers
    crc = {
        Opcode.START: MAP_CRC,
        Opcode.ARM: crc32(registers.words(TRAJECTORY_ADDRESS, TRAJECTORY_WORDS)),
        Opcode.COMMIT: crc32(registers.words(REGISTERS["shadow.x.proportional"].address, 96)),
    }.get(opcode, 0)
    if opcode == Opcode.COMMIT:
        registers.put("shadow.crc", crc)
    return struct.pack(">BHHBHHII", 16, 0x80, 6, 12, opcode, token, crc, KEY)


@settings(SOME, max_examples=examples(150))
@given(st.lists(requests, max_size=12), st.booleans())
def test_any_requests_leave_setpoints_and_efforts_numbers_and_gains_whole(
    script: list[object], enabled: bool
) -> None:
    """Hostile numbers, right checksums, a host that holds the board: no effort but what the law
    gives, no gains but those from before or from a commit."""
    board = VirtualBoard()
    effort, banks = EffortWatch(board), board.machine.banks
    accepted, commit = [banks.active], banks.commit
    banks.commit = lambda *given: (commit(*given), accepted.append(banks.active))[0]  # type: ignore[assignment,func-returns-value,method-assign]
    clock = board._clock
    assert isinstance(clock, RequestClock)
    clock.let_pass(board.machine, 25)
    answer(board, struct.pack(">BHHBI", 16, 0x90, 2, 4, KEY))
    for token, request in enumerate([(GO, Opcode.ENABLE)] * enabled + script, start=1):
        if isinstance(request, tuple):
            answer(board, commanded(board, request[1], token))
        elif request:
            answer(board, request)  # type: ignore[arg-type]
        clock.let_pass(board.machine, 45)
        effort.check()
        assert board.machine.banks.active in accepted
        assert board.machine.capture._acknowledged <= board.machine.capture.pages_written


@settings(SOME, max_examples=examples(80))
@given(st.lists(st.one_of(bodies.map(rtu), bodies, st.binary(max_size=300)), max_size=5))
def test_any_bytes_to_the_board_on_a_serial_line(pieces: list[bytes]) -> None:
    """It answers or keeps silent, and after a silence answers a right request."""
    replies = list[bytes]()
    session = RtuSession(VirtualBoard(), replies.append)
    for piece in pieces:
        session.data_received(piece)
    session._last_s = -math.inf
    session.idle()
    replies.clear()
    session.data_received(rtu(bytes([3, 0, 0, 0, 2])))
    assert len(replies) == 1
    assert b"MFDS" in replies[0]


@settings(SOME, max_examples=examples(80))
@given(
    st.lists(st.one_of(bodies.map(lambda body: tcp(body, 7)), st.binary(max_size=300)), max_size=5)
)
def test_any_bytes_to_the_board_on_a_tcp_connection(pieces: list[bytes]) -> None:
    """It answers each request or ends the connection, and the next one is as good as new."""
    board, sessions = VirtualBoard(), set[TcpSession]()

    async def story() -> None:
        for received in (pieces, [tcp(bytes([3, 0, 0, 0, 2]), 7)]):
            session, wire = TcpSession(board, sessions, 2), Wire()
            session.connection_made(wire)
            for piece in received:
                if wire.open:
                    session.data_received(piece)
                    await asyncio.sleep(0)
            while session._scheduled:
                await asyncio.sleep(0)
            session.connection_lost(None)
        assert len(wire.replies) == 1
        assert b"MFDS" in wire.replies[0]

    asyncio.run(story())
    assert not sessions
