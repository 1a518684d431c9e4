"""A server whose replies are nonsense: requests end in an error with a next step, and soon."""

import socket
import struct
import threading
from collections.abc import Iterator
from contextlib import contextmanager

import pytest

from firmware_interface.board_types import NONCE_WORDS
from firmware_interface.connection import open_link
from firmware_interface.errors import EdgeIdentError
from firmware_interface.registers import MAGIC, REGISTERS

IDENTITY = [MAGIC >> 16, MAGIC & 0xFFFF, *[0] * (NONCE_WORDS - 3), 7]
STATUS = REGISTERS["status.state"].address


@contextmanager
def answering(body: bytes, stated_length: int | None = None) -> Iterator[str]:
    """Modbus TCP: the identity is read in order, every other request gets this body."""

    def frame(request: bytes, reply: bytes, length: int | None) -> bytes:
        stated = len(reply) if length is None else length
        return request[:4] + struct.pack(">H", stated) + reply

    def converse(connection: socket.socket) -> None:
        with connection:
            while request := connection.recv(300):
                if request[8:12] == struct.pack(">HH", 0, NONCE_WORDS):
                    words = struct.pack(f">{NONCE_WORDS}H", *IDENTITY)
                    connection.sendall(frame(request, bytes([1, 3, len(words)]) + words, None))
                else:
                    connection.sendall(frame(request, body, stated_length))

    def accept() -> None:
        while True:
            try:
                connection, _ = server.accept()
            except OSError:
                return
            threading.Thread(target=converse, args=(connection,), daemon=True).start()

    with socket.create_server(("127.0.0.1", 0)) as server:
        thread = threading.Thread(target=accept)
        thread.start()
        yield f"tcp://127.0.0.1:{server.getsockname()[1]}"
        server.shutdown(socket.SHUT_RDWR)
        thread.join()


@pytest.mark.parametrize(
    ("body", "length"),
    [
        (b"", None),
        (b"\1", None),
        (b"\1\3", None),
        (b"\1\3\x24", None),  # announces 36 bytes, has none
        (b"\1\3\x24" + bytes(35), None),  # one byte short
        (b"\1\3\xff" + bytes(255), None),
        (b"\1\3\2\0\0", None),  # one register, eighteen were asked for
        (b"\1\4\x24" + bytes(36), None),  # another function's
        (b"\1\x2b\x0e\1\x81\0\0", None),  # a device's name
        (b"\1\x83", None),  # an exception without its number
        (b"\1\x83\x63", None),  # and one that there is not
        (b"\2\3\x24" + bytes(36), None),  # another device's
        (b"\1\3\x24" + bytes(36), 0),
        (b"\1\3\x24" + bytes(36), 0xFFFF),
    ],
)
def test_no_reply_but_the_right_one_is_taken(body: bytes, length: int | None) -> None:
    with answering(body, length) as url:
        link = open_link(url, timeout_s=0.02)
        with pytest.raises(EdgeIdentError) as caught:
            link.read(STATUS, 18)
        assert caught.value.next_step
        with pytest.raises(EdgeIdentError):
            link.write(STATUS, [0] * 18)
        assert link.read(0, NONCE_WORDS) == IDENTITY
        link.close()
