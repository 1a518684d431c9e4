"""What an MCAP file says it holds (https://mcap.dev/spec): messages of ROS 2, or of another system.

Only the header and the summary at the end are looked at, which are never compressed.
"""

import struct
from collections.abc import Iterator
from pathlib import Path
from typing import Final

_MAGIC: Final = b"\x89MCAP0\r\n"
_HEADER, _SCHEMA, _CHANNEL = 0x01, 0x03, 0x04
_FOOTER_BYTES: Final = 37
"""Of a footer's record, and the magic number behind it."""
_MOST_BYTES: Final = 1 << 22
"""Of header and summary: a schema has some kilobytes."""
_OF_ROS_2: Final = ("ros2msg", "ros2idl", "omgidl", "")
_SHOWN: Final = 3


def foreign_messages(path: Path) -> str | None:
    """What messages a file has that are none of ROS 2; None of ROS 2, or where it is no whole MCAP.

    Parameters
    ----------
    path : Path
        A file, or the folder of a bag.
    """
    if path.is_dir():
        return None
    try:
        return _foreign(path)
    except (OSError, OverflowError, ValueError, struct.error):  # damaged: its own reader says how
        return None


def _foreign(path: Path) -> str | None:
    size = path.stat().st_size
    with path.open("rb") as file:
        if file.read(len(_MAGIC)) != _MAGIC:
            return None
        first = next(_records(file.read(_MOST_BYTES)), (0, b""))
        file.seek(max(size - _FOOTER_BYTES, 0))
        (summary,) = struct.unpack_from("<Q", file.read(), 9)
        file.seek(summary or size)
        held = list(_records(file.read(_MOST_BYTES)))
    profile = _text(first[1], 0)[0] if first[0] == _HEADER else ""
    schemas = [_schema(body) for kind, body in held if kind == _SCHEMA]
    channels = [_channel(body) for kind, body in held if kind == _CHANNEL]
    if profile == "ros2" and all(encoding in _OF_ROS_2 for _, encoding in schemas):
        return None
    names = ", ".join(dict.fromkeys(name for name, _ in schemas[:_SHOWN])) or "no schema"
    written = ", ".join(dict.fromkeys(encoding for _, encoding in channels)) or "unknown encoding"
    topics = ", ".join(topic for topic, _ in channels[:_SHOWN]) or "none"
    return f"messages in {written} (profile {profile or 'none'}; {names}; topics {topics})"


def _records(data: bytes) -> Iterator[tuple[int, bytes]]:
    """Kind and body of records, as far as they are there."""
    at = 0
    while at + 9 <= len(data):
        kind, length = struct.unpack_from("<BQ", data, at)
        yield kind, data[at + 9 : at + 9 + length]
        at += 9 + length


def _text(body: bytes, at: int) -> tuple[str, int]:
    """A text with its length before it, and where it ends."""
    (length,) = struct.unpack_from("<I", body, at)
    return body[at + 4 : at + 4 + length].decode(), at + 4 + length


def _schema(body: bytes) -> tuple[str, str]:
    """Name and encoding."""
    name, at = _text(body, 2)
    return name, _text(body, at)[0]


def _channel(body: bytes) -> tuple[str, str]:
    """Topic and the encoding of its messages."""
    topic, at = _text(body, 4)
    return topic, _text(body, at)[0]
