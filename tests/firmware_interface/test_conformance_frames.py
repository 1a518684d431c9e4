"""Both boards answer every frame alike, whole or broken, known or not, alone or in a burst."""

import time
from collections.abc import Iterator

import pytest
from board_thread import served
from conformance_boards import Served
from raw_cases import CASES
from raw_line import SILENCE_S, Connection, Line, crc16, framed, mbap

from firmware_interface.link import Link
from firmware_interface.modbus_server import RtuSession
from firmware_interface.registers import MAGIC
from firmware_interface.virtual.board import VirtualBoard

READ_MAGIC = framed("01 03 0000 0002")
MAGIC_REPLY = framed(f"01 03 04 {MAGIC:08x}")
WATCHDOG = "01 03 00a0 0002"
UNTOUCHED = "010304" + "03e80001"
HALVE_TIMEOUT = "10 00a0 0001 02 01f4"
TRIES = 5
"""Of what a busy computer may get in the way of: two pieces read as one, or one as two."""


@pytest.mark.parametrize("case", CASES)
def test_a_request_and_its_answer_on_a_serial_line(either_kind: Served, case: str) -> None:
    request, reply = CASES[case]
    with Line(either_kind.url) as line:
        answer = line.ask(f"01 {request}", len(bytes.fromhex(reply)) + 3)
        assert answer == bytes.fromhex(f"01 {reply}").hex()
        assert line.ask(WATCHDOG, 9) == UNTOUCHED


@pytest.fixture(scope="module")
def tcp_url() -> Iterator[str]:
    """A virtual board on TCP for all tests of this file."""
    with served(VirtualBoard(), "tcp") as url:
        yield url


@pytest.mark.parametrize("case", CASES)
def test_a_request_and_its_answer_on_tcp(tcp_url: str, case: str) -> None:
    request, reply = CASES[case]
    with Connection(tcp_url) as connection:
        connection.send(mbap(bytes.fromhex(request)))
        assert connection.reply() == mbap(bytes.fromhex(reply))


OTHER_CODES = sorted(set(range(256)) - {3, 6, 16})
"""0 and those of error replies too."""


def test_every_other_function_is_illegal(either_kind: Served) -> None:
    with Line(either_kind.url) as line:
        for code in OTHER_CODES:
            assert line.ask(f"01 {code:02x}") == f"01{code | 128:02x}01"


def test_every_other_function_is_illegal_on_tcp(tcp_url: str) -> None:
    with Connection(tcp_url) as connection:
        for code in OTHER_CODES:
            connection.send(mbap(bytes([code, 0, 0, 0, 1])))
            assert connection.reply() == mbap(bytes([code | 128, 1]))


# ---- frames that are none, or somebody else's

BROKEN = {
    "wrong CRC": READ_MAGIC[:-1] + bytes([READ_MAGIC[-1] ^ 1]),
    "CRC the wrong way round": READ_MAGIC[:-2] + READ_MAGIC[:-3:-1],
    "cut short": READ_MAGIC[:5],
    "a device number alone": b"\x01",
    "a device number and its CRC": framed("01"),
    "another device": framed("02 03 0000 0002"),
    "the last device": framed("ff 03 0000 0002"),
    "a reserved device": framed("f7 03 0000 0002"),
    "another device's write": framed(f"02 {HALVE_TIMEOUT}"),
    "a broadcast write": framed(f"00 {HALVE_TIMEOUT}"),
    "a broadcast single write": framed("00 06 00a0 01f4"),
    "a broadcast read": framed("00 03 0000 0002"),
    "a write with a wrong CRC": framed(f"01 {HALVE_TIMEOUT}")[:-1] + b"\x00",
    "noise": bytes(range(1, 41)),
    "noise, then a request": b"\x01\x55\xaa" + READ_MAGIC,
    "another device's frame, then a request": framed("02 03 0000 0002") + READ_MAGIC,
    "a broadcast, then a request": framed(f"00 {HALVE_TIMEOUT}") + READ_MAGIC,
    "an unknown function, then a request": framed("01 41") + READ_MAGIC,
    "longer than any frame": b"\x01" * 300,
    "longer than any frame, with a right CRC": framed("01 41" + "00" * 300),
    "a write longer than any frame": framed(f"01 10 0380 007c f8 {'0000' * 124}"),
}


@pytest.mark.parametrize("what", BROKEN)
def test_a_broken_frame_is_neither_answered_nor_in_the_way_of_the_next(
    either_kind: Served, what: str
) -> None:
    with Line(either_kind.url) as line:
        line.send(BROKEN[what])
        assert line.silence() == b""
        line.send(READ_MAGIC)
        assert line.reply(9) == MAGIC_REPLY
        assert line.ask(WATCHDOG, 9) == UNTOUCHED


BURSTS = {
    "two reads": (READ_MAGIC * 2, MAGIC_REPLY),
    "many reads": (READ_MAGIC * 30, MAGIC_REPLY),
    "a read and a write": (READ_MAGIC + framed(f"01 {HALVE_TIMEOUT}"), MAGIC_REPLY),
    "a write and a read": (framed("01 06 00a0 03e8") + READ_MAGIC, framed("01 06 00a0 03e8")),
    "a refused write and a good one": (
        framed("01 06 00a0 0001") + framed(f"01 {HALVE_TIMEOUT}"),
        framed("01 86 03"),
    ),
    "a read and half of one": (READ_MAGIC + READ_MAGIC[:4], MAGIC_REPLY),
    "a read and noise": (READ_MAGIC + bytes(range(40)), MAGIC_REPLY),
    "a read and another device's": (READ_MAGIC + framed("02 03 0000 0002"), MAGIC_REPLY),
}


@pytest.mark.parametrize("what", BURSTS)
def test_of_frames_sent_back_to_back_only_the_first_is_carried_out(
    either_kind: Served, what: str
) -> None:
    burst, reply = BURSTS[what]
    with Line(either_kind.url) as line:
        line.send(burst)
        assert line.reply(len(reply)) + line.silence() == reply
        line.send(READ_MAGIC)
        assert line.reply(9) == MAGIC_REPLY
        assert line.ask(WATCHDOG, 9) == UNTOUCHED


def test_a_silence_ends_a_frame(either_kind: Served) -> None:
    """Two halves with a pause between them are no request."""

    def ignored(line: Line) -> bool:
        line.send(READ_MAGIC[:4])
        time.sleep(SILENCE_S)
        line.send(READ_MAGIC[4:])
        return line.silence() == b""

    with Line(either_kind.url) as line:
        assert any(ignored(line) for _ in range(TRIES))
        line.send(READ_MAGIC)
        assert line.reply(9) == MAGIC_REPLY


def test_a_frame_in_pieces_without_a_silence_is_a_request(either_kind: Served) -> None:
    def answered(line: Line) -> bool:
        for byte in READ_MAGIC:
            line.send(bytes([byte]))
        return line.silence() == MAGIC_REPLY

    with Line(either_kind.url) as line:
        assert any(answered(line) for _ in range(TRIES))


def test_a_frame_byte_by_byte_is_answered_at_its_last_byte() -> None:
    replies: list[bytes] = []
    session = RtuSession(VirtualBoard(), replies.append)
    for byte in READ_MAGIC:
        assert not replies
        session.data_received(bytes([byte]))
    assert replies == [MAGIC_REPLY]


def test_both_checksums_are_modbus_own() -> None:
    """The example of the Modbus serial line guide: 02 07 has the CRC 41 12."""
    assert crc16(b"\x02\x07") == b"\x41\x12"
    echoed: list[bytes] = []
    link: Link = VirtualBoard()
    RtuSession(link, echoed.append).data_received(framed("01 06 00a0 03e8"))
    assert echoed == [framed("01 06 00a0 03e8")]
