"""What the first screen says of one axis."""

from dataclasses import dataclass, field
from typing import Final, Literal

from markupsafe import Markup

from edge_ident.report.page.chart import Chart

PICTURE_HEIGHT: Final = 310
"""Pixels of the first screen's picture, beside the text."""

Status = Literal["good", "found", "open"]
"""Nothing to do, something found, something that is not understood."""
Row = tuple[Markup | str, ...]


@dataclass(frozen=True)
class Table:
    """A table with a caption; the first cell of each row is its heading."""

    caption: str
    headings: tuple[str, ...]
    rows: list[Row]


@dataclass(frozen=True)
class Card:
    """The first screen's part of one axis.

    Attributes
    ----------
    axis : str
    status : Status
    label : str
        The status in a word or two.
    verdict : Markup
        One or two sentences of everyday words.
    terms : str
        The same in the field's terms.
    sure, part, action : list of Markup
        How sure that is and what it means, where to look, what to do next.
    chart : Chart
    written : list of Markup
        What a run changed on the board.
    table : Table or None
    """

    axis: str
    status: Status
    label: str
    verdict: Markup
    terms: str
    sure: list[Markup]
    part: list[Markup]
    action: list[Markup]
    chart: Chart
    written: list[Markup] = field(default_factory=list)
    table: Table | None = None


@dataclass(frozen=True)
class IntervalRow:
    """One line.

    Attributes
    ----------
    unit, value : str
        What stands before the picture, and behind it.
    picture : Markup
    stands_out : bool
    """

    unit: str
    value: str
    picture: Markup
    stands_out: bool


@dataclass(frozen=True)
class IntervalPicture:
    """Values with their intervals, a line each, on one scale.

    Attributes
    ----------
    key, title : str
        Unique in the page; what is compared.
    rows : list of IntervalRow
    ends : (str, str)
        What the left and the right end of the pictures stand for.
    spread : str
        How the units scatter, or how to read it.
    """

    key: str
    title: str
    rows: list[IntervalRow]
    ends: tuple[str, str]
    spread: str
