"""Text in which names stand beside or above their values, instead of in one row of headings.

Pairs: every row repeats the name before each value, as LinuxCNC's halscope writes. Long: every row
is one value, with its name and mostly its time. Stacked: each variable has a table of its own, as
traces of CODESYS have. The last two have a clock for each variable.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray

from edge_ident.files.clocks import Series, merged
from edge_ident.files.dialect import Dialect, seconds_of_stamp
from edge_ident.files.layout import stated_in, stated_period
from edge_ident.files.opening import lines_of, open_text
from edge_ident.files.table import Column, Table, make_columns
from edge_ident.files.units import known_unit
from edge_ident.support.limits import MOST_CELLS, MOST_COLUMNS, check_size

Array = NDArray[np.float64]
Row = tuple[int, list[str]]

_SCOPE: Final = "Sampling period is"
"""What halscope's log begins with. It writes one row more than it has samples."""
_FEWEST: Final = 3
"""Rows that show a form."""
_UNIT_KEYS: Final = ("unit", "einheit", "units")
_SHORT: Final = 2
"""Cells of a row that is a title."""


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
    if not 1 < len(held) <= MOST_COLUMNS or 2 * len(held) > len(rows):
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
    check_size("columns", len(found), MOST_COLUMNS)
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
    check_size("columns", len(names), MOST_COLUMNS)
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
                check_size("cells", cells, MOST_CELLS)
                yield number, row


def _number(dialect: Dialect, cell: str) -> float:
    """The number in a cell, or the seconds of a time of day; NaN where there is none."""
    if dialect.is_stamp(cell):
        return seconds_of_stamp(cell)
    if not dialect.is_number(cell):
        return np.nan
    return float(cell.replace(",", ".") if dialect.decimal == "comma" else cell)
