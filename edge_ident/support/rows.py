"""Results as tables: as a data frame takes them, and as a person sees them."""

from collections.abc import Iterable, Sequence
from io import StringIO
from typing import TYPE_CHECKING

from edge_ident.support.lazy import renderer, view_of

if TYPE_CHECKING:
    from matplotlib.figure import Figure
    from rich.console import Console, RenderableType


Cell = str | float | bool | None
Table = dict[str, list[Cell]]
"""Columns by name, of one length: what a data frame takes."""


def table_of(names: Sequence[str], rows: Iterable[Sequence[Cell]]) -> Table:
    """Columns of rows, each of which has one cell for every name."""
    every = list(rows)
    return {name: [row[index] for row in every] for index, name in enumerate(names)}


# Results that a terminal and a notebook show as tables, and that may draw themselves.

_WIDTH = 100  # characters of a line of text; tables are as wide as they need
_HTML = '<pre style="white-space:pre;line-height:normal">{code}</pre>'


class Readable:
    """A result that reads as text, as HTML and as a table.

    It is plain data: what is shown of it is its view (`edge_ident.report.view.ResultView`), whose
    module the public API names. rich is loaded when something is shown, and not before.
    """

    def table(self) -> Table:
        """The numbers of the result, one row for each.

        Returns
        -------
        mapping of column name to list
            What a data frame takes.
        """
        made: Table = view_of(self).table(self)
        return made

    def __rich__(self) -> "RenderableType":
        """The result as rich shows it."""
        made: RenderableType = renderer().rendered(view_of(self).parts(self))
        return made

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


class Drawable(Readable):
    """A result that draws itself, too."""

    def plot(self) -> "Figure":
        """Draw the result.

        Raises
        ------
        DataError
            matplotlib is not installed.
        """
        made: Figure = renderer().drawn(view_of(self).charts(self))
        return made
