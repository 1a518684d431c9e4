"""Where results go: the terminal, by rich, and a picture."""

import re
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Final

from rich.console import Group, RenderableType
from rich.markup import escape
from rich.text import Text

from edge_ident.report.view import Grid, Line, Part, Tone
from edge_ident.support.console import FittingTable, VisibleConsole, plain_table
from edge_ident.support.documents import atomic_write

if TYPE_CHECKING:
    from matplotlib.figure import Figure


_RESOLUTION_DPI: Final = 120


class _Console(VisibleConsole):
    """A console that leaves it to the command what a closed pipe means."""

    def on_broken_pipe(self) -> None:
        """Raise the error that is being handled, in the place of SystemExit."""
        raise


def show(result: RenderableType) -> None:
    """Print a result, or the view of one, on stdout; only for a terminal are lines broken."""
    console = _Console()
    if console.is_terminal:
        console.print(result, crop=False, overflow="fold")
    else:
        console.print(result, soft_wrap=True)


def save_figure(figure: "Figure", picture: Path) -> Path:
    """Write a figure, whole or not at all.

    Parameters
    ----------
    figure : Figure
    picture : Path
        A name that ends in .png, .svg or .pdf.

    Returns
    -------
    Path
        The picture.
    """
    with atomic_write(picture) as partial:
        figure.savefig(partial, dpi=_RESOLUTION_DPI)
    return picture


# Lines and tables of a view, by rich.

_STYLES: Final[dict[Tone, str]] = {
    "": "",
    "strong": "bold",
    "good": "bold green",
    "doubt": "yellow",
    "bad": "bold red",
}
_NUMBER: Final = re.compile(r"(?:by up to |[-−+×/±] ?)?\d[^,]*")
"""What a cell is that stands at the right."""


def rendered(parts: Iterable[Part]) -> Group:
    """Lines and tables, one below the other."""
    return Group(*(_text(part) if isinstance(part, Line) else _table(part) for part in parts))


def _text(line: Line) -> Text:
    style = _STYLES[line.tone]
    if not line.label:
        return Text(line.said, style)
    return Text.assemble((line.label, style), f"{line.between}{line.said}")


def _table(grid: Grid) -> FittingTable:
    table = plain_table() if grid.plain else FittingTable()
    table.title, table.title_justify = escape(grid.caption) or None, "left"
    table.caption, table.caption_justify = escape(grid.note) or None, "left"
    for place, heading in enumerate(grid.headings):
        right = place > 0 and _numbers([str(row[place]) for row in grid.rows])
        table.add_column(escape(heading), justify="right" if right else "left")
    for row in grid.rows:
        table.add_row(*(_text(cell) if isinstance(cell, Line) else escape(cell) for cell in row))
    return table


def _numbers(cells: Sequence[str]) -> bool:
    """Whether most cells of a column that say something are numbers."""
    said = [cell for cell in cells if cell not in ("", "–")]
    return 2 * sum(bool(_NUMBER.fullmatch(cell)) for cell in said) > len(said)
