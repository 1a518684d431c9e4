"""The first sheet of an .xlsx file."""

from collections.abc import Iterable, Iterator
from datetime import date, time, timedelta
from pathlib import Path
from typing import Final

import numpy as np

from edge_ident.errors import DataError
from edge_ident.files.archives import open_archive, refuse_document_types
from edge_ident.files.dialect import Dialect, width_of
from edge_ident.files.extras import needed, reading
from edge_ident.files.layout import lay_out, stated_period
from edge_ident.files.table import Table, make_columns
from edge_ident.support.limits import (
    MOST_CELLS,
    MOST_COLUMNS,
    check_size,
    check_table,
)
from edge_ident.support.visible_text import brief

_MOST_ROWS: Final = 1 << 20
"""Of a sheet, in every program that writes them."""
_WRITTEN: Final = Dialect("utf-8", "tab", "point")
"""How cells that are numbers become text."""


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
    for number, row in table:
        for c in layout.numeric:
            if c >= len(row) or not row[c] or not _WRITTEN.is_value(row[c]):
                raise DataError(
                    f"{path}, row {number}, column {layout.headings[c]}: "
                    f"{brief(row[c] if c < len(row) else '')} is not a number",
                    "correct the cell, or remove the row",
                )
    values = np.array([[float(row[c]) for c in layout.numeric] for _, row in table]).T
    columns = make_columns(
        (layout.headings[c] for c in layout.numeric),
        np.ascontiguousarray(values),
        (layout.units[c] for c in layout.numeric),
    )
    period_s = stated_period(layout.header)
    return Table(
        str(path), columns, f"sheet {title}, {layout}", layout.first_row, layout.header,
        period_s=period_s,
    )  # fmt: skip


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
