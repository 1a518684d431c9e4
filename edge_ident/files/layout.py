"""Where the table lies in a file: what stands before it, its headings, its units, its first row.

Rows are given as cells, so that text files and spreadsheets are laid out alike.
"""

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Final

from edge_ident.errors import DataError
from edge_ident.files.units import known_unit

Row = tuple[int, list[str]]
"""Number of a row in its file, from 1, and its cells."""
_BETWEEN: Final = r"(?:[\s-][\s_-]*)?"
"""What separates two words of a key, where the first has taken all underscores."""
_PERIOD_KEY: Final = re.compile(
    rf"\W*(?:(?:sampl|abtast|zyklus)\w*|(?:cycle|scan)_*){_BETWEEN}"
    r"(?:time|period|interval|zeit|intervall?)?",
    re.IGNORECASE,
)
_RATE_KEY: Final = re.compile(
    rf"\W*(?:sampl|abtast)\w*{_BETWEEN}(?:rate|frequency|frequenz)", re.IGNORECASE
)
_VALUE: Final = re.compile(r"(?P<number>[-+]?\d+(?:[.,]\d+)?(?:[eE][-+]?\d+)?)(?P<unit>\D*)")
_HERTZ: Final = {"Hz": 1.0, "kHz": 1e3}
_KEYS_OF_CHANNELS: Final = ("Name", "SymbolName")
"""First cells of rows that name a channel in each column, as TwinCAT Scope writes them."""
_KEYS: Final = frozenset({
    "name", "symbolname", "symbolcomment", "symbolbased", "data-type", "sampletime[ms]", "offset",
    "variablesize", "indexgroup", "indexoffset", "netid", "port", "scalefactor", "bitmask",
    "unit", "unit scalefactor", "unit offset", "starttime", "endtime",
})  # fmt: skip
"""First cells of such rows, in lower case; one of them stands right above the numbers."""
_FEWEST_OF_CHANNELS: Final = 3
"""Columns of two channels with their time."""


@dataclass(frozen=True)
class Layout:
    """Where a table lies.

    Attributes
    ----------
    first_row, heading_row, unit_row : int
        Rows of the file, from 1; 0 where there is none.
    headings : tuple of str
    units : tuple of str or None
    numeric : tuple of int
        Columns that hold numbers.
    header : mapping of str to str
        What the lines before the table state.
    open_end : bool
        Whether rows end with a delimiter.
    stamps : tuple of int
        Columns of these that hold times of day.
    """

    first_row: int
    heading_row: int
    unit_row: int
    headings: tuple[str, ...]
    units: tuple[str | None, ...]
    numeric: tuple[int, ...]
    header: Mapping[str, str]
    open_end: bool = False
    stamps: tuple[int, ...] = ()

    def __str__(self) -> str:
        said = f"headings in row {self.heading_row}" if self.heading_row else "no headings"
        return said + (f", units in row {self.unit_row}" if self.unit_row else "")


def lay_out(
    source: str, rows: Sequence[Row], width: int, is_value: Callable[[str], bool]
) -> Layout:
    """Find the table in the first rows of a file.

    Parameters
    ----------
    source : str
    rows : sequence of (number, cells)
        Rows that are not empty.
    width : int
        Cells of a row of the table.
    is_value : callable
        Whether a cell is a number, or says that one is missing.

    Raises
    ------
    DataError
        Headings and values differ in number, or fewer than two columns hold numbers.
    """
    usual = [cells for _, cells in rows if len(cells) == width]
    usual = [cells for cells in usual if any(cell and is_value(cell) for cell in cells)]
    numbers = [
        sum(bool(cell) and is_value(cell) for cell in column) for column in zip(*usual, strict=True)
    ]
    written = [sum(map(bool, column)) for column in zip(*usual, strict=True)]
    numeric = tuple(c for c in range(width) if numbers[c] and 2 * numbers[c] >= written[c])
    if len(numeric) < 2:
        raise DataError(
            f"{source}: only {len(numeric)} column holds numbers",
            "a recording has at least a position and an effort; see --delimiter and --decimal",
        )
    first = _first_of_table(rows, width, numeric, is_value)
    before = [(number, cells) for number, cells in rows[:first] if any(cells)]
    channels = _channels(before, width)
    if channels is not None:
        heading_row, headings, units = channels
        return Layout(rows[first][0], heading_row, 0, headings, units, numeric, stated_in(before))
    unit_row, units = _unit_row(before, width)
    if unit_row:
        before = before[:-1]
    heading_row, headings = _headings(source, before, width)
    header = stated_in([row for row in before if row[0] != heading_row])
    return Layout(rows[first][0], heading_row, unit_row, headings, units, numeric, header)


def _first_of_table(
    rows: Sequence[Row], width: int, numeric: Sequence[int], is_value: Callable[[str], bool]
) -> int:
    """Index of the first row of numbers; a bad cell in it does not make it a heading."""

    def of_table(cells: Sequence[str]) -> bool:
        return len(cells) == width and all(is_value(cells[c]) for c in numeric)

    first = next(
        (
            i
            for i in range(len(rows))
            if of_table(rows[i][1]) and (i + 1 == len(rows) or of_table(rows[i + 1][1]))
        ),
        next((i for i in range(len(rows)) if of_table(rows[i][1])), 0),
    )
    while first > 0 and _nearly(rows[first - 1][1], is_value):
        first -= 1
    return first


def _nearly(cells: Sequence[str], is_value: Callable[[str], bool]) -> bool:
    """Whether most cells of a row are numbers, and it does not begin with a key."""
    if len(cells) < 2 or cells[0].lower() in _KEYS:
        return False
    return sum(bool(c) and is_value(c) for c in cells) > 0.5 * len(cells)


def _unit_row(before: Sequence[Row], width: int) -> tuple[int, tuple[str | None, ...]]:
    """Units in a row of their own below the headings."""
    none: tuple[str | None, ...] = (None,) * width
    if len(before) < 2 or not len(before[-1][1]) <= width == len(before[-2][1]):
        return 0, none
    number, cells = before[-1]
    texts = [cell.strip("[](){} ") for cell in cells] + [""] * (width - len(cells))
    others = [text for text in texts if text.strip("-1") and not known_unit(text)]
    if others or not any(known_unit(text) for text in texts):
        return 0, none
    return number, tuple(text if known_unit(text) else None for text in texts)


def _headings(source: str, before: Sequence[Row], width: int) -> tuple[int, tuple[str, ...]]:
    if not before or len(before[-1][1]) < 2:
        return 0, tuple(f"column_{c}" for c in range(1, width + 1))
    number, cells = before[-1]
    if cells[0][:1] in "#%" and len(cells) == width + 1 and not cells[0].strip("#% "):
        cells = cells[1:]
    if len(cells) != width:
        raise DataError(
            f"{source}: {width} values per row but {len(cells)} column names",
            f"check the header in row {number}; if a comma is both delimiter and decimal sign, "
            "export the file again, or say --delimiter and --decimal",
        )
    return number, (cells[0].lstrip("#% "), *cells[1:])


def _channels(
    before: Sequence[Row], width: int
) -> tuple[int, tuple[str, ...], tuple[str | None, ...]] | None:
    """Rows of a key and what it is for each channel; the key stands above each column of time."""
    if width < _FEWEST_OF_CHANNELS or not before or before[-1][1][0].lower() not in _KEYS:
        return None
    named = {cells[0]: (number, cells) for number, cells in before if len(cells) == width}
    row = next((named[key] for key in _KEYS_OF_CHANNELS if key in named), None)
    if row is None:
        return None
    number, cells = row
    headings = tuple("Time" if cell == cells[0] else cell for cell in cells)
    units = [text.partition(" (")[0] for text in named.get("Unit", (0, ["Unit"] * width))[1]]
    return number, headings, tuple(u if known_unit(u) else None for u in units)


def stated_in(before: Sequence[Row]) -> dict[str, str]:
    """What the lines before the table state: a key and a value in two cells, or `key = value`."""
    stated = {}
    for _, cells in before:
        pair = _pair(cells[0]) if len(cells) == 1 or not any(cells[1:]) else None
        if pair:
            stated[pair[0]] = pair[1]
        elif len(cells) > 1 and cells[0]:
            stated[cells[0].strip("#%: ")] = cells[1]
    return stated


def _pair(text: str) -> tuple[str, str] | None:
    """The two sides of `key = value` or `key: value`."""
    before, *behind = re.split(r"[=:]|\sis\s", text, maxsplit=1)
    key, value = before.lstrip("#% \t").rstrip(), "".join(behind).strip()
    return (key, value) if key and value else None


def stated_period(header: Mapping[str, str]) -> float | None:
    """Sampling period in seconds that a header states with its unit, None where it states none."""
    for key, text in header.items():
        name, _, unit = key.partition("[") if "[" in key else key.partition("(")
        value = _VALUE.fullmatch(text.strip())
        if value is None:
            continue
        number = float(value["number"].replace(",", "."))
        unit = unit.strip("]) ") or value["unit"].strip()
        if _RATE_KEY.fullmatch(name.strip()) and unit in _HERTZ and number > 0.0:
            return 1.0 / (number * _HERTZ[unit])
        known = known_unit(unit)
        of_time = known is not None and known.base == "s"
        if known and of_time and _PERIOD_KEY.fullmatch(name.strip()) and number > 0.0:
            return number * known.factor
    return None
