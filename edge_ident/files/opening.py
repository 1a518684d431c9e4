"""Files of text as they are, or compressed by gzip."""

from io import TextIOWrapper
from pathlib import Path
from typing import BinaryIO, Final, cast

_GZIP: Final = b"\x1f\x8b"
"""First bytes of such a file, whatever it is called (RFC 1952)."""


def is_compressed(path: Path) -> bool:
    """Whether a file is compressed by gzip."""
    with path.open("rb") as file:
        return file.read(len(_GZIP)) == _GZIP


def open_bytes(path: Path) -> BinaryIO:
    """Open a file for reading what it holds, decompressed."""
    if not is_compressed(path):
        return path.open("rb")
    import gzip

    return cast("BinaryIO", gzip.open(path, "rb"))


def open_text(path: Path, encoding: str) -> TextIOWrapper:
    """Open a file as text of an encoding; any end of line is a line feed."""
    return TextIOWrapper(open_bytes(path), encoding=encoding, errors="replace", newline=None)
