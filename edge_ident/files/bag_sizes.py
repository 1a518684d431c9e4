"""What a bag of ROS unpacks to, counted while rosbags unpacks it.

rosbags unpacks a chunk, a message or a file whatever comes out of it, and has no setting for that.
So its tables of unpackers are exchanged while a bag is read.
"""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
from importlib import import_module
from pathlib import Path
from types import SimpleNamespace
from typing import Any, Final

from edge_ident.files.opening import Counted
from edge_ident.support.limits import MOST_BYTES, MOST_DESCRIPTION_BYTES, check_size

_PART_BYTES: Final = 1 << 24


def check_description(folder: Path) -> None:
    """Check the description in the folder of a bag of ROS 2, which is read at 40 kB a second.

    Raises
    ------
    TooLargeError
    """
    for file in folder.glob("*.yaml"):
        check_size(f"bytes in {file.name}", file.stat().st_size, MOST_DESCRIPTION_BYTES)


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
            check_size("bytes unpacked", self._made, MOST_BYTES)
            if not parts[-1] and unpacker.needs_input:
                raise EOFError("a chunk is cut off")
        return b"".join(parts)
