"""Files of text as they are, or compressed by gzip; no more of them than a recording may have."""

from collections.abc import Iterator
from functools import partial
from io import BufferedReader, RawIOBase, TextIOWrapper
from pathlib import Path
from typing import BinaryIO, Final, cast

from edge_ident.support.limits import MOST_BYTES, MOST_IN_LINE, check_size

_GZIP: Final = b"\x1f\x8b"
"""First bytes of such a file, whatever it is called (RFC 1952)."""
_BLOCK_BYTES: Final = 1 << 17


def is_compressed(path: Path) -> bool:
    """Whether a file is compressed by gzip."""
    with path.open("rb") as file:
        return file.read(len(_GZIP)) == _GZIP


def open_bytes(path: Path) -> BinaryIO:
    """Open a file for reading what it holds, decompressed.

    Raises
    ------
    TooLargeError
        Now or while it is read: it holds more bytes than a recording has.
    """
    if not is_compressed(path):
        check_size("bytes", path.stat().st_size, MOST_BYTES)
        return path.open("rb")
    import gzip

    return BufferedReader(Counted(cast("BinaryIO", gzip.open(path, "rb"))), _BLOCK_BYTES)


class Counted(RawIOBase):
    """What comes out of a file, as far as the limit."""

    def __init__(self, file: BinaryIO) -> None:
        self._file = file
        self._count = 0

    def readable(self) -> bool:
        return True

    def readinto(self, buffer: "bytearray | memoryview") -> int:  # type: ignore[override]
        part = self._file.read(len(buffer))
        self._count += len(part)
        check_size("bytes unpacked", self._count, MOST_BYTES)
        buffer[: len(part)] = part
        return len(part)

    def close(self) -> None:
        self._file.close()
        super().close()


def open_text(path: Path, encoding: str) -> TextIOWrapper:
    """Open a file as text of an encoding; any end of line is a line feed."""
    return TextIOWrapper(open_bytes(path), encoding=encoding, errors="replace", newline=None)


def lines_of(file: TextIOWrapper) -> Iterator[str]:
    """Lines of a text.

    Raises
    ------
    TooLargeError
        One is longer than a row of a table.
    """
    for line in iter(partial(file.readline, MOST_IN_LINE + 1), ""):
        check_size("characters in a line", len(line), MOST_IN_LINE)
        yield line
