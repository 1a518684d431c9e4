"""Tables in text files of any dialect."""

import csv
import re
import warnings
import zlib
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from itertools import islice
from pathlib import Path
from typing import Final

import numpy as np

from edge_ident.errors import DataError
from edge_ident.files.dialect import (
    BLANK,
    BLANKS,
    DELIMITERS,
    Dialect,
    Layout,
    find_dialect,
    lay_out,
    read_head,
    seconds_of_stamp,
    since_first,
    split,
    stated_in,
    stated_period,
    width_of,
)
from edge_ident.files.opening import is_compressed, lines_of, open_bytes, open_text, unreadable
from edge_ident.files.table import Array, Column, Series, Table, joint_names, make_columns, merged
from edge_ident.files.units import known_unit
from edge_ident.support import documents, words

# Rows that are converted at once: their objects are gone before the next.
_CHUNK_ROWS: Final = 100_000
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
    documents.check_size("columns", width, documents.MOST_COLUMNS)
    if (other := read_named(path, dialect, rows, width)) is not None:
        return other
    layout = lay_out(str(path), _without_comments(rows, width), width, dialect.is_value)
    held = [cells for number, cells in rows if number >= layout.first_row and len(cells) == width]
    stamps = [c for c in layout.numeric if any(dialect.is_stamp(cells[c]) for cells in held)]
    layout = replace(layout, open_end=open_end, stamps=tuple(stamps))
    try:
        values, sparse = _any_numbers(path, dialect, layout, lines)
    except documents.TooLargeError:
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
    except documents.TooLargeError:
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
        lines = (line.removesuffix("\n").removesuffix(separator) for line in lines)
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
            documents.check_table(columns, max(feeds, returns))
    rows = max(feeds, returns) + (not block.endswith((b"\n", b"\r", b"\n\0")))
    end = block[-64:].replace(b"\0", b"").strip().endswith((b"\nEOF", b"\rEOF"))
    return rows - (1 if end else 0)


# Text in which names stand beside or above their values, instead of in one row of headings.
#
# Pairs: every row repeats the name before each value, as LinuxCNC's halscope writes. Long: every
# row is one value, with its name and mostly its time. Stacked: each variable has a table of its
# own, as traces of CODESYS have. The last two have a clock for each variable.

Row = tuple[int, list[str]]

# What halscope's log begins with. It writes one row more than it has samples.
_SCOPE: Final = "Sampling period is"
_FEWEST: Final = 3  # rows that show a form
_UNIT_KEYS: Final = ("unit", "einheit", "units")
_SHORT: Final = 2  # cells of a row that is a title


def read_named(path: Path, dialect: Dialect, rows: Sequence[Row], width: int) -> Table | None:
    """Read pairs, or a long table; None where the first rows are neither.

    Parameters
    ----------
    path : Path
    dialect : Dialect
    rows : sequence of (number, cells)
        Head of the file.
    width : int
        Cells of most rows.

    Raises
    ------
    TooLargeError
    """
    usual = [cells for _, cells in rows if len(cells) == width]
    usual = [cells for cells in usual if any(map(dialect.is_number, cells))]
    if len(usual) < _FEWEST:
        return None
    textual = [c for c in range(width) if not any(dialect.is_value(cells[c]) for cells in usual)]
    held = {c: {cells[c] for cells in usual} for c in textual}
    first = next(number for number, cells in rows if cells == usual[0])
    header = stated_in([(n, [" ".join(cells)]) for n, cells in rows if n < first])
    repeated = textual == list(range(0, width, 2)) and all(len(h) == 1 for h in held.values())
    if repeated and width > 2:
        return _pairs(path, dialect, usual[0], header)
    is_long = len(textual) == 1 and width in (2, 3) and _is_long(dialect, usual, textual[0])
    if is_long or (repeated and _is_scope(header)):
        return _long(path, dialect, textual[0], width, header)
    return None


def _is_scope(header: dict[str, str]) -> bool:
    return any(key.startswith(_SCOPE.removesuffix(" is")) for key in header)


def _pairs(path: Path, dialect: Dialect, row: Sequence[str], header: dict[str, str]) -> Table:
    """Rows of a name before each value."""
    names, numbers = list(row[::2]), []
    for _, cells in _rows(path, dialect):
        if list(cells[::2]) == names and all(map(dialect.is_number, cells[1::2])):
            numbers.append([_number(dialect, cell) for cell in cells[1::2]])
    how = f"{dialect}, a name before each value"
    if _is_scope(header):
        numbers, how = numbers[:-1], f"{how}; the last row, which halscope adds, left out"
    values = np.array(numbers).T
    columns = make_columns(names, np.ascontiguousarray(values), [None] * len(names))
    return Table(str(path), columns, how, header=header, period_s=stated_period(header))


def _is_long(dialect: Dialect, rows: Sequence[Sequence[str]], names: int) -> bool:
    """Whether rows are one value each: several names that stand there again and again, and before
    the value nothing but a clock."""
    held = {cells[names] for cells in rows}
    if not 1 < len(held) <= documents.MOST_COLUMNS or 2 * len(held) > len(rows):
        return False
    if len(rows[0]) == 2:
        return names == 0
    clock = min({0, 1, 2} - {names})
    times = [_number(dialect, cells[clock]) for cells in rows]
    return bool(np.all(np.diff(times) >= 0.0)) and times[-1] > times[0]


def _long(path: Path, dialect: Dialect, names: int, width: int, header: dict[str, str]) -> Table:
    """Rows of one value, with its name and maybe its time."""
    clock = min({0, 1, 2} - {names}) if width > 2 else None
    found: dict[str, tuple[list[float], list[float]]] = {}
    heading = "Time"
    for _, cells in _rows(path, dialect):
        if len(cells) != width or not dialect.is_value(cells[-1 if names < width - 1 else 1]):
            heading = cells[clock or 0] if len(cells) == width and clock is not None else heading
            continue
        times, values = found.setdefault(cells[names], ([], []))
        if clock is not None:
            times.append(_number(dialect, cells[clock]))
        values.append(_number(dialect, cells[-1 if names < width - 1 else 1]))
    how = f"{dialect}, a value in each row"
    if clock is None:
        length = min(len(values) for _, values in found.values())
        arrays = [np.array(values[:length]) for _, values in found.values()]
        columns = make_columns(found, arrays, [None] * len(found))
        return Table(str(path), columns, how, header=header, period_s=stated_period(header))
    columns = merged(_series(found), heading, None)
    return Table(str(path), columns, how, header=header)


def _series(found: dict[str, tuple[list[float], list[float]]]) -> list[Series]:
    documents.check_size("columns", len(found), documents.MOST_COLUMNS)
    made = []
    for name, (times, values) in found.items():
        stamps, first = np.unique(np.array(times), return_index=True)
        made.append(Series(name, None, stamps, np.array(values)[first]))
    return made


@dataclass
class _Block:
    """One table of a stack, with the rows of text above it."""

    head: list[list[str]]
    numbers: list[list[float]] = field(default_factory=list)

    @property
    def width(self) -> int:
        return len(self.numbers[0])

    def headings(self) -> list[str]:
        fits = [cells for cells in self.head if len(cells) == self.width]
        return fits[-1] if fits else []

    def titles(self) -> list[str]:
        """Texts above that may name the table: the last cell of each row, the nearest first."""
        return [cells[-1].strip() for cells in reversed(self.head) if cells != self.headings()]

    def unit(self) -> str | None:
        stated = {cells[0].strip(" :#").lower(): cells[-1] for cells in self.head if len(cells) > 1}
        texts = [stated[key] for key in _UNIT_KEYS if key in stated]
        return next((text for text in texts if known_unit(text)), None)


def read_stacked(path: Path, dialect: Dialect) -> Table | None:
    """Read a table for each variable, one above the other; None where the file is none of these.

    The first column of each is its clock.

    Raises
    ------
    TooLargeError
    """
    blocks = _blocks(path, dialect)
    if len(blocks) < 2 or any(block.width < 2 for block in blocks):
        return None
    clocks = {tuple(block.headings()[:1]) for block in blocks}
    times = [np.array([row[0] for row in block.numbers]) for block in blocks]
    if len(clocks) > 1 or not all(np.all(np.diff(time) > 0.0) for time in times):
        return None
    names = _names(blocks)
    if names is None:
        return None
    documents.check_size("columns", len(names), documents.MOST_COLUMNS)
    series = [
        Series(names[k, c], block.unit(), time, np.array([row[c] for row in block.numbers]))
        for k, (block, time) in enumerate(zip(blocks, times, strict=True))
        for c in range(1, block.width)
    ]
    (clock,) = clocks
    columns: tuple[Column, ...] = merged(series, "".join(clock) or "Time", None)
    return Table(str(path), columns, f"{dialect}, {len(blocks)} tables, one above the other")


def _blocks(path: Path, dialect: Dialect) -> list[_Block]:
    blocks: list[_Block] = []
    head: list[list[str]] = []
    current: _Block | None = None
    for _, cells in _rows(path, dialect):
        cells = cells[:-1] if len(cells) > 1 and not cells[-1] else cells
        is_row = len(cells) > 1 and all(map(dialect.is_value, cells)) and bool(cells[0])
        if is_row and current is not None and current.numbers and len(cells) != current.width:
            return []
        if is_row:
            if current is None:
                current, head = _Block(head), []
                blocks.append(current)
            current.numbers.append([_number(dialect, cell) for cell in cells])
        else:
            current = None
            head.append(cells)
    return [block for block in blocks if len(block.numbers) > 1]


def _names(blocks: Sequence[_Block]) -> dict[tuple[int, int], str] | None:
    """A name for each column but the clocks: its heading, or what above a table only it has."""
    headings = {
        (k, c): block.headings()[c] if block.headings() else ""
        for k, block in enumerate(blocks)
        for c in range(1, block.width)
    }
    if len(set(headings.values())) == len(headings) and all(headings.values()):
        return headings
    for titles in zip(*(block.titles() for block in blocks), strict=False):
        named = [title.partition("=")[2].strip() or title for title in titles]
        named = [title.partition(": ")[2].strip() or title for title in named]
        if len(set(named)) == len(blocks) and not any(known_unit(title) for title in named):
            alone = all(block.width == _SHORT for block in blocks)
            return {
                (k, c): named[k] + _unit_of(text) if alone else f"{named[k]}.{text}"
                for (k, c), text in headings.items()
            }
    return None


def _unit_of(heading: str) -> str:
    """The unit in brackets that a heading such as `Value [mm]` ends with."""
    start = max(heading.rfind("["), heading.rfind("("))
    return f" {heading[start:]}" if start >= 0 and known_unit(heading[start + 1 : -1]) else ""


def _rows(path: Path, dialect: Dialect) -> Iterator[Row]:
    """All rows that hold anything."""
    cells = 0
    with open_text(path, dialect.encoding) as file:
        for number, line in enumerate(lines_of(file), start=1):
            if line.strip():
                row = dialect.cells(line.rstrip("\n"))
                cells += len(row)
                documents.check_size("cells", cells, documents.MOST_CELLS)
                yield number, row


def _number(dialect: Dialect, cell: str) -> float:
    """The number in a cell, or the seconds of a time of day; NaN where there is none."""
    if dialect.is_stamp(cell):
        return seconds_of_stamp(cell)
    if not dialect.is_number(cell):
        return np.nan
    return float(cell.replace(",", ".") if dialect.decimal == "comma" else cell)


# Where a table stops being one: the first bad cell, in words that help.


def bad_cell(path: Path, dialect: Dialect, layout: Layout) -> DataError:
    """Find the first row that is no row of the table, and say what is wrong with it."""
    width = len(layout.headings)
    with open_text(path, dialect.encoding) as file:
        for row, line in enumerate(lines_of(file), start=1):
            if row < layout.first_row or not line.strip():
                continue
            cells = dialect.all_cells(line.rstrip("\n"))
            cells = cells[:-1] if layout.open_end and not cells[-1] else cells
            where = f"{path}, row {row}"
            if len(cells) > 1 and not any(map(dialect.is_number_anyhow, cells)):
                return DataError(
                    f"{where}: text again ({', '.join(map(words.brief, cells[:3]))}), where the "
                    "table goes on: a second table begins",
                    "keep one table in the file",
                )
            if len(cells) != width:
                return DataError(
                    f"{where}: {len(cells)} values but {width} column names",
                    "give every row one value per column",
                )
            for c in layout.numeric:
                if not dialect.is_value(cells[c]):
                    return _bad(where, layout.headings[c], cells[c], dialect)
    return DataError(f"{path}: not a table of numbers", "see --delimiter and --decimal")


def _bad(where: str, heading: str, cell: str, dialect: Dialect) -> DataError:
    what = f"{where}, column {heading}: {words.brief(cell)} is not a number"
    if dialect.is_number_anyhow(cell):
        what += f" with a decimal {dialect.decimal}, as the rows before are written"
    return DataError(what, "correct the cell, or remove the row")
