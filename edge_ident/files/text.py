"""Tables in text files of any dialect."""

import csv
import re
import warnings
import zlib
from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import islice
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray

from edge_ident.files.bad_cells import bad_cell
from edge_ident.files.dialect import (
    BLANK,
    BLANKS,
    DELIMITERS,
    Dialect,
    find_dialect,
    read_head,
    seconds_of_stamp,
    since_first,
    split,
    width_of,
)
from edge_ident.files.extras import unreadable
from edge_ident.files.headings import joint_names
from edge_ident.files.layout import Layout, lay_out, stated_period
from edge_ident.files.named_values import read_named, read_stacked
from edge_ident.files.opening import is_compressed, lines_of, open_bytes, open_text
from edge_ident.files.table import Table, make_columns
from edge_ident.support.limits import MOST_COLUMNS, TooLargeError, check_size, check_table

Array = NDArray[np.float64]

_CHUNK_ROWS: Final = 100_000
"""Rows that are converted at once: their objects are gone before the next."""
_OTHER_WIDTH: Final = "another number of cells"
_BLOCK_BYTES: Final = 1 << 24
_NAN: Final = re.compile(r"[-+]?\bnan\b", re.IGNORECASE)


def read_text(path: Path, delimiter: str | None = None, decimal: str | None = None) -> Table:
    """Read a table of any delimiter, decimal sign and encoding, with its headings and units.

    Parameters
    ----------
    path : Path
    delimiter, decimal : str, optional
        Keys of `edge_ident.files.dialect.DELIMITERS` and `DECIMALS`; found out where not given.

    Raises
    ------
    DataError
        The file is not text, holds no table, has a bad cell, or a comma may be one of thousands;
        or gzip has compressed it, and it is damaged.
    TooLargeError
    """
    try:
        return _table(path, delimiter, decimal)
    except (EOFError, OSError, zlib.error) as error:
        if not is_compressed(path):
            raise
        raise unreadable(str(path), "gzip", error) from error


def _table(path: Path, delimiter: str | None, decimal: str | None) -> Table:
    encoding, lines = read_head(path)
    dialect = find_dialect(path, lines, encoding, delimiter, decimal)
    rows = [(i, dialect.all_cells(line)) for i, line in enumerate(lines, start=1) if line.strip()]
    width = width_of(dialect, [cells for _, cells in rows])
    open_end = _open_end(rows, width)
    if open_end:
        rows = [(i, cells if cells[-1] else cells[:-1] or cells) for i, cells in rows]
        width -= 1
    check_size("columns", width, MOST_COLUMNS)
    if (other := read_named(path, dialect, rows, width)) is not None:
        return other
    layout = lay_out(str(path), _without_comments(rows, width), width, dialect.is_value)
    held = [cells for number, cells in rows if number >= layout.first_row and len(cells) == width]
    stamps = [c for c in layout.numeric if any(dialect.is_stamp(cells[c]) for cells in held)]
    layout = replace(layout, open_end=open_end, stamps=tuple(stamps))
    try:
        values, sparse = _any_numbers(path, dialect, layout, lines)
    except TooLargeError:
        raise
    except (ValueError, csv.Error) as error:
        if (other := read_stacked(path, dialect)) is not None:
            return other
        raise bad_cell(path, dialect, layout) from error
    headings = [layout.headings[c] for c in layout.numeric]
    units = ["s" if c in stamps else layout.units[c] for c in layout.numeric]
    for row, column in enumerate(layout.numeric):
        if column in stamps:
            since_first(values[row])
    columns = make_columns(headings, values, units, sparse=sparse)
    texts = {
        layout.headings[c]: {cells[c] for cells in held}
        for c in range(width)
        if c not in layout.numeric
    }
    return Table(
        str(path), columns, _how(dialect, layout), layout.first_row, layout.header,
        tuple(f"{heading} (no numbers)" for heading in texts),
        stated_period(layout.header), joint_names(texts.items()),
    )  # fmt: skip


def _open_end(rows: Sequence[tuple[int, list[str]]], width: int) -> bool:
    """Whether the rows of a table end with a delimiter, and no column stands behind it."""
    last = [cells[-1] for _, cells in rows if len(cells) == width]
    return width > 1 and not any(last)


def _any_numbers(
    path: Path, dialect: Dialect, layout: Layout, lines: Sequence[str]
) -> tuple[Array, bool]:
    """Values (columns, rows), and whether NaN in them stands for empty cells.

    Raises
    ------
    ValueError, Error, TooLargeError
        As of `_numbers`.
    """
    quoted = any('"' in line for line in lines[layout.first_row - 1 :])
    try:
        return _numbers(path, dialect, layout, quoted), False
    except TooLargeError:
        raise
    except (ValueError, csv.Error):
        return _numbers(path, dialect, layout, quoted, holes=True), True


def _how(dialect: Dialect, layout: Layout) -> str:
    """How the file was read; nothing where it is written as the contract says."""
    plain = dialect.delimiter == "comma" and dialect.decimal == "point" and layout.heading_row
    plain = plain and not layout.unit_row
    said = "" if plain and dialect.encoding.startswith("utf-8") else f"{dialect}, {layout}"
    times = [f"{layout.headings[c]} in seconds from the first" for c in layout.stamps]
    return ", ".join(filter(None, (said, *times)))


def _without_comments(rows: list[tuple[int, list[str]]], width: int) -> list[tuple[int, list[str]]]:
    """Rows in which a comment is one cell, unless it is the headings' row, as numpy writes it."""

    def is_comment(cells: list[str]) -> bool:
        return cells[0][:1] in ("#", "%") and len(cells) not in (width, width + 1)

    return [(number, [" ".join(c)] if is_comment(c) else c) for number, c in rows]


def _numbers(
    path: Path, dialect: Dialect, layout: Layout, quoted: bool, *, holes: bool = False
) -> Array:
    """Values (columns, rows), each column in one piece; with NaN for empty cells where `holes`.

    Raises
    ------
    ValueError
        A cell is no number, or a row has more or fewer cells.
    TooLargeError
    """
    most = max(_count_rows(path, len(layout.numeric)) - layout.first_row + 1, 0)
    values, at = np.empty((len(layout.numeric), most)), 0
    with open_text(path, dialect.encoding) as file:
        table = islice(lines_of(file), layout.first_row - 1, layout.first_row - 1 + most)
        lines = _plain(table, dialect, layout, quoted)
        if holes:
            lines = _filled(lines, "\t" if quoted else DELIMITERS[dialect.delimiter])
        while (rows := _parsed(islice(lines, _CHUNK_ROWS), dialect, layout, quoted)).size:
            values[:, at : at + len(rows)] = rows.T
            at += len(rows)
    return values[:, :at]


def _parsed(lines: Iterator[str], dialect: Dialect, layout: Layout, quoted: bool) -> Array:
    separator = "\t" if quoted else DELIMITERS[dialect.delimiter]
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)  # no rows: the end
        rows = np.loadtxt(
            lines,
            delimiter=None if separator == BLANKS else separator,
            comments=None,
            ndmin=2,
            usecols=None if len(layout.numeric) == len(layout.headings) else layout.numeric,
            converters=dict.fromkeys(layout.stamps, seconds_of_stamp) or None,
        )
    if rows.size and rows.shape[1] != len(layout.numeric):
        raise ValueError(_OTHER_WIDTH)
    return np.asarray(rows, dtype=np.float64)


def _plain(lines: Iterator[str], dialect: Dialect, layout: Layout, quoted: bool) -> Iterator[str]:
    """Lines with decimal points, and without what a plain table does not have."""
    separator = DELIMITERS[dialect.delimiter]
    if quoted:
        lines = _unquoted(lines, separator, layout)
    elif len(layout.numeric) < len(layout.headings):
        lines = _of_width(lines, dialect, layout)
    elif layout.open_end:
        end = separator + "\n"
        lines = (line[:-2] if line.endswith(end) else line for line in lines)
    if dialect.decimal == "comma":
        lines = _with_points(lines, "\t" if quoted else separator, layout)
    return lines


def _filled(lines: Iterator[str], separator: str) -> Iterator[str]:
    """Lines in which NaN stands for an empty cell, and what was NaN is infinite: a bad value."""
    if separator == BLANKS:
        yield from lines
        return
    edge = re.escape(separator)
    empty = re.compile(rf"(?:(?<=^)|(?<={edge})) *{BLANK} *(?={edge}|$)", re.IGNORECASE)
    for line in lines:
        yield empty.sub("nan", _NAN.sub("inf", line.rstrip("\n"))) + "\n"


def _unquoted(lines: Iterator[str], separator: str, layout: Layout) -> Iterator[str]:
    """Lines whose cells may be quoted, with tabs between."""
    width = len(layout.headings)
    for cells in csv.reader(lines, delimiter=separator, skipinitialspace=True):
        if cells and len(cells) != width + (len(cells) > width and not cells[-1]):
            raise ValueError(_OTHER_WIDTH)
        yield "\t".join(cells[:width])


def _of_width(lines: Iterator[str], dialect: Dialect, layout: Layout) -> Iterator[str]:
    """Lines as they are; numpy does not count the cells where it takes some columns only."""
    separator, width = DELIMITERS[dialect.delimiter], len(layout.headings)
    usual = width - 1 + layout.open_end
    for line in lines:
        between = len(line.split()) - 1 if separator == BLANKS else line.count(separator)
        if between != usual and line.strip() and len(dialect.cells(line.rstrip("\n"))) != width:
            raise ValueError(_OTHER_WIDTH)
        yield line


def _with_points(lines: Iterator[str], separator: str, layout: Layout) -> Iterator[str]:
    """Lines with decimal points; a number that had one before is written in another way."""
    numbers = [c for c in layout.numeric if c not in layout.stamps]
    for line in lines:
        if "." in line:
            cells = split(line.rstrip("\n"), separator)
            if any("." in cells[c] for c in numbers if c < len(cells)):
                raise ValueError("decimal points among decimal commas")
        yield line.replace(",", ".")


def _count_rows(path: Path, columns: int) -> int:
    """Rows of a file, or more; of any encoding and any end of line. A last line EOF is none.

    Raises
    ------
    TooLargeError
        So many columns of them are more than a recording has.
    """
    feeds = returns = 0
    block = b""
    with open_bytes(path) as file:
        while part := file.read(_BLOCK_BYTES):
            block = part
            feeds += block.count(b"\n")
            returns += block.count(b"\r") if not feeds else 0
            check_table(columns, max(feeds, returns))
    rows = max(feeds, returns) + (not block.endswith((b"\n", b"\r", b"\n\0")))
    end = block[-64:].replace(b"\0", b"").strip().endswith((b"\nEOF", b"\rEOF"))
    return rows - (1 if end else 0)
