"""Frames whose content may be anything."""

import struct

from hypothesis import settings
from hypothesis import strategies as st
from raw_line import crc16

from tests.repetitions import examples

SOME = settings(max_examples=examples(300), derandomize=True, deadline=None)
bodies = st.one_of(
    st.binary(max_size=40),
    st.builds(  # a function code and a length that may be right, over any content
        lambda code, count, rest: bytes([code, count]) + rest,
        st.sampled_from([3, 4, 6, 16, 22, 23, 43, 0x83, 0x84, 0x90, 0xFF]),
        st.integers(0, 255),
        st.binary(max_size=260),
    ),
    st.builds(lambda words: bytes([3, 2 * len(words)]) + struct.pack(f">{len(words)}H", *words),
              st.lists(st.integers(0, 0xFFFF), max_size=125)),
)  # fmt: skip


def rtu(body: bytes, device: int = 1) -> bytes:
    """A frame of a serial line with a right CRC."""
    return bytes([device]) + body + crc16(bytes([device]) + body)


def tcp(body: bytes, transaction: int) -> bytes:
    """A frame of a TCP connection."""
    return struct.pack(">HHHB", transaction, 0, len(body) + 1, 1) + body
