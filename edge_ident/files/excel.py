"""The first sheet of an .xlsx file."""

from datetime import date, time, timedelta
from pathlib import Path
from typing import Final
from zipfile import BadZipFile

import numpy as np

from edge_ident.errors import DataError
from edge_ident.files.dialect import Dialect, width_of
from edge_ident.files.extras import needed, unreadable
from edge_ident.files.layout import lay_out, stated_period
from edge_ident.files.table import Table, make_columns

_WRITTEN: Final = Dialect("utf-8", "tab", "point")
"""How cells that are numbers become text."""


def read_xlsx(path: Path) -> Table:
    """Read the table on the first sheet.

    Raises
    ------
    DataError
        The file is damaged, openpyxl is missing, there is no table, or it has a bad cell.
    """
    openpyxl = needed("openpyxl", "xlsx", str(path))
    try:
        sheet = openpyxl.load_workbook(path, read_only=True, data_only=True).worksheets[0]
        cells = [[_text(cell) for cell in row] for row in sheet.iter_rows(values_only=True)]
    except (OSError, ValueError, KeyError, IndexError, BadZipFile) as error:
        raise unreadable(str(path), ".xlsx", error) from error
    rows = [(i, _cut(row)) for i, row in enumerate(cells, start=1) if any(row)]
    width = width_of(_WRITTEN, [row for _, row in rows])
    layout = lay_out(str(path), rows, width, _WRITTEN.is_value)
    table = [(i, row) for i, row in rows if i >= layout.first_row]
    for number, row in table:
        for c in layout.numeric:
            if c >= len(row) or not row[c] or not _WRITTEN.is_value(row[c]):
                raise DataError(
                    f"{path}, row {number}, column {layout.headings[c]}: "
                    f"{row[c] if c < len(row) else ''!r} is not a number",
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
        str(path), columns, f"sheet {sheet.title}, {layout}", layout.first_row, layout.header,
        period_s=period_s,
    )  # fmt: skip


def _text(cell: object) -> str:
    if cell is None or isinstance(cell, date | time | timedelta):
        return "" if cell is None else str(cell)
    return repr(cell) if isinstance(cell, int | float) else str(cell).strip()


def _cut(row: list[str]) -> list[str]:
    """A row without the empty cells at its end."""
    while row and not row[-1]:
        row = row[:-1]
    return row
