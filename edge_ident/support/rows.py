"""Results as tables and figures: as a data frame takes them, and as a person sees them."""

from collections.abc import Iterable, Mapping, Sequence
from io import StringIO
from typing import TYPE_CHECKING

from edge_ident.errors import DataError

if TYPE_CHECKING:
    from matplotlib.figure import Figure
    from rich.console import Console, RenderableType

    from edge_ident.support.console import FittingTable

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

    from edge_ident.support.console import FittingTable

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


# Results that a terminal and a notebook show as tables.

_WIDTH = 100  # characters of a line of text; tables are as wide as they need
_HTML = '<pre style="white-space:pre;line-height:normal">{code}</pre>'


class Readable:
    """What has `__rich__` also gets text and HTML from it.

    rich is loaded when something is shown, and not before.
    """

    def __rich__(self) -> "RenderableType":
        """The result as rich shows it."""
        raise NotImplementedError

    def __str__(self) -> str:
        lines = self._printed().export_text().splitlines()
        return "\n".join(line.rstrip() for line in lines).rstrip()

    def __repr__(self) -> str:
        return str(self)

    def _repr_html_(self) -> str:
        return self._printed().export_html(code_format=_HTML, inline_styles=True)

    def _printed(self) -> "Console":
        from edge_ident.support.console import VisibleConsole

        console = VisibleConsole(StringIO(), width=_WIDTH, record=True)
        console.print(self)
        return console


# Empty figures; matplotlib is loaded for the first one.


def new_figure(width_in: float, height_in: float) -> "Figure":
    """Make an empty figure that belongs to no window; a notebook shows it as it is.

    Raises
    ------
    DataError
        matplotlib is not installed.
    """
    try:
        from matplotlib.figure import Figure
    except ImportError as error:
        raise DataError(
            "drawing needs matplotlib", "install it with: pip install 'edge-ident[report]'"
        ) from error

    class ShownFigure(Figure):
        def _repr_png_(self) -> bytes:
            from io import BytesIO

            content = BytesIO()
            self.savefig(content, format="png")
            return content.getvalue()

    return ShownFigure(figsize=(width_in, height_in), layout="constrained")
