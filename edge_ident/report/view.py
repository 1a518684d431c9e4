"""The view of a result: what is to be shown of it, as data. Renderers show it in one place each.

A terminal and a notebook show lines and tables by `edge_ident.report.render`, a page by its
templates; charts are SVG by themselves, and pictures by `edge_ident.report.render`.
"""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final, Literal

from edge_ident.support.rows import Cell
from edge_ident.support.rows import Table as Columns

if TYPE_CHECKING:
    from edge_ident.report.chart import Chart

Tone = Literal["", "strong", "good", "doubt", "bad"]


@dataclass(frozen=True)
class Line:
    """A line of text.

    Attributes
    ----------
    said : str
    label : str
        What it is about; empty for none.
    tone : Tone
        Of the label; of all of it where there is none.
    between : str
        Stands between the label and what is said.
    """

    said: str
    label: str = ""
    tone: Tone = ""
    between: str = ": "

    def __str__(self) -> str:
        return f"{self.label}{self.between}{self.said}" if self.label else self.said


def below(said: str) -> Line:
    """A line about what the line above it is about."""
    return Line(f"  {said}")


Row = Sequence[str | Line]


@dataclass(frozen=True)
class Grid:
    """A table; the first cell of each row is its heading.

    Attributes
    ----------
    caption : str
        Above it.
    headings : tuple of str
    rows : list of sequence of str or Line
    note : str
        Below it.
    plain : bool
        Whether a terminal draws no lines but one below the headings.
    """

    caption: str
    headings: tuple[str, ...]
    rows: Sequence[Row]
    note: str = ""
    plain: bool = False


Part = Line | Grid
Parts = tuple[Part, ...]
"""Lines and tables, one below the other."""


@dataclass(frozen=True)
class ResultView:
    """What is to be shown of a kind of result.

    Attributes
    ----------
    table : callable
        Makes of a result the table that a data frame takes.
    parts : callable
        What is printed, one below the other.
    charts : callable
        Rows of charts.
    """

    table: Callable[[Any], Columns]
    parts: Callable[[Any], Iterable[Part]]
    charts: "Callable[[Any], Sequence[Sequence[Chart]]]" = lambda result: ()


_DIGITS: Final = 4


def grid_of(columns: Columns, caption: str) -> Grid:
    """A table for a data frame as one to read: numbers have four digits."""
    rows = [[_text(cell) for cell in row] for row in zip(*columns.values(), strict=True)]
    return Grid(caption, tuple(name.replace("_", " ") for name in columns), rows)


def _text(cell: Cell) -> str:
    if cell is None:
        return "–"
    return f"{cell:.{_DIGITS}g}" if isinstance(cell, float) else str(cell)


def next_lines(steps: Iterable[str]) -> Iterable[Line]:
    """What to do next, a line for each step."""
    return (Line(step, "next", "strong") for step in steps)
