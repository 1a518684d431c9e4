"""Where a table stops being one: the first bad cell, in words that help."""

from pathlib import Path

from edge_ident.errors import DataError
from edge_ident.files.dialect import Dialect
from edge_ident.files.layout import Layout
from edge_ident.files.opening import lines_of, open_text
from edge_ident.support.visible_text import brief


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
                    f"{where}: text again ({', '.join(map(brief, cells[:3]))}), where the table "
                    "goes on: a second table begins",
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
    what = f"{where}, column {heading}: {brief(cell)} is not a number"
    if dialect.is_number_anyhow(cell):
        what += f" with a decimal {dialect.decimal}, as the rows before are written"
    return DataError(what, "correct the cell, or remove the row")
