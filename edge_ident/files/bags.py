"""Bags of ROS 1 and ROS 2, and MCAP files: the joint states in them (sensor_msgs/JointState)."""

import struct
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import partial
from importlib import import_module
from pathlib import Path
from types import SimpleNamespace
from typing import Any, Final

import numpy as np

from edge_ident.errors import DataError
from edge_ident.files.opening import Counted, needed, reading
from edge_ident.files.table import Array, Column, Series, Table, merged
from edge_ident.support import documents

_JOINT_STATES: Final = "sensor_msgs/msg/JointState"
_NS_PER_S: Final = 1_000_000_000
_QUANTITIES: Final = ("position", "velocity", "effort")


@dataclass
class _Topic:
    """The joint states of one topic: of each joint and quantity, the stamps (ns) and the values."""

    series: dict[tuple[str, str], tuple[list[int], list[float]]] = field(default_factory=dict)

    @property
    def has_efforts(self) -> bool:
        return any(quantity == "effort" for _, quantity in self.series)

    def add(self, stamp_ns: int, names: list[str], quantity: str, values: Array) -> None:
        if len(values) != len(names):  # ROS leaves a quantity out that a joint does not have
            return
        documents.check_size("columns", len(self.series) + len(names), documents.MOST_COLUMNS)
        for name, value in zip(names, values.tolist(), strict=True):
            stamps, held = self.series.setdefault((name, quantity), ([], []))
            stamps.append(stamp_ns)
            held.append(value)


def read_bag(path: Path, topic: str | None = None) -> Table:
    """Read the joint states of a .bag, .db3 or .mcap file, or of the folder of a bag of ROS 2.

    Time is the stamp of each message, or when it was recorded where it has none. A joint has
    columns `NAME/position`, `NAME/velocity` and `NAME/effort`; ROS does not say whether it turns.
    Joints that are sent apart, or in changing order, have a clock each.

    Parameters
    ----------
    path : Path
    topic : str, optional
        To read; not needed where one alone has efforts.

    Raises
    ------
    DataError
        The file is damaged, or no bag of ROS; rosbags is missing; no joint states, or several
        topics of them, have an effort.
    TooLargeError
    """
    highlevel = needed("rosbags.highlevel", "ros", str(path))
    typesys = needed("rosbags.typesys", "ros", str(path))
    if (held := foreign_messages(path)) is not None:
        raise DataError(
            f"{path}: an MCAP file that holds {held}, and no messages of ROS",
            "export position and effort from it as CSV, such as from Foxglove or PlotJuggler",
        )
    store = typesys.get_typestore(typesys.Stores.LATEST)
    with reading(str(path), "ROS"), counted_unpacking():
        check_description(path)
        with highlevel.AnyReader([path], default_typestore=store) as reader:
            topics = sorted({c.topic for c in reader.connections})
            sent = _joint_states(reader)
    chosen = _chosen(path, sent, topics, topic)
    return Table(str(path), _columns(sent[chosen]), f"topic {chosen}")


def _chosen(path: Path, sent: dict[str, _Topic], topics: list[str], wanted: str | None) -> str:
    """The topic to read.

    Raises
    ------
    DataError
    """
    with_effort = [name for name, found in sent.items() if found.has_efforts]
    if wanted is not None:
        if wanted in with_effort:
            return wanted
        what = "there is no such topic" if wanted not in topics else "it has no efforts of joints"
        raise DataError(
            f"{path}: --topic {wanted}: {what}",
            f"topics with efforts: {', '.join(with_effort) or 'none'}",
        )
    if len(with_effort) == 1:
        return with_effort[0]
    raise DataError(
        f"{path}: topics of {_JOINT_STATES} with efforts: {', '.join(with_effort) or 'none'}; all "
        f"topics: {', '.join(topics) or 'none'}",
        f"say which to read: {' or '.join(f'--topic {name}' for name in with_effort)}"
        if with_effort
        else "record a topic that holds positions and efforts of the joints",
    )


def _joint_states(reader: Any) -> dict[str, _Topic]:
    """What each topic of joint states holds."""
    found: dict[str, _Topic] = {}
    states = [c for c in reader.connections if c.msgtype == _JOINT_STATES]
    numbers = 0
    for connection, recorded_ns, raw in reader.messages(states) if states else ():
        topic = found.setdefault(connection.topic, _Topic())
        message = reader.deserialize(raw, connection.msgtype)
        stamp = message.header.stamp
        stamp_ns = int(stamp.sec) * _NS_PER_S + int(stamp.nanosec)
        for quantity in _QUANTITIES:
            values = np.array(getattr(message, quantity), dtype=np.float64)
            numbers += len(values)
            documents.check_size("numbers", numbers, documents.MOST_CELLS)
            topic.add(stamp_ns or recorded_ns, list(message.name), quantity, values)
    return found


def _columns(topic: _Topic) -> tuple[Column, ...]:
    """Columns of a topic, on the stamps of all of its joints; time from the first."""
    first = min(stamps[0] for stamps, _ in topic.series.values())
    names = dict.fromkeys(name for name, _ in topic.series)
    series = []
    for quantity in _QUANTITIES:
        for name in names:
            if (name, quantity) in topic.series:
                stamps, values = topic.series[name, quantity]
                since = (np.array(stamps) - first) / _NS_PER_S
                series.append(Series(f"{name}/{quantity}", None, since, np.array(values)))
    return merged(series, "time [s]", None)


# What a bag of ROS unpacks to, counted while rosbags unpacks it.
#
# rosbags unpacks a chunk, a message or a file whatever comes out of it, and has no setting for
# that. So its tables of unpackers are exchanged while a bag is read.

_PART_BYTES: Final = 1 << 24


def check_description(folder: Path) -> None:
    """Check the description in the folder of a bag of ROS 2, which is read at 40 kB a second.

    Raises
    ------
    TooLargeError
    """
    for file in folder.glob("*.yaml"):
        documents.check_size(
            f"bytes in {file.name}", file.stat().st_size, documents.MOST_DESCRIPTION_BYTES
        )


@contextmanager
def counted_unpacking() -> Iterator[None]:
    """Let rosbags unpack no more than a recording may have, while the body runs."""
    reader, storage = _module("rosbag2.reader"), _module("rosbag2.storage_mcap")
    tables = _module("rosbag1.reader")["decompressors"], storage["DECOMPRESSORS"]
    before, zstd = [dict(table) for table in tables], reader.get("zstd")  # older ones state sizes
    unpackers = _Unpackers(zstd)
    try:
        for table in tables:
            table.update({n: unpack for n, unpack in unpackers.of_chunks().items() if n in table})
        if zstd is not None:
            reader["zstd"] = unpackers.of_files()
        yield
    finally:
        for table, held in zip(tables, before, strict=True):
            table.update(held)
        if zstd is not None:
            reader["zstd"] = zstd


def _module(name: str) -> dict[str, Any]:
    return vars(import_module(f"rosbags.{name}"))


class _Unpackers:
    """Unpackers that share what may come out of all of them."""

    def __init__(self, zstd: Any) -> None:
        self._zstd = zstd
        self._made = 0

    def of_chunks(self) -> dict[str, Callable[..., bytes]]:
        """By the names that chunks have for them; what else they are given does not matter."""
        kinds = {
            "bz2": import_module("bz2").BZ2Decompressor,
            "lz4": import_module("lz4.frame").LZ4FrameDecompressor,
        }
        kinds |= {} if self._zstd is None else {"zstd": self._zstd.ZstdDecompressor}
        return {name: partial(self._unpacked, kind) for name, kind in kinds.items()}

    def of_files(self) -> SimpleNamespace:
        """What messages and whole files are unpacked with."""
        return SimpleNamespace(
            decompress=partial(self._unpacked, self._zstd.ZstdDecompressor),
            open=lambda file, mode: Counted(self._zstd.open(file, mode)),
        )

    def _unpacked(self, kind: Callable[[], Any], data: bytes, *_: object) -> bytes:
        parts: list[bytes] = []
        unpacker = kind()
        while not unpacker.eof:
            parts.append(unpacker.decompress(data, _PART_BYTES))
            data = b""
            self._made += len(parts[-1])
            documents.check_size("bytes unpacked", self._made, documents.MOST_BYTES)
            if not parts[-1] and unpacker.needs_input:
                raise EOFError("a chunk is cut off")
        return b"".join(parts)


# What an MCAP file says it holds (https://mcap.dev/spec): messages of ROS 2, or of another system.
#
# Only the header and the summary at the end are looked at, which are never compressed.

_MAGIC: Final = b"\x89MCAP0\r\n"
_HEADER, _SCHEMA, _CHANNEL = 0x01, 0x03, 0x04
_FOOTER_BYTES: Final = 37  # of a footer's record, and the magic number behind it
_MOST_BYTES: Final = 1 << 22  # of header and summary: a schema has some kilobytes
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
