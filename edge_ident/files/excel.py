"""The first sheet of an .xlsx file."""

from collections.abc import Iterable, Iterator
from datetime import date, time, timedelta
from pathlib import Path
from typing import Final

import numpy as np

from edge_ident.errors import DataError
from edge_ident.files.dialect import (
    Dialect,
    Layout,
    lay_out,
    seconds_of_stamp,
    since_first,
    stated_period,
    width_of,
)
from edge_ident.files.opening import needed, open_archive, reading, refuse_document_types
from edge_ident.files.table import Table, make_columns
from edge_ident.support.documents import MOST_CELLS, MOST_COLUMNS, check_size, check_table
from edge_ident.support.words import brief

_MOST_ROWS: Final = 1 << 20  # of a sheet, in every program that writes them
_WRITTEN: Final = Dialect("utf-8", "tab", "point")  # how cells that are numbers become text


def read_xlsx(path: Path) -> Table:
    """Read the table on the first sheet.

    Raises
    ------
    DataError
        The file is damaged, openpyxl is missing, there is no table, or it has a bad cell.
    TooLargeError
    """
    openpyxl = needed("openpyxl", "xlsx", str(path))
    with reading(str(path), ".xlsx"):
        with open_archive(path) as archive:
            refuse_document_types(archive)
        sheet = openpyxl.load_workbook(path, read_only=True, data_only=True).worksheets[0]
        sheet.reset_dimensions()  # what a file states of them is often a whole sheet
        title = str(sheet.title)
        rows = list(_rows(sheet.iter_rows(values_only=True)))
    width = width_of(_WRITTEN, [row for _, row in rows])
    check_table(width, len(rows))
    layout = lay_out(str(path), rows, width, _WRITTEN.is_value)
    table = [(i, row) for i, row in rows if i >= layout.first_row]
    values = np.array([_values(path, layout, number, row) for number, row in table]).T
    values = np.ascontiguousarray(values)
    stamps = [c for c in layout.numeric if any(_is_stamp(row, c) for _, row in table)]
    for place, c in enumerate(layout.numeric):
        if c in stamps:
            since_first(values[place])
    columns = make_columns(
        (layout.headings[c] for c in layout.numeric),
        values,
        ("s" if c in stamps else layout.units[c] for c in layout.numeric),
        sparse=True,
    )
    period_s = stated_period(layout.header)
    return Table(
        str(path), columns, f"sheet {title}, {layout}", layout.first_row, layout.header,
        period_s=period_s,
    )  # fmt: skip


def _values(path: Path, layout: Layout, number: int, row: list[str]) -> list[float]:
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
                f"{path}, row {number}, column {layout.headings[c]}: {brief(cell)} is not a number",
                "correct the cell, or remove the row",
            )
        if _WRITTEN.is_number(cell):
            values.append(float(cell))
        elif _WRITTEN.is_stamp(cell):
            values.append(seconds_of_stamp(cell))
        else:
            values.append(np.inf if "nan" in cell.lower() or "inf" in cell.lower() else np.nan)
    return values


def _is_stamp(row: list[str], c: int) -> bool:
    return c < len(row) and _WRITTEN.is_stamp(row[c])


def _rows(given: Iterable[tuple[object, ...]]) -> Iterator[tuple[int, list[str]]]:
    """Rows that hold anything, by their number, without the empty cells at their end."""
    cells = 0
    for number, row in enumerate(given, start=1):
        check_size("rows", number, _MOST_ROWS)
        if not row:
            continue
        cells += len(row)
        check_size("cells", cells, MOST_CELLS)
        held = [_text(cell) for cell in row]
        while held and not held[-1]:
            held.pop()
        if held:
            check_size("columns", len(held), MOST_COLUMNS)
            yield number, held


def _text(cell: object) -> str:
    if cell is None or isinstance(cell, date | time | timedelta):
        return "" if cell is None else str(cell)
    return repr(cell) if isinstance(cell, int | float) else str(cell).strip()
