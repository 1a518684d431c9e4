"""What the first screen says of one axis, with its numbers and everyday words."""

import math
import re
from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Final, Literal

from markupsafe import Markup, escape

from edge_ident.report.page.chart import Chart
from edge_ident.report.parameters import decimals, interval_texts
from edge_ident.report.view import Grid
from edge_ident.support.words import listed

# Numbers and everyday words of the first screen.
#
# Every number there names its place in the JSON document (RFC 6901), so a script can check the
# page.

_EFFORT_WORDS: Final = {"N": "force", "N*m": "torque", "A": "current", "V": "voltage"}
_MILLI_BELOW: Final = 0.1
# A unit with a product or a square, as in N*m or kg*m^2.
_UNIT: Final = re.compile(r"\b[A-Za-z]+(?:\*[A-Za-z]+|\^2)[A-Za-z*^2/]*")
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


def digits(value: float, significant: int) -> str:
    """A value to so many significant digits, without an exponent where that can be read."""
    if value == 0.0 or not math.isfinite(value):
        return f"{value:g}"
    scientific = f"{value:.{significant - 1}e}"
    exponent = int(scientific.partition("e")[2])  # of the rounded value: 0.00999 may be 0.0100
    if not -4 <= exponent < 6:
        return minus(scientific)
    return minus(f"{value:.{max(0, significant - 1 - exponent)}f}")


def minus(text: str) -> str:
    """Text with a true minus sign."""
    return text.replace("-", "−")


def to_its_std(value: float, std: float) -> tuple[str, str]:
    """A value and its standard deviation, both to two digits of the deviation."""
    shown = decimals(std)
    return minus(f"{value:.{shown}f}"), f"{std:.{shown}f}"


def with_interval(value: float, std: float | None) -> str:
    """A value with its 95 % interval, to the digits that the deviation leaves."""
    texts = interval_texts(value, std)
    if texts is None:
        return digits(value, 4)
    return "{} ({}\u00a0to\u00a0{})".format(*map(minus, texts))


def unit_text(unit: str) -> str:
    """A unit as people write it."""
    if unit == "1":
        return ""
    return unit.replace("*", "·").replace("^2", "²")


def effort_word(unit: str) -> str:
    """What people call an effort of this unit."""
    return _EFFORT_WORDS.get(unit, "effort")


def sentence(text: str) -> str:
    """A part of a sentence as a whole one, units as people write them."""
    text = _UNIT.sub(lambda unit: unit_text(unit[0]), text)
    return f"{text[0].upper()}{text[1:]}" + ("" if text.endswith(".") else ".")


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
