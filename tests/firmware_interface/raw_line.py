"""A serial line or a TCP connection to a board, byte by byte."""

import os
import select
import socket
import struct
import time

_WAIT_S = 60.0
"""For what is sure to come: no test fails because the computer is busy."""
SILENCE_S = 0.15
"""Longer than both boards take to see the end of a frame on a pseudo-terminal."""


def crc16(data: bytes) -> bytes:
    """CRC-16 of Modbus, as it follows the frame."""
    crc = 0xFFFF
    for byte in data:
        crc ^= byte
        for _ in range(8):
            crc = crc >> 1 ^ (0xA001 if crc & 1 else 0)
    return struct.pack("<H", crc)


def framed(body: str) -> bytes:
    """A frame out of hexadecimal digits, with its CRC."""
    data = bytes.fromhex(body)
    return data + crc16(data)


class Line:
    """The host's end of a serial line, byte by byte."""

    def __init__(self, url: str) -> None:
        self._file = os.open(url, os.O_RDWR | os.O_NOCTTY)

    def __enter__(self) -> "Line":
        return self

    def __exit__(self, *_: object) -> None:
        os.close(self._file)

    def send(self, data: bytes) -> None:
        """Put bytes on the line."""
        os.write(self._file, data)

    def reply(self, count: int) -> bytes:
        """So many bytes of a reply that is sure to come."""
        found = b""
        while len(found) < count:
            assert select.select([self._file], [], [], _WAIT_S)[0], found.hex()
            found += os.read(self._file, 512)
        return found

    def silence(self) -> bytes:
        """What comes in a time in which nothing should."""
        time.sleep(SILENCE_S)
        found = b""
        while select.select([self._file], [], [], 0.0)[0]:
            found += os.read(self._file, 512)
        return found

    def ask(self, body: str, count: int = 5) -> str:
        """Send a whole request; gives the reply in hexadecimal digits, without its CRC."""
        self.send(framed(body))
        reply = self.reply(count)
        assert crc16(reply[:-2]) == reply[-2:]
        return reply[:-2].hex()


class Connection:
    """A TCP client that writes and reads bytes."""

    def __init__(self, url: str) -> None:
        host, _, port = url.removeprefix("tcp://").rpartition(":")
        self._socket = socket.create_connection((host, int(port)), timeout=_WAIT_S)

    def __enter__(self) -> "Connection":
        return self

    def __exit__(self, *_: object) -> None:
        self._socket.close()

    def send(self, data: bytes) -> None:
        """Put bytes on the wire."""
        self._socket.sendall(data)

    def reply(self) -> bytes:
        """The next whole reply, with its header; nothing once the board has hung up."""
        found = self._exactly(6)
        return found + self._exactly(struct.unpack(">H", found[4:])[0]) if found else b""

    def _exactly(self, count: int) -> bytes:
        found = b""
        while len(found) < count:
            try:
                more = self._socket.recv(count - len(found))
            except ConnectionResetError:
                more = b""
            if not more:
                assert not found, found.hex()
                return b""
            found += more
        return found


def mbap(body: bytes, unit: int = 1, transaction: int = 7) -> bytes:
    """A request on TCP: function code and data behind their header."""
    return struct.pack(">HHHB", transaction, 0, len(body) + 1, unit) + body
