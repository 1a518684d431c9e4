"""How large what is read may be: what no recording needs is refused before it costs time or memory.

The largest recording that makes sense has a hundred million numbers: ten columns of 1 kHz for
nearly three hours, or seven columns of 4 kHz for an hour. They take 0.8 GB; all other limits follow
from them. A file states its sizes before it holds anything, and a compressed one of a kilobyte may
hold gigabytes: readers check what a file states, and count what comes out of it.
"""

from collections.abc import Iterable
from pathlib import Path
from typing import Any, Final

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
