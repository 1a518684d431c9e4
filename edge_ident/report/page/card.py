"""What the first screen says of one axis, with its numbers and everyday words."""

from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Final, Literal

from markupsafe import Markup, escape

from edge_ident.report.chart import Chart
from edge_ident.report.numbers import digits
from edge_ident.report.view import Grid
from edge_ident.support.words import listed

# Every number of the first screen names its place in the JSON document (RFC 6901), so a script can
# check the page.

_MILLI_BELOW: Final = 0.1
_FLAG: Final = ": --motion "


def pointer(*keys: str | int) -> str:
    """The place of a value in a JSON document."""
    parts = (str(key).replace("~", "~0").replace("/", "~1") for key in keys)
    return "".join(f"/{part}" for part in parts)


def number(value: float, text: str, *keys: str | int) -> Markup:
    """A number as text, with its value and its place in the document."""
    return Markup('<data value="{}" data-of="{}">{}</data>').format(
        repr(float(value)), pointer(*keys), text
    )


def percent(share: float, *keys: str | int) -> Markup:
    """A share in percent, to two digits."""
    return number(share, f"{digits(100.0 * share, 2)}\u00a0%", *keys)


def angle(value: float, *keys: str | int) -> Markup:
    """A length of arc in rad, or in mrad where it is small."""
    if abs(value) < _MILLI_BELOW:
        return number(value, f"{digits(1e3 * value, 3)}\u00a0mrad", *keys)
    return number(value, f"{digits(value, 3)}\u00a0rad", *keys)


def recorded(experiment: str) -> Markup:
    """A motion to record, in words for those with a board and those without."""
    motion, flag, name = experiment.partition(_FLAG)
    if not flag:
        return escape(experiment)
    return Markup(
        "{} (with a board: <code class='long'>edge-ident capture --motion {}</code>)"
    ).format(motion, name)


def all_of(parts: Iterable[str | Markup]) -> Markup:
    """Items as a, b and c, escaped where they are plain text."""
    return Markup(listed(str(escape(part)) for part in parts))


def counted(count: int) -> str:
    """A small number as a word."""
    words = ("no", "one", "two", "three", "four", "five", "six")
    return words[count] if count < len(words) else "several"


# What the first screen says of one axis.

PICTURE_HEIGHT: Final = 310
"""Pixels of the first screen's picture, beside the text."""

Status = Literal["good", "found", "open"]
"""Nothing to do, something found, something that is not understood."""


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
    table : Grid or None
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
    table: Grid | None = None


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
