"""Modbus RTU and TCP, the server's half: from bytes to a link's registers and back.

Function codes 3, 6 and 16 are carried out; every other one, of all 256, is answered with exception
1. On a serial line a known function tells the length of its frame; any other frame ends with a
silence, and one whose length is not what its function asks for is answered with exception 3. What
arrives before the answer has left is discarded, so that of requests sent in one burst the first is
answered alone. Broadcasts and frames for other devices are ignored. On TCP every request is
answered in its turn, and a header that cannot be ends the connection. Places for TCP clients are
limited, and who comes always gets one: it may be about to stop the machine.
"""

import asyncio
import struct
import time
from collections.abc import Callable
from typing import Final

from firmware_interface import codec, errors, registers
from firmware_interface.link import Link

DEVICE_ID: Final = 1
BOARD_UNITS: Final = frozenset({0, DEVICE_ID, 255})
"""Unit identifiers that mean the board on TCP, where there is nobody else to address."""
FRAME_GAP_S: Final = 0.05
"""Silence that ends a frame; longer than a busy system's pauses within one."""
REQUESTS_AT_ONCE: Final = 2
"""Requests of one TCP client before it is the others' and the machine's turn."""
UNSENT_LIMIT: Final = 4096
"""Bytes of replies that a TCP client may leave unread before it is no longer listened to."""

_READ, _WRITE_ONE, _WRITE = 3, 6, 16
_ILLEGAL_FUNCTION, _ILLEGAL_ADDRESS, _ILLEGAL_VALUE, _BUSY, _NO_SUCH_UNIT = 1, 2, 3, 6, 11
_READ_LIMIT: Final = 125
_WRITE_LIMIT: Final = 123
_LONGEST_FRAME: Final = 256
_CRC_BYTES: Final = 2
_HEADER: Final = struct.Struct(">HHHB")
_LONGEST_BODY: Final = 254  # unit identifier and PDU
_HOLDER: Final = registers.REGISTERS["session.key"]
_KEYS: Final = (_HOLDER, registers.REGISTERS["command.key"])  # where a host writes its key


def answer(link: Link, request: bytes) -> bytes:
    """Carry out a request, function code and data; gives the reply's; empty where none comes."""
    try:
        return _carried_out(link, request)
    except errors.NoReplyError:
        return b""
    except errors.ValueRefusedError:
        return refusal(request, _ILLEGAL_VALUE)
    except errors.BusyError:
        return refusal(request, _BUSY)
    except errors.BoardError:
        return refusal(request, _ILLEGAL_ADDRESS)


def refusal(request: bytes, exception: int) -> bytes:
    """The reply that refuses a request."""
    return bytes([request[0] | 0x80, exception])


def _carried_out(link: Link, request: bytes) -> bytes:
    code, size = request[0], len(request)
    if code not in (_READ, _WRITE_ONE, _WRITE):
        return refusal(request, _ILLEGAL_FUNCTION)
    # function code, address, and a count or a value of two bytes each
    if size < 5 or (code != _WRITE and size > 5):
        return refusal(request, _ILLEGAL_VALUE)
    address, count = struct.unpack(">HH", request[1:5])
    # here the second word is the value, not a count
    if code == _WRITE_ONE:
        link.write(address, [count])
        return request
    if code == _READ:
        if not 1 <= count <= _READ_LIMIT:
            return refusal(request, _ILLEGAL_VALUE)
        data = codec.words_to_bytes(link.read(address, count))
        return bytes([code, len(data)]) + data
    if not 1 <= count <= _WRITE_LIMIT or size != 6 + 2 * count or request[5] != 2 * count:
        return refusal(request, _ILLEGAL_VALUE)
    link.write(address, codec.bytes_to_words(request[6:]))
    return request[:5]


def crc16(data: bytes) -> bytes:
    """CRC-16 of Modbus, as it follows a frame."""
    crc = 0xFFFF
    for byte in data:
        crc = crc >> 8 ^ _CRC_TABLE[(crc ^ byte) & 0xFF]
    # the one number of Modbus that goes low byte first
    return struct.pack("<H", crc)


def _crc_entry(index: int) -> int:
    for _ in range(8):
        # x^16 + x^15 + x^2 + 1 with its bits reversed: the lowest bit is on the line first
        index = index >> 1 ^ (0xA001 if index & 1 else 0)
    return index


_CRC_TABLE: Final = [_crc_entry(index) for index in range(256)]


class RtuSession:
    """The board's end of a serial line.

    Parameters
    ----------
    link : Link
    send : callable
        Takes a reply's frame.
    """

    def __init__(self, link: Link, send: Callable[[bytes], object]) -> None:
        self._link = link
        self._send = send
        self._frame = b""
        self._deaf = False
        """Until the next silence: what comes is too long, or for another device."""
        self._last_s = 0.0

    def data_received(self, data: bytes) -> None:
        """Bytes came; answer the request that they complete."""
        # first: a silence may have ended the frame that these bytes do not belong to
        self.idle()
        self._last_s = time.monotonic()
        if self._deaf:
            return
        self._frame += data
        size = _expected(self._frame)
        if self._frame[:1] != bytes([DEVICE_ID]):
            self._deaf = True
        elif 0 < size <= min(len(self._frame), _LONGEST_FRAME) and _whole(self._frame[:size]):
            request, self._frame = self._frame[1 : size - _CRC_BYTES], b""
            self._reply(answer(self._link, request))
        elif len(self._frame) > _LONGEST_FRAME:
            self._deaf = True

    def idle(self) -> None:
        """See whether a silence has ended a frame; for servers, every few milliseconds."""
        if not (self._frame or self._deaf) or time.monotonic() - self._last_s < FRAME_GAP_S:
            return
        frame, self._frame = self._frame, b""
        deaf, self._deaf = self._deaf, False
        if not deaf and len(frame) > 1 + _CRC_BYTES and _whole(frame):
            request = frame[1:-_CRC_BYTES]
            known = request[0] in (_READ, _WRITE_ONE, _WRITE)
            self._reply(refusal(request, _ILLEGAL_VALUE if known else _ILLEGAL_FUNCTION))

    def _reply(self, reply: bytes) -> None:
        if reply:
            frame = bytes([DEVICE_ID]) + reply
            self._send(frame + crc16(frame))


def _expected(frame: bytes) -> int:
    """Length of the request that begins like this; 0 while, or if, it is not known."""
    if len(frame) < 7:
        return 0
    if frame[1] == _WRITE:
        return 7 + frame[6] + _CRC_BYTES
    return 8 if frame[1] in (_READ, _WRITE_ONE) else 0


def _whole(frame: bytes) -> bool:
    return crc16(frame[:-_CRC_BYTES]) == frame[-_CRC_BYTES:]


class TcpSession(asyncio.Protocol):
    """One client's connection.

    Where all places are taken, the client that has been silent longest gives way to a new one:
    first of those that have never asked anything, never the host that holds the board.

    Parameters
    ----------
    link : Link
    sessions : set of TcpSession
        All that are open; this one enters and leaves it by itself.
    limit : int
        How many there may be, at least two.

    Attributes
    ----------
    heard_s : float
        When the last whole request came, or the connection was made.
    asked : bool
        Whether one ever came.
    key : list of int
        Words of the key that its client has written last.
    """

    def __init__(self, link: Link, sessions: "set[TcpSession]", limit: int) -> None:
        self._link = link
        self._sessions = sessions
        self._limit = limit
        self._transport: asyncio.Transport | None = None
        self._received = bytearray()
        self._blocked = False
        self._scheduled = False
        self.heard_s = time.monotonic()
        self.asked = False
        self.key: list[int] = []

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """A client connected."""
        assert isinstance(transport, asyncio.Transport)
        self._transport = transport
        transport.set_write_buffer_limits(UNSENT_LIMIT)
        if len(self._sessions) >= self._limit:
            self._dispensable().hang_up()
        self._sessions.add(self)

    def _dispensable(self) -> "TcpSession":
        """Who gives way to this one."""
        key = self._link.read(_HOLDER.address, _HOLDER.words)
        of_holder = [session for session in self._sessions if session.key == key]
        holder = max(of_holder, key=lambda session: session.heard_s, default=None)
        # somebody is left: there are at least two places, and one holder
        return min(self._sessions - {holder}, key=lambda session: (session.asked, session.heard_s))

    def connection_lost(self, exc: Exception | None) -> None:
        """It is gone, and what it asked for last with it."""
        self._sessions.discard(self)
        self._transport = None
        self._received.clear()

    def hang_up(self) -> None:
        """End the connection at once; replies that nobody reads are dropped."""
        self._sessions.discard(self)
        if self._transport:
            self._transport.abort()

    def pause_writing(self) -> None:
        """The client does not read its replies: do not listen to it either."""
        self._blocked = True

    def resume_writing(self) -> None:
        """It reads again."""
        self._blocked = False
        self._work()

    def data_received(self, data: bytes) -> None:
        """Answer the requests that these bytes complete."""
        self._received += data
        if not self._scheduled:
            self._work()

    def _work(self) -> None:
        """Answer some requests, in their order; listen on when none is left."""
        self._scheduled = False
        for _ in range(REQUESTS_AT_ONCE):
            if self._blocked or not self._answer_next():
                break
        else:
            self._scheduled = True
            asyncio.get_running_loop().call_soon(self._work)
        if self._transport is None or self._transport.is_closing():
            return
        if self._blocked or self._scheduled:
            self._transport.pause_reading()
        else:
            self._transport.resume_reading()

    def _answer_next(self) -> bool:
        """Answer the first request, if it is whole."""
        transport = self._transport
        if transport is None or transport.is_closing() or len(self._received) < _HEADER.size:
            return False
        transaction, protocol, size, unit = _HEADER.unpack_from(self._received)
        if protocol != 0 or not 2 <= size <= _LONGEST_BODY:
            transport.close()  # nobody can tell where the next request begins
            return False
        # the size counts the unit identifier, which is the header's last byte
        end = _HEADER.size - 1 + size
        if len(self._received) < end:
            return False
        request = bytes(self._received[_HEADER.size : end])
        del self._received[:end]
        self.heard_s, self.asked = time.monotonic(), True
        if unit in BOARD_UNITS:
            reply = answer(self._link, request)
            self.key = _key_written(request, reply) or self.key
        else:
            reply = refusal(request, _NO_SUCH_UNIT)
        if reply:
            transport.write(_HEADER.pack(transaction, 0, len(reply) + 1, unit) + reply)
        return True


def _key_written(request: bytes, reply: bytes) -> list[int]:
    """Words of a host's key, where this request wrote one and was carried out; else none."""
    if request[0] != _WRITE or reply[0] != _WRITE:
        return []
    address, words = int.from_bytes(request[1:3], "big"), codec.bytes_to_words(request[6:])
    starts = [register.address - address for register in _KEYS]
    return next((words[n : n + 2] for n in starts if 0 <= n <= len(words) - 2), [])
