"""Files of programs that are no text: MATLAB's .mat, HDF5, LabVIEW's .tdms, Excel's .xlsx."""

import zlib
from collections import Counter
from collections.abc import Iterable, Iterator
from datetime import date, time, timedelta
from math import prod
from pathlib import Path
from typing import Any, BinaryIO, Final, Literal

import numpy as np
from numpy.typing import NDArray

from edge_ident.errors import DataError
from edge_ident.files import dialect, opening
from edge_ident.files.table import Table, make_columns, series
from edge_ident.support import documents, words

# MATLAB's files: .mat up to v7 through scipy, v7.3 and any other HDF5 through h5py.

Arrays = dict[str, NDArray[np.generic]]

_HDF5: Final = b"\x89HDF\r\n\x1a\n"
_USER_BLOCK: Final = 512  # bytes that MATLAB writes before the HDF5 part of a v7.3 file


def read_mat(path: Path) -> Table:
    """Read the vectors of a .mat file of any version; those in structs are called `struct.field`.

    Raises
    ------
    DataError
        The file is damaged, its package is missing, or it holds no two vectors of one length.
    TooLargeError
    """
    with path.open("rb") as file:
        start = file.read(_USER_BLOCK + len(_HDF5))
    if start.startswith(_HDF5) or start.endswith(_HDF5):
        return read_hdf5(path)
    io = opening.needed("scipy.io", "mat", str(path))
    with opening.reading(str(path), ".mat"):
        check_mat(path)
        held = io.loadmat(path, simplify_cells=True)
        arrays = {name: array for key, value in held.items() if not key.startswith("__")
                  for name, array in _vectors(key, value)}  # fmt: skip
    return series(str(path), arrays, "MATLAB v5 to v7")


def _vectors(name: str, value: Any) -> Iterator[tuple[str, NDArray[np.generic]]]:
    """Arrays of a variable, with those of its fields."""
    if isinstance(value, dict):
        for key, inner in value.items():
            yield from _vectors(f"{name}.{key}", inner)
    elif isinstance(value, list) or (isinstance(value, np.ndarray) and value.dtype == object):
        for i, inner in enumerate(value, start=1):
            yield from _vectors(f"{name}.{i}", inner)
    elif isinstance(value, np.ndarray) and value.size > 1:
        yield name, value


def read_hdf5(path: Path) -> Table:
    """Read the vectors of an HDF5 file; those in groups are called `group.name`.

    An attribute `unit` or `units` of a vector is its unit.

    Raises
    ------
    DataError
        As `read_mat`.
    """
    h5py = opening.needed("h5py", "mat", str(path))
    arrays: Arrays = {}
    sizes: list[int] = []

    def take(name: str, item: Any) -> None:
        if not isinstance(item, h5py.Dataset) or name.startswith("#") or item.size < 2:
            return
        sizes.append(max(item.size, item.nbytes // np.dtype(np.float64).itemsize))
        documents.check_size("columns", len(sizes), documents.MOST_COLUMNS)
        documents.check_size("numbers", sum(sizes), documents.MOST_NUMBERS)
        unit = item.attrs.get("unit", item.attrs.get("units", ""))
        unit = unit.decode() if isinstance(unit, bytes) else str(unit)
        heading = name.replace("/", ".") + (f" [{unit}]" if unit else "")
        if "MATLAB_class" not in item.attrs or item.attrs["MATLAB_class"] != b"char":
            arrays[heading] = item[()]

    with opening.reading(str(path), "HDF5"), h5py.File(path, "r") as file:
        file.visititems(take)
    return series(str(path), arrays, "HDF5")


# LabVIEW's .tdms files.


def read_tdms(path: Path) -> Table:
    """Read the channels of a .tdms file, with their units and the period of their waveforms.

    A channel is called by its own name, or `group.channel` where two groups have it.

    Raises
    ------
    DataError
        The file is damaged, npTDMS is missing, or no two channels have the same length.
    TooLargeError
    """
    nptdms = opening.needed("nptdms", "tdms", str(path))
    arrays: dict[str, NDArray[np.generic]] = {}
    periods = set()
    with opening.reading(str(path), ".tdms"), nptdms.TdmsFile.open(path) as file:
        channels = [channel for group in file.groups() for channel in group.channels()]
        documents.check_size("columns", len(channels), documents.MOST_COLUMNS)
        documents.check_size("numbers", sum(map(len, channels)), documents.MOST_NUMBERS)
        often = Counter(channel.name for channel in channels)
        for channel in channels:
            unit = channel.properties.get("unit_string", "")
            alone = often[channel.name] == 1
            name = channel.name if alone else f"{channel.group_name}.{channel.name}"
            arrays[name + (f" [{unit}]" if unit else "")] = np.asarray(channel[:])
            periods.add(float(channel.properties.get("wf_increment", 0.0)))
    table = series(str(path), arrays, "TDMS")
    stated = periods.pop() if len(periods) == 1 else 0.0
    return Table(**(vars(table) | {"period_s": stated or None}))


# What a .mat file of version 5 to 7 states and unpacks to, counted before it is read.
#
# Its reader makes room for as many elements as an array states, follows arrays in arrays as deep as
# they go, and unpacks what zlib has packed. Source: MathWorks, MAT-File Format, version 5.

_HEADER: Final = 128
_MATRIX: Final = 14
_COMPRESSED: Final = 15
_CELL: Final = 1
_STRUCT: Final = 2
_OBJECT: Final = 3
_SPARSE: Final = 5  # classes of arrays; a sparse one has room for what it holds only
_PART_BYTES: Final = 1 << 16


def check_mat(path: Path) -> None:
    """Walk through the arrays of a file, and count them.

    Raises
    ------
    ValueError
        An array has more or fewer elements than it states.
    TooLargeError
    """
    with path.open("rb") as file:
        header = file.read(_HEADER)
        if len(header) < _HEADER or 0 in header[:4]:
            return  # version 4: its reader takes what is there
        _Walk(header[126:128] == b"IM").file(file)


class _Walk:
    """Counts what all arrays of a file state."""

    def __init__(self, little: bool) -> None:
        self._order: Literal["little", "big"] = "little" if little else "big"
        self._numbers = self._arrays = self._unpacked = 0

    def file(self, file: BinaryIO) -> None:
        while len(tag := file.read(8)) == 8:
            kind, length = self._whole(tag[:4]), self._whole(tag[4:])
            end = file.tell() + length
            if kind == _COMPRESSED:
                inner = _Bytes(_unpacked(file, length))
                kind, length = self._whole(inner.take(4)), self._whole(inner.take(4))
                self._unpacked += length
                documents.check_size("bytes unpacked", self._unpacked, documents.MOST_BYTES)
            else:
                inner = _Bytes(_parts(file, length))
            if kind != _MATRIX:
                raise ValueError(f"what should be an array is an element of type {kind}")
            self._matrix(inner, length, documents.DEEPEST)
            file.seek(end)

    def _matrix(self, data: "_Bytes", length: int, levels: int) -> None:
        if not levels:
            raise documents.TooLargeError(
                f"it is nested too deeply: at most {documents.DEEPEST} levels are read"
            )
        self._arrays += 1
        documents.check_size("arrays", self._arrays, documents.MOST_CELLS // 10)
        end = data.taken + length
        if not length:
            return
        kind = self._whole(self._element(data, end)[:4]) & 0xFF
        dimensions = self._element(data, end)
        stated = prod(self._whole(dimensions[i : i + 4]) for i in range(0, len(dimensions), 4))
        self._element(data, end)  # the name
        if kind == _OBJECT:
            self._element(data, end)
        if kind in (_STRUCT, _OBJECT):
            width = self._whole(self._element(data, end))
            stated *= len(self._element(data, end)) // max(width, 1)
        self._numbers += 0 if kind == _SPARSE else stated
        documents.check_size("numbers", self._numbers, documents.MOST_NUMBERS)
        inside = 0
        while end - data.taken >= 8:
            of, size = self._tag(data)
            if size > end - data.taken:
                raise ValueError("an array is longer than what holds it")
            if of == _MATRIX:
                inside += 1
                self._matrix(data, size, levels - 1)
            else:
                data.skip(min(size + -size % 8, end - data.taken))
        data.skip(max(end - data.taken, 0))
        if kind in (_CELL, _STRUCT, _OBJECT) and inside != stated:
            raise ValueError(f"an array states {stated} elements and has {inside}")

    def _tag(self, data: "_Bytes") -> tuple[int, int]:
        """Kind and length of what follows; of an element of four bytes or less, nothing does."""
        first = self._whole(data.take(4))
        if first >> 16:
            data.skip(4)
            return first & 0xFFFF, 0
        return first, self._whole(data.take(4))

    def _element(self, data: "_Bytes", end: int) -> bytes:
        first = self._whole(data.take(4))
        if short := first >> 16:
            return data.take(4)[:short]
        size = self._whole(data.take(4))
        documents.check_size("bytes in a name", size, _PART_BYTES)
        if size > end - data.taken:
            raise ValueError("a name is longer than what holds it")
        return data.take(size + -size % 8)[:size]

    def _whole(self, four: bytes) -> int:
        return int.from_bytes(four, self._order)


class _Bytes:
    """Bytes that come in parts."""

    def __init__(self, parts: Iterator[bytes]) -> None:
        self._parts, self._held, self._at = parts, b"", 0
        self.taken = 0

    def take(self, count: int) -> bytes:
        while len(self._held) - self._at < count:
            self._held, self._at = self._held[self._at :] + self._next(), 0
        self._at += count
        self.taken += count
        return self._held[self._at - count : self._at]

    def skip(self, count: int) -> None:
        self.taken += count
        while len(self._held) - self._at < count:
            count -= len(self._held) - self._at
            self._held, self._at = self._next(), 0
        self._at += count

    def _next(self) -> bytes:
        part = next(self._parts, b"")
        if not part:
            raise ValueError("it ends in an array")
        return part


def _parts(file: BinaryIO, length: int) -> Iterator[bytes]:
    while length > 0 and (part := file.read(min(length, _PART_BYTES))):
        length -= len(part)
        yield part


def _unpacked(file: BinaryIO, length: int) -> Iterator[bytes]:
    unpack = zlib.decompressobj()
    for part in _parts(file, length):
        while part:
            if made := unpack.decompress(part, _PART_BYTES):
                yield made
            part = unpack.unconsumed_tail
    if made := unpack.flush():
        yield made


# The first sheet of an .xlsx file that holds a table.


_MOST_ROWS: Final = 1 << 20  # of a sheet, in every program that writes them
_WRITTEN: Final = dialect.Dialect("utf-8", "tab", "point")  # how cells that are numbers become text


def read_xlsx(path: Path) -> Table:
    """Read the first sheet that holds a table.

    Raises
    ------
    DataError
        The file is damaged, openpyxl is missing, there is no table, or it has a bad cell.
    TooLargeError
    """
    openpyxl = opening.needed("openpyxl", "xlsx", str(path))
    with opening.reading(str(path), ".xlsx"):
        with opening.open_archive(path) as archive:
            opening.refuse_document_types(archive)
        sheets = openpyxl.load_workbook(path, read_only=True, data_only=True).worksheets
        title, rows, layout = _laid_out(path, sheets)
    table = [(i, row) for i, row in rows if i >= layout.first_row]
    values = np.array([_values(path, layout, number, row) for number, row in table]).T
    values = np.ascontiguousarray(values)
    stamps = [c for c in layout.numeric if any(_is_stamp(row, c) for _, row in table)]
    for place, c in enumerate(layout.numeric):
        if c in stamps:
            dialect.since_first(values[place])
    columns = make_columns(
        (layout.headings[c] for c in layout.numeric),
        values,
        ("s" if c in stamps else layout.units[c] for c in layout.numeric),
        sparse=True,
    )
    period_s = dialect.stated_period(layout.header)
    return Table(
        str(path), columns, f"sheet {title}, {layout}", layout.first_row, layout.header,
        period_s=period_s,
    )  # fmt: skip


def _laid_out(
    path: Path, sheets: Iterable[Any]
) -> tuple[str, list[tuple[int, list[str]]], dialect.Layout]:
    """Title, rows and layout of the first sheet that holds a table."""
    refused: list[DataError] = []
    for sheet in sheets:
        sheet.reset_dimensions()  # what a file states of them is often a whole sheet
        rows = list(_rows(sheet.iter_rows(values_only=True)))
        width = dialect.width_of(_WRITTEN, [row for _, row in rows])
        documents.check_table(width, len(rows))
        source = f"{path}, sheet {sheet.title}"
        try:
            return str(sheet.title), rows, dialect.lay_out(source, rows, width, _WRITTEN.is_value)
        except DataError as error:
            refused.append(error)
    raise refused[0]


def _values(path: Path, layout: dialect.Layout, number: int, row: list[str]) -> list[float]:
    """The numbers of a row; NaN for an empty cell, and infinity for one that is none.

    Raises
    ------
    DataError
        A cell is text.
    """
    values = []
    for c in layout.numeric:
        cell = row[c] if c < len(row) else ""
        if not _WRITTEN.is_value(cell):
            raise DataError(
                f"{path}, row {number}, column {layout.headings[c]}: {words.brief(cell)} is not a "
                "number",
                "correct the cell, or remove the row",
            )
        if _WRITTEN.is_number(cell):
            values.append(float(cell))
        elif _WRITTEN.is_stamp(cell):
            values.append(dialect.seconds_of_stamp(cell))
        else:
            values.append(np.inf if "nan" in cell.lower() or "inf" in cell.lower() else np.nan)
    return values


def _is_stamp(row: list[str], c: int) -> bool:
    return c < len(row) and _WRITTEN.is_stamp(row[c])


def _rows(given: Iterable[tuple[object, ...]]) -> Iterator[tuple[int, list[str]]]:
    """Rows that hold anything, by their number, without the empty cells at their end."""
    cells = 0
    for number, row in enumerate(given, start=1):
        documents.check_size("rows", number, _MOST_ROWS)
        if not row:
            continue
        cells += len(row)
        documents.check_size("cells", cells, documents.MOST_CELLS)
        held = [_text(cell) for cell in row]
        while held and not held[-1]:
            held.pop()
        if held:
            documents.check_size("columns", len(held), documents.MOST_COLUMNS)
            yield number, held


def _text(cell: object) -> str:
    if cell is None or isinstance(cell, date | time | timedelta):
        return "" if cell is None else str(cell)
    return repr(cell) if isinstance(cell, int | float) else str(cell).strip()
