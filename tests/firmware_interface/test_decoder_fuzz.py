"""Whatever bytes arrive at the host: its decoders of frames and pages end in words or in a
LinkError."""

import struct
from contextlib import suppress

import numpy as np
import pytest
from fuzzed_frames import SOME, bodies, rtu, tcp
from hypothesis import example, given, settings
from hypothesis import strategies as st

from firmware_interface import modbus
from firmware_interface.board import Board
from firmware_interface.board_types import NONCE_WORDS
from firmware_interface.capture_pages import read_page
from firmware_interface.codec import RawPage, decode_page, encode_page
from firmware_interface.errors import BoardError, LinkError
from firmware_interface.modbus import ModbusLink, SerialClient
from firmware_interface.registers import MAGIC, PAGE_WORDS
from firmware_interface.virtual.board import VirtualBoard
from tests.repetitions import examples

IDENTITY = struct.pack(f">BB{NONCE_WORDS}H", 3, 2 * NONCE_WORDS, MAGIC >> 16, MAGIC & 0xFFFF,
                       *range(NONCE_WORDS - 2))  # fmt: skip
"""Reply to the first request of a link: the board's identity up to its nonce."""


class Babble:
    """A port on which whatever it is told to arrives, in pieces, and then nothing."""

    def __init__(self) -> None:
        self.pieces: list[bytes] = []

    in_waiting = 0

    def read(self, size: int) -> bytes:
        return self.pieces.pop(0) if size and self.pieces else b""

    def recv(self, size: int | None) -> bytes:
        return self.read(1)

    def write(self, data: bytes) -> int:
        return len(data)

    def close(self) -> None:
        self.pieces = []


def serial_link() -> tuple[ModbusLink, Babble]:
    """A link on a serial line that answered its first request."""
    port = Babble()
    client = SerialClient("babble", timeout=0.01, retries=0)
    client.connect = lambda: True  # type: ignore[method-assign]
    client.socket = port  # type: ignore[assignment]
    port.pieces = [rtu(IDENTITY)]
    return ModbusLink(client, "babble", 0.0), port


def tcp_link() -> tuple[ModbusLink, Babble]:
    """A link on a TCP connection that answered its first request."""
    port = Babble()
    client = modbus.ModbusTcpClient("127.0.0.1", timeout=0.01, retries=0)
    client.connect = lambda: True  # type: ignore[method-assign]
    client.close = lambda: None  # type: ignore[method-assign]
    client.transaction.low_level_send = lambda request, addr=None: len(request)
    client.recv = port.recv  # type: ignore[method-assign]
    port.pieces = [tcp(IDENTITY, 1)]
    return ModbusLink(client, "babble", 0.0), port


def ask(link: ModbusLink, refused: bool) -> None:
    """Read and write once; only a whole, valid exception reply may be a BoardError."""
    allowed = (LinkError, BoardError) if refused else (LinkError,)
    with suppress(*allowed):
        words = link.read(0x40, 18)
        assert len(words) == 18
        assert all(0 <= word <= 0xFFFF for word in words)
    with suppress(*allowed):
        link.write(0x80, [1, 2, 3, 4])


@SOME
@given(st.lists(st.binary(max_size=60), max_size=6))
def test_any_bytes_on_a_serial_line(pieces: list[bytes]) -> None:
    link, port = serial_link()
    port.pieces = pieces
    ask(link, refused=False)


@SOME
@given(bodies, bodies, st.sampled_from([0, 1, 2, 255]))
@example(b"\x03\x05abcde", b"", 1)
@example(b"\x83", b"\x90", 1)
def test_frames_with_a_right_crc_on_a_serial_line(first: bytes, second: bytes, device: int) -> None:
    link, port = serial_link()
    port.pieces = [rtu(first, device), rtu(second)]
    ask(link, refused=True)


@SOME
@given(bodies, st.integers(0, 5), st.integers(0, 255))
def test_a_damaged_frame_on_a_serial_line(body: bytes, cut: int, flip: int) -> None:
    link, port = serial_link()
    frame = bytearray(rtu(body))
    frame[flip % len(frame)] ^= 1 << flip % 8
    port.pieces = [bytes(frame[cut:])]
    ask(link, refused=False)


@SOME
@given(st.one_of(bodies, st.binary(max_size=300)), st.booleans(), st.integers(1, 3))
def test_any_bytes_on_a_tcp_connection(body: bytes, framed: bool, transaction: int) -> None:
    link, port = tcp_link()
    port.pieces = [tcp(body, transaction) if framed else body]
    ask(link, refused=True)


class PageLink:
    """A link to a virtual board on which a capture page arrives as given."""

    def __init__(self) -> None:
        self.board = VirtualBoard()
        self.page: list[int] | None = None
        self.close = self.board.close
        self.write = self.board.write

    def read(self, address: int, count: int) -> list[int]:
        if count == PAGE_WORDS and self.page is not None:
            return self.page
        return self.board.read(address, count)


PAGES = PageLink()
BOARD = Board.connect(PAGES)


def a_page(index: int, first: int, samples: int) -> list[int]:
    """Words of a page that is whole."""
    column = np.arange(2 * samples).reshape(samples, 2)
    return encode_page(RawPage(index, first, column, column, column))


@settings(SOME, max_examples=examples(50))
@given(st.lists(st.integers(0, 0xFFFF), min_size=PAGE_WORDS, max_size=PAGE_WORDS))
@example([0] * PAGE_WORDS)
@example([0xFFFF] * PAGE_WORDS)
def test_any_words_as_a_capture_page(words: list[int]) -> None:
    PAGES.page = words
    with pytest.raises(LinkError, match="page 0 is lost"):
        read_page(BOARD._session, BOARD.identity, 0)


@SOME
@given(st.integers(0, PAGE_WORDS - 1), st.integers(1, 0xFFFF))
def test_a_page_with_any_word_changed(word: int, change: int) -> None:
    PAGES.page = a_page(3, 42, 14)
    PAGES.page[word] ^= change
    with pytest.raises(LinkError, match="page 3 is lost"):
        read_page(BOARD._session, BOARD.identity, 3)


@SOME
@given(st.integers(0, 2**32 - 1), st.integers(0, 2**32 - 1), st.integers(1, 14))
def test_a_whole_page_is_taken_only_where_it_belongs(index: int, first: int, samples: int) -> None:
    PAGES.page = a_page(index, first, samples)
    if (index, first) != (3, 42):
        with pytest.raises(LinkError, match="page 3 is lost"):
            read_page(BOARD._session, BOARD.identity, 3)
    PAGES.page = a_page(3, 42, samples)
    assert read_page(BOARD._session, BOARD.identity, 3).position_rad.shape == (samples, 2)


@SOME
@given(st.lists(st.integers(0, 0xFFFF), max_size=125))
def test_a_page_of_another_length_is_none(words: list[int]) -> None:
    if len(words) != PAGE_WORDS:
        with pytest.raises(ValueError, match="capture page"):
            decode_page(words)
