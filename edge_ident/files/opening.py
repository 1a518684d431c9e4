"""Files as they are opened: plain, compressed, archives; and packages that only some need."""

import zipfile
from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial
from importlib import import_module
from io import BufferedReader, RawIOBase, TextIOWrapper
from pathlib import Path
from typing import IO, Any, BinaryIO, Final, cast
from xml.parsers.expat import ParserCreate

from edge_ident.errors import DataError, EdgeIdentError
from edge_ident.support import documents

# Packages that only some files need, and what they make of a file that is none of theirs.


def needed(package: str, extra: str, source: str) -> Any:
    """Load a package, or say which extra of edge-ident has it.

    Raises
    ------
    DataError
        It is not installed.
    """
    try:
        return import_module(package)
    except ImportError as error:
        raise DataError(
            f"{source}: reading it needs {package.partition('.')[0]}, which is not installed",
            f"pip install 'edge-ident[{extra}]' (or [files], for all formats)",
        ) from error


@contextmanager
def reading(source: str, kind: str) -> Iterator[None]:
    """Read a file with the reader of its format: whatever that raises, the file is none of it.

    Such readers have no common error: what is damaged shows as a wrong key, an index or a type.

    Raises
    ------
    DataError
        The reader refuses the file.
    TooLargeError, MemoryError
        As they come: the file may be as its format has it.
    """
    try:
        yield
    except (EdgeIdentError, documents.TooLargeError, MemoryError):
        raise
    except Exception as error:
        raise unreadable(source, kind, error) from error


def unreadable(source: str, kind: str, error: Exception) -> DataError:
    """The error for a file that its own format's reader refuses."""
    said = (str(error).splitlines() or [type(error).__name__])[0]
    return DataError(
        f"{source}: not a readable {kind} file ({said})", "write it again, or use .csv"
    )


# Files of text as they are, or compressed by gzip; no more of them than a recording may have.

_GZIP: Final = b"\x1f\x8b"  # first bytes of such a file, whatever it is called (RFC 1952)
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
        documents.check_size("bytes", path.stat().st_size, documents.MOST_BYTES)
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
        documents.check_size("bytes unpacked", self._count, documents.MOST_BYTES)
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
    for line in iter(partial(file.readline, documents.MOST_IN_LINE + 1), ""):
        documents.check_size("characters in a line", len(line), documents.MOST_IN_LINE)
        yield line


# Archives of zip, which other formats are: what they unpack to is known before it is unpacked.

_PART_BYTES: Final = 1 << 14


def open_archive(path: Path) -> zipfile.ZipFile:
    """Open an archive whose members unpack to what a recording may have.

    A member ends at the size that the archive states for it, whatever is packed.

    Raises
    ------
    BadZipFile, OSError
        It is damaged.
    TooLargeError
    """
    archive = zipfile.ZipFile(path)
    members = archive.infolist()
    try:
        documents.check_size("members", len(members), documents.MOST_COLUMNS)
        documents.check_size(
            "bytes unpacked", sum(one.file_size for one in members), documents.MOST_BYTES
        )
    except ValueError:
        archive.close()
        raise
    return archive


def refuse_document_types(archive: zipfile.ZipFile) -> None:
    """Refuse XML whose text may be more than what stands there: Office documents have no such.

    A document type declares entities, and entities of entities multiply (ECMA-376, part 2, 8.3.1:
    a package has no document types). It stands before the first element.

    Raises
    ------
    ValueError
    """
    for name in archive.namelist():
        if name.lower().endswith((".xml", ".rels", ".vml")):
            with archive.open(name) as member:
                _refuse_document_type(name, member)


def _refuse_document_type(name: str, member: IO[bytes]) -> None:
    begun: list[str] = []

    def refuse(*_: object) -> None:
        raise ValueError(f"{name} declares a document type")

    parser = ParserCreate()
    parser.StartDoctypeDeclHandler = refuse
    parser.StartElementHandler = lambda element, _: begun.append(element)
    while not begun and (part := member.read(_PART_BYTES)):
        parser.Parse(part)
