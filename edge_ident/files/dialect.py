"""How a text file writes its table, and where in the file the table lies."""

import codecs
import csv
import math
import re
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from datetime import date
from functools import cache
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray

from edge_ident.errors import DataError
from edge_ident.files.opening import open_bytes
from edge_ident.files.units import known_unit

# How a text file writes its table: encoding, delimiter and decimal sign, decided by evidence.
#
# Every way to read the head of the file is tried, and the one that finds the most numbers counts. A
# way that leaves several numbers in one cell does not.

BLANKS: Final = " "
"""Delimiter that stands for any run of blanks."""
DELIMITERS: Final = {"comma": ",", "semicolon": ";", "tab": "\t", "blanks": BLANKS}
DECIMALS: Final = {"point": ".", "comma": ","}
_HEAD_BYTES: Final = 1 << 17
_HEAD_LINES: Final = 1000
_NUMBERS: Final = {
    "point": re.compile(r"[-+]?(?:\d+(?:\.\d*)?|\.\d+)(?:[eE][-+]?\d+)?"),
    "comma": re.compile(r"[-+]?(?:\d+(?:,\d+)?|,\d+)(?:[eE][-+]?\d+)?"),
}
BLANK: Final = r"(?:-+|n/?a|#n/?a|null|none)?"
"""What stands in a cell that holds nothing."""
_MISSING: Final = re.compile(rf"{BLANK}|[-+]?(?:nan|inf)", re.IGNORECASE)
_DAY: Final = r"(?:\d{4}-\d\d?-\d\d?|\d{4}/\d\d?/\d\d?|\d\d?\.\d\d?\.\d{4})"
# A date with its time of day, or a time of day: ISO 8601, and as it is written in German.
_STAMP: Final = re.compile(
    rf"(?:(?P<day>{_DAY})[T ]\s*)?(?P<hour>\d\d?):(?P<minute>\d\d):(?P<second>\d\d)"
    r"(?:[.,:](?P<part>\d{1,9}))?\s*(?:Z|UTC|[-+]\d\d:?\d\d)?"
)
DAY_S: Final = 86400.0
# Cells between blanks; a unit in brackets belongs to the heading before it.
_WORDS: Final = re.compile(r'"[^"]*"|[^\s\[(]+(?:\s*[\[(][^\[\]()]*[\])])?|\S+')
# Numbers with a delimiter between them.
_SEVERAL: Final = re.compile(r"[-+\d.eE]*\d[;, \t][-+ ]*[.\d][-+\d.,; \teE]*")
_FEW: Final = 0.1  # share of cells that may hold several numbers: those of bad rows
_THOUSANDS: Final = re.compile(r"[-+]?[1-9]\d{0,2},\d{3}")
# Share of numbers among the cells, below which a way to read a file finds no table.
_LEAST: Final = 0.3
_BOMS: Final = (
    (codecs.BOM_UTF8, "utf-8-sig"),
    (codecs.BOM_UTF16_LE, "utf-16"),
    (codecs.BOM_UTF16_BE, "utf-16"),
)
_TWO_BYTES: Final = ("cp932", "gb18030")
_CONTROLS: Final = re.compile(rb"[\x81\x83\x84\x86-\x90\x98\x9a-\x9f]")
"""Bytes without a sign in Latin-1, but for quotes and dashes that Windows puts there."""
_WORDS_BEYOND: Final = re.compile(rb"[\xa1-\xff]{3,}")
"""Words without a letter of ASCII."""
_WORD_OF_TWO: Final = re.compile("[\u3040-\u30ff\u4e00-\u9fff]{2}")
"""Two characters of Chinese or Japanese, one after the other."""
_NAMES: Final = {
    "utf-8-sig": "UTF-8 with BOM",
    "utf-8": "UTF-8",
    "utf-16": "UTF-16",
    "utf-16-le": "UTF-16",
    "utf-16-be": "UTF-16",
    "latin-1": "Latin-1",
    "cp932": "Shift JIS",
    "gb18030": "GB 18030",
    "cp1251": "Windows-1251",
}


@dataclass(frozen=True)
class Dialect:
    """How a text file writes numbers.

    Attributes
    ----------
    encoding : str
        Python's name.
    delimiter, decimal : str
        Keys of `DELIMITERS` and `DECIMALS`.
    """

    encoding: str
    delimiter: str
    decimal: str

    def __str__(self) -> str:
        return f"delimiter {self.delimiter}, decimal {self.decimal}, {_NAMES[self.encoding]}"

    def cells(self, line: str) -> list[str]:
        """The cells of a line; an empty one at its end is a delimiter too many."""
        cells = self.all_cells(line)
        return cells[:-1] if len(cells) > 1 and not cells[-1] else cells

    def all_cells(self, line: str) -> list[str]:
        """The cells of a line as they stand there."""
        return split(line, DELIMITERS[self.delimiter])

    def is_number(self, cell: str) -> bool:
        """Whether a cell holds a number in this way of writing."""
        return _NUMBERS[self.decimal].fullmatch(cell) is not None

    def is_value(self, cell: str) -> bool:
        """Whether a cell holds a number or a time of day, or says that there is none."""
        return self.is_number(cell) or _MISSING.fullmatch(cell) is not None or self.is_stamp(cell)

    def is_stamp(self, cell: str) -> bool:
        """Whether a cell holds a time of day, with its date or without."""
        return _STAMP.fullmatch(cell) is not None

    def is_number_anyhow(self, cell: str) -> bool:
        """Whether a cell is a number with either decimal sign."""
        return any(number.fullmatch(cell) for number in _NUMBERS.values())


def split(line: str, delimiter: str) -> list[str]:
    """Cut a line into cells; quotes keep what they hold together."""
    if '"' in line and delimiter != BLANKS:
        cells = next(csv.reader([line], delimiter=delimiter, skipinitialspace=True), [])
    elif delimiter == BLANKS:
        cells = _WORDS.findall(line)
    else:
        cells = line.split(delimiter)
    return [cell.strip().strip('"') for cell in cells]


def seconds_of_stamp(cell: str) -> float:
    """Seconds of a time of day, since 1970 where it has its date; NaN of an empty cell.

    Raises
    ------
    ValueError
        It is none.
    """
    match = _STAMP.fullmatch(cell.strip().strip('"'))
    if match is None:
        if _MISSING.fullmatch(cell.strip()):
            return math.nan
        raise ValueError(f"{cell} is no time")
    part = match["part"]
    seconds = 3600.0 * int(match["hour"]) + 60.0 * int(match["minute"]) + int(match["second"])
    seconds += int(part) / 10.0 ** len(part) if part else 0.0
    return seconds + (DAY_S * _day_number(match["day"]) if match["day"] else 0.0)


def since_first(times: NDArray[np.float64]) -> None:
    """Count times of day from the first on, past midnight too."""
    known = ~np.isnan(times)
    if not np.any(known):
        return
    times -= times[known][0]
    days = np.cumsum(np.diff(times[known], prepend=0.0) < -0.5 * DAY_S)
    times[known] += DAY_S * days


@cache
def _day_number(text: str) -> int:
    first, month, last = (int(word) for word in re.split(r"\D", text))
    year, day = (last, first) if "." in text else (first, last)
    return (date(year, month, day) - date(1970, 1, 1)).days


def read_head(path: Path) -> tuple[str, list[str]]:
    """Encoding and first lines of a text file.

    Raises
    ------
    DataError
        The file is empty, or not text.
    """
    with open_bytes(path) as file:
        head = file.read(_HEAD_BYTES)
        whole = not file.read(1)
    if not head.strip():
        raise DataError(f"{path}: the file is empty", "give a file with a recording in it")
    encoding = _encoding(path, head)
    text = codecs.getincrementaldecoder(encoding)("replace").decode(head)
    if text.lstrip().startswith("<"):
        raise DataError(
            f"{path}: an XML or HTML document, such as a trace as its own program keeps it",
            "export the trace from that program as text or CSV, and give that file",
        )
    lines = text.splitlines()
    return encoding, (lines if whole else lines[:-1])[:_HEAD_LINES]


def _encoding(path: Path, head: bytes) -> str:
    for bom, encoding in _BOMS:
        if head.startswith(bom):
            return encoding
    zeros = [head[start::2].count(0) / (len(head[start::2]) or 1) for start in (0, 1)]
    if max(zeros) > 0.9 and min(zeros) < 0.1:
        return "utf-16-le" if zeros[1] > zeros[0] else "utf-16-be"
    if any(byte < 32 and byte not in b"\t\n\r\f\v\x1a" for byte in head):
        raise DataError(
            f"{path}: not a text file",
            "edge-ident reads text tables, .npz, .mat, .h5, .tdms, .parquet, .xlsx, .bag, .db3 and "
            ".mcap, by the ending of the name",
        )
    try:
        codecs.getincrementaldecoder("utf-8")().decode(head)
    except UnicodeDecodeError:
        return _of_bytes(head)
    return "utf-8"


def _of_bytes(head: bytes) -> str:
    """The encoding of text that is no UTF-8: Latin-1, unless its words are others.

    Letters of two bytes put control characters, or signs within words, where Latin-1 has letters;
    in Latin-1, three letters with an accent never follow each other, as Cyrillic ones do.
    """
    words = _WORDS_BEYOND.findall(head)
    if _CONTROLS.search(head) or any(re.search(rb"[\xa1-\xbf]", word) for word in words):
        for encoding in _TWO_BYTES:
            try:
                text = codecs.getincrementaldecoder(encoding)().decode(head)
            except UnicodeDecodeError:
                continue
            if _WORD_OF_TWO.search(text):
                return encoding
        return "latin-1"
    return "cp1251" if words else "latin-1"


def find_dialect(
    path: Path, lines: Sequence[str], encoding: str, delimiter: str | None, decimal: str | None
) -> Dialect:
    """Decide between the ways to read a file.

    Parameters
    ----------
    path : Path
    lines : sequence of str
        Head of the file.
    encoding : str
    delimiter, decimal : str or None
        What the user says; the rest is found out.

    Raises
    ------
    DataError
        No way finds a table, or a comma may be one of thousands.
    """
    tried = [
        Dialect(encoding, separator, sign)
        for separator in ([delimiter] if delimiter else DELIMITERS)
        for sign in ([decimal] if decimal else DECIMALS)
        if not separator == sign == "comma" or any('"' in line for line in lines)
    ]
    scored = sorted(((_score(way, lines), way) for way in tried), key=lambda s: -s[0])
    best, chosen = scored[0] if scored else (0.0, None)
    if chosen is None or best <= (_LEAST if delimiter is None else 0.0):
        alone = [any(number.fullmatch(line.strip()) for number in _NUMBERS.values())
                 for line in lines[1:]]  # fmt: skip
        if alone and all(alone):
            raise DataError(
                f"{path}: it has one column of numbers, and an axis needs a position and an effort",
                "record both, side by side, with the time or at a constant rate",
            )
        raise DataError(
            f"{path}: no table of numbers found",
            "a row holds at least two numbers with a comma, semicolon, tab or blanks between, and "
            "no thousands separators; for a table of mostly text, say --delimiter and --decimal",
        )
    if decimal is None and _may_be_thousands(chosen, lines):
        raise DataError(
            f"{path}: every comma has one to three digits before it and three behind: a decimal "
            "sign, or one of thousands?",
            "if it is the decimal sign, say --decimal comma; otherwise export without it",
        )
    return chosen


def width_of(dialect: Dialect, rows: Sequence[Sequence[str]]) -> int:
    """Cells of most rows that hold a number; 0 where none has two cells."""
    widths = Counter(
        len(cells)
        for cells in rows
        if len(cells) > 1 and any(dialect.is_number(cell) for cell in cells)
    )
    return widths.most_common(1)[0][0] if widths else 0


def _score(dialect: Dialect, lines: Sequence[str]) -> float:
    """Share of numbers among the cells of rows of the usual width that hold any.

    Where cells hold several numbers, this is not how the file is written.
    """
    rows = [dialect.cells(line) for line in lines if line.strip()]
    width = width_of(dialect, rows)
    usual = [row for row in rows if len(row) == width and any(map(dialect.is_number_anyhow, row))]
    cells = [cell for row in usual for cell in row]
    numbers = sum(dialect.is_number(cell) for cell in cells)
    several = sum(_SEVERAL.fullmatch(c) is not None for c in cells if not dialect.is_number(c))
    return numbers / len(cells) if numbers >= 2 and several < _FEW * len(cells) else 0.0


def _may_be_thousands(dialect: Dialect, lines: Sequence[str]) -> bool:
    """Whether no number tells a decimal comma from a separator of thousands."""
    if dialect.decimal != "comma":
        return False
    cells = [c for line in lines for c in dialect.cells(line) if dialect.is_number(c) and "," in c]
    return bool(cells) and all(map(_THOUSANDS.fullmatch, cells))


# Where the table lies in a file: what stands before it, its headings, its units, its first row.
#
# Rows are given as cells, so that text files and spreadsheets are laid out alike.

Row = tuple[int, list[str]]
"""Number of a row in its file, from 1, and its cells."""
# What separates two words of a key, where the first has taken all underscores.
_BETWEEN: Final = r"(?:[\s-][\s_-]*)?"
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
# First cells of rows that name a channel in each column, as TwinCAT Scope writes them.
_KEYS_OF_CHANNELS: Final = ("Name", "SymbolName")
# First cells of such rows, in lower case; one of them stands right above the numbers.
_KEYS: Final = frozenset({
    "name", "symbolname", "symbolcomment", "symbolbased", "data-type", "sampletime[ms]", "offset",
    "variablesize", "indexgroup", "indexoffset", "netid", "port", "scalefactor", "bitmask",
    "unit", "unit scalefactor", "unit offset", "starttime", "endtime",
})  # fmt: skip
_FEWEST_OF_CHANNELS: Final = 3  # columns of two channels with their time


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
