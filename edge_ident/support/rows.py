"""Tables of any result, as a data frame takes them and as a person reads them."""

from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from edge_ident.support.tables import FittingTable

Cell = str | float | bool | None
Table = dict[str, list[Cell]]
"""Columns by name, of one length: what a data frame takes."""


def table_of(names: Sequence[str], rows: Iterable[Sequence[Cell]]) -> Table:
    """Columns of rows, each of which has one cell for every name."""
    every = list(rows)
    return {name: [row[index] for row in every] for index, name in enumerate(names)}


def shown(table: Mapping[str, Sequence[Cell]], title: str) -> "FittingTable":
    """The same as rich shows it, numbers with four digits."""
    from rich.markup import escape

    from edge_ident.support.tables import FittingTable

    view = FittingTable(title=escape(title), title_justify="left")
    for name, cells in table.items():
        numbers = any(isinstance(cell, float) for cell in cells)
        view.add_column(name.replace("_", " "), justify="right" if numbers else "left")
    for row in zip(*table.values(), strict=True):
        view.add_row(*(escape(_text(cell)) for cell in row))
    return view


def _text(cell: Cell) -> str:
    if cell is None:
        return "–"
    return f"{cell:.4g}" if isinstance(cell, float) else str(cell)
