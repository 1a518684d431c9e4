"""Files that appear whole or not at all, are read within limits, and hold JSON."""

import errno
import json
import math
import os
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any, Final

from edge_ident.support.words import visible

# How large what is read may be: what no recording needs is refused before it costs time or memory.
#
# The largest recording that makes sense has a hundred million numbers: ten columns of 1 kHz for
# nearly three hours, or seven columns of 4 kHz for an hour. They take 0.8 GB; all other limits
# follow from them. A file states its sizes before it holds anything, and a compressed one of a
# kilobyte may hold gigabytes: readers check what a file states, and count what comes out of it.

MOST_NUMBERS: Final = 100_000_000
"""Numbers of a recording, in all of its columns."""
LARGEST: Final = 1e15
"""Largest number of a recording, in SI units: a double counts in steps of an eighth there, and no
position, time or effort of a machine comes near it."""
SMALLEST: Final = 1.0 / LARGEST
"""Smallest swing of a signal, and step of a time."""
MOST_COLUMNS: Final = 1_000
"""A controller traces some dozens of signals, a robot some hundreds."""
MOST_CELLS: Final = MOST_NUMBERS // 10
"""Cells of a sheet: one takes ten times the memory of a number."""
MOST_CHARACTERS: Final = 1_000
"""Characters of a heading, of a line of a description, and of a number in a document."""
MOST_IN_LINE: Final = MOST_COLUMNS * MOST_CHARACTERS
"""Characters of a line."""
MOST_BYTES: Final = 16 * MOST_NUMBERS
"""Bytes of a table as text, or of what an archive unpacks to: a number of twelve digits with its
sign, point, exponent and delimiter takes 16."""
MOST_DOCUMENT_BYTES: Final = 1 << 22
"""Bytes of a document: a model, a motion, a description or gains take some kilobytes."""
MOST_DESCRIPTION_BYTES: Final = 1 << 18
"""Bytes of a description of a drive or of settings, which a person writes in some dozen lines."""
MOST_NETWORK_BYTES: Final = 1 << 26
"""Bytes of a network: that of the package takes 1.5 MB."""
MOST_FILES: Final = 100_000
"""Files of a folder: to analyse as many recordings takes days."""
DEEPEST: Final = 50
"""Objects in objects of a document, arrays in arrays, folders in folders."""


class TooLargeError(ValueError):
    """A file has, or asks for, more than a limit; the message names both."""


def check_size(what: str, found: int, most: int) -> None:
    """Compare a size with its limit.

    Parameters
    ----------
    what : str
        Of what there are so many, such as `numbers`.
    found, most : int

    Raises
    ------
    TooLargeError
    """
    if found > most:
        raise TooLargeError(f"it has {found:,} {what}, and at most {most:,} are read")


def check_table(columns: int, rows: int) -> None:
    """Check the size of a table before memory is asked for.

    Raises
    ------
    TooLargeError
    """
    check_size("columns", columns, MOST_COLUMNS)
    check_size("numbers", columns * rows, MOST_NUMBERS)


def check_document(document: Any) -> Any:
    """A parsed document, if its nesting is one that all that follows can walk through.

    Raises
    ------
    TooLargeError
    """
    level: list[Any] = [document]
    for _ in range(DEEPEST):
        level = [inner for value in level for inner in _held(value)]
        if not level:
            return document
    raise TooLargeError(f"it is nested too deeply: at most {DEEPEST} levels are read")


def _held(value: Any) -> Iterable[Any]:
    if isinstance(value, dict):
        return value.values()
    return value if isinstance(value, list) else ()


def read_bytes(path: Path, most: int) -> bytes:
    """The bytes of a file that is read as a whole.

    Raises
    ------
    OSError
    TooLargeError
    """
    with path.open("rb") as file:
        content = file.read(most + 1)
    check_size("bytes or more", len(content), most)
    return content


def read_document(path: Path) -> str:
    """The text of a document.

    Raises
    ------
    OSError
    ValueError
        It is too large, or no UTF-8.
    """
    return read_bytes(path, MOST_DOCUMENT_BYTES).decode("utf-8")


# Atomic writes: a file appears complete or not at all, because it is written and then renamed.


@contextmanager
def atomic_write(path: Path, *, lasting: bool = True) -> Iterator[Path]:
    """Yield a name beside `path` to write to; the file written there is renamed to `path`.

    If the body fails, nothing is left and an older file stays. Missing folders are made. The name
    keeps its suffix, from which some writers tell the format, and is that of this process alone.

    Parameters
    ----------
    path : Path
    lasting : bool
        Wait until the disk has the file, so that it is there whole after a power cut, too. That
        may take as long as a second. Without it the file may be lost or empty then.

    Raises
    ------
    OSError
        The disk is full, or writing there is not allowed. The error names the file.
    """
    if path.is_dir():
        raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR), str(path))
    path.parent.mkdir(parents=True, exist_ok=True)
    partial = path.with_name(f".partial-{os.getpid()}-{path.name}")
    try:
        yield partial
        if lasting:
            _wait_for_disk(partial, os.O_RDWR)
        partial.replace(path)
        if lasting:
            with suppress(OSError):  # not every system opens a folder
                _wait_for_disk(path.parent, os.O_RDONLY)
    except OSError as error:
        raise OSError(error.errno, error.strerror, str(path)) from error
    finally:
        partial.unlink(missing_ok=True)


def _wait_for_disk(path: Path, how: int) -> None:
    number = os.open(path, how)
    try:
        os.fsync(number)
    finally:
        os.close(number)


# What stands where a file should be.


def no_file(path: Path) -> str:
    """Why a path is no file that can be read, with the path."""
    if path.is_dir():
        return f"{path}: it is a folder"
    return f"{path}: {'it is no file' if path.exists() else 'no such file'}"


# JSON as every document of this project is written and read.

NOT_TEXT: Final = "backslashreplace"
"""What becomes of the bytes of a file's name that are no text; JSON reads it back."""


def to_json(document: Mapping[str, Any]) -> str:
    """One document, readable, of numbers that any parser takes (no NaN); all of it is visible."""
    return visible(json.dumps(document, indent=2, allow_nan=False, ensure_ascii=False))


def from_json(text: str | bytes) -> Any:
    """What a document says.

    Raises
    ------
    ValueError
        It is no JSON, says one thing twice, or is more than `edge_ident.support.documents` allow.
    """
    try:
        document = json.loads(text, object_pairs_hook=_each_once, parse_int=_whole)
    except RecursionError as error:
        raise ValueError("it is too deeply nested") from error
    return check_document(document)


def _each_once(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    """An object; of two values of one name, nobody knows which is meant."""
    found: dict[str, Any] = {}
    for name, value in pairs:
        if name in found:
            raise ValueError(f"it has {name!r:.60} twice in one place")
        found[name] = value
    return found


def _whole(digits: str) -> int:
    """An integer; Python refuses to read thousands of digits, in words that do not help here."""
    check_size("digits in an integer", len(digits), MOST_CHARACTERS)
    return int(digits)


def read_json(path: Path) -> Any:
    """What a file says.

    Raises
    ------
    OSError
    ValueError
        As `from_json`, or it is too large or no UTF-8.
    """
    return from_json(read_document(path))


def write_json(document: Mapping[str, Any], path: Path) -> None:
    """Write a document atomically, with the folders that lead to it."""
    with atomic_write(path) as partial:
        partial.write_text(to_json(document) + "\n", encoding="utf-8", errors=NOT_TEXT)


def finite(value: float) -> float | None:
    """JSON has no infinity."""
    return value if math.isfinite(value) else None


# TOML as it is read here, from files that a person may have got from anybody.


def from_toml(text: str) -> dict[str, Any]:
    """What a text says.

    Raises
    ------
    ValueError
        It is no TOML, or more than `edge_ident.support.documents` allow.
    """
    import tomllib  # most users have no settings

    check_size("characters", len(text), MOST_DESCRIPTION_BYTES)
    longest = max(map(len, text.splitlines()), default=0)
    check_size("characters in a line", longest, MOST_CHARACTERS)  # the parser's time is its square
    try:
        document: dict[str, Any] = check_document(tomllib.loads(text))
    except RecursionError as error:
        raise ValueError("it is nested too deeply") from error
    return document


# Hashes that identify files.


def file_sha256(path: Path) -> str:
    """SHA-256 of a file's content, in hexadecimal; the file is read in parts.

    Raises
    ------
    OSError
        It cannot be read.
    """
    import hashlib  # most commands hash nothing

    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()
