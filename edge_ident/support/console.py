"""How a terminal shows results: tables as wide as it is, and names escaped."""

import sys
from collections.abc import Iterable, Iterator, Sequence
from typing import IO, Any, Final

from rich.box import SIMPLE_HEAD
from rich.cells import cell_len
from rich.console import Console, ConsoleOptions, RenderableType, RenderResult
from rich.measure import Measurement
from rich.segment import Segment
from rich.table import Table
from rich.text import Text

from edge_ident.support.process import raw
from edge_ident.support.words import visible

# The console that results are drawn on: names are escaped before they are laid out.


class VisibleConsole(Console):
    """A console on which names from files are text, and nothing but what it draws itself acts.

    A word between colons is no emoji.

    Parameters
    ----------
    file : file, optional
        Default: standard output, with `stderr` that for messages.
    stderr : bool
    **more
        As rich has them.
    """

    def __init__(self, file: IO[str] | None = None, *, stderr: bool = False, **more: Any) -> None:
        where = file or raw(sys.stderr if stderr else sys.stdout)
        super().__init__(file=where, emoji=False, highlight=False, **more)

    def render_str(self, text: str, **more: Any) -> Text:
        """Make text, which may have marks of style, of a string."""
        return super().render_str(visible(text), **more)

    def render(
        self, renderable: RenderableType, options: ConsoleOptions | None = None
    ) -> Iterable[Segment]:
        """Render anything; a text that would act on the terminal loses its styles."""
        if isinstance(renderable, Text) and (seen := visible(renderable.plain)) != renderable.plain:
            renderable = Text(seen, justify=renderable.justify, end=renderable.end)
        return super().render(renderable, options)


# Tables that are readable in a narrow terminal.

_UNLIMITED: Final = 10_000


class FittingTable(Table):
    """A table that never cuts a word, so that a number stays whole.

    Where there is little room, cells break between words. Where that is not enough, each row
    becomes a list of its headings and cells.
    """

    def __rich_console__(self, console: Console, options: ConsoleOptions) -> RenderResult:
        for column in self.columns:
            column.width, column.overflow = None, "fold"
        wanted = Measurement.get(console, options.update(width=_UNLIMITED), self).maximum
        excess = wanted - options.max_width
        if excess > 0:
            columns = [self._lines(index) for index in range(len(self.columns))]
            widths = _narrowed(columns, excess)
            if widths is None:
                yield from self._as_lists(columns)
                return
            for column, width in zip(self.columns, widths, strict=True):
                column.width = width
        yield from super().__rich_console__(console, options)

    def _lines(self, index: int) -> list[list[str]]:
        """The lines of every cell of a column, its heading first."""
        column = self.columns[index]
        return [_plain(cell).split("\n") for cell in (column.header, *column.cells)]

    def _as_lists(self, columns: Sequence[list[list[str]]]) -> Iterator[Text]:
        if self.title:
            yield Text(_plain(self.title), style="italic")
        headings, *rows = zip(*columns, strict=True)
        for first, *cells in rows:
            yield Text(" ".join(first), style="bold")
            for heading, cell in zip(headings[1:], cells, strict=True):
                yield Text(f"  {' '.join(heading).replace('- ', '-')}: {' '.join(cell)}")


def plain_table() -> FittingTable:
    """A table with a line below its headings and nothing at its sides."""
    return FittingTable(box=SIMPLE_HEAD, padding=(0, 2, 0, 0), pad_edge=False)


def _plain(cell: object) -> str:
    return visible(
        Text.from_markup(cell, emoji=False).plain if isinstance(cell, str) else str(cell)
    )


def _narrowed(columns: Sequence[list[list[str]]], excess: int) -> list[int] | None:
    """Widths that are smaller by the excess, the widest first; None where words do not fit."""
    lines = [[line for cell in column for line in cell] for column in columns]
    widths = [max(map(cell_len, of_column)) for of_column in lines]
    least = [
        max((cell_len(word) for line in of_column for word in line.split()), default=0)
        for of_column in lines
    ]
    for _ in range(excess):
        free = [index for index, width in enumerate(widths) if width > least[index]]
        if not free:
            return None
        widths[max(free, key=lambda index: widths[index])] -= 1
    return widths
