"""Names, lists and numbers as people write them, and text that is safe to show."""

import math

TYPE_CHECKING = False  # the script's start loads this module before all others
if TYPE_CHECKING:
    from collections.abc import Iterable
    from typing import Any


def spoken(effect: str) -> str:
    """An effect's name in words."""
    return effect.replace("_", " ")


def listed(items: "Iterable[str]") -> str:
    """Join items as a, b and c; empty for no item."""
    *first, last = list(items) or [""]
    return f"{', '.join(first)} and {last}" if first else last


def plain_number(text: str) -> float:
    """A number as a person writes it: Python would leave an underscore out, and 0_5 would be 5.

    Raises
    ------
    ValueError
    """
    if "_" in text:
        raise ValueError(f"{text!r} is not a number")
    return float(text)


# Deviation over value below which it is none of a measurement: a bound holds the value, or another
# number gives it.
_ROUNDING = 1e-6


def with_deviation(value: float, std: float | None) -> str:
    """A value to four digits, and its standard deviation where that says anything.

    Examples
    --------
    >>> with_deviation(-0.8094, 0.012), with_deviation(-0.8094, 5.9e-12)
    ('-0.8094 ± 0.012', '-0.8094')
    """
    if std is None or not math.isfinite(std) or std < _ROUNDING * abs(value):
        return f"{value:.4g}"
    return f"{value:.4g} ± {std:.2g}"


# Text as a terminal may show it: what acts on a terminal, or hides, is written as its number.
#
# The names in a file are whatever somebody wrote there: an escape sequence would move the cursor,
# set the window's title or ring, and marks of direction or of no width let a name pass for another
# one. Numbers are written as JSON writes them, so that a document stays one.

_KEPT = "\n\t"
_LONGEST = 60
_MOST_BITS = 10_000  # Python refuses to write integers of more than 4300 digits


def visible(text: str, kept: str = _KEPT) -> str:
    r"""Text with `\u001b` for an escape, and so for every character that is not seen.

    These are controls, marks of format and of direction, what is no character, and separators of
    lines and paragraphs (general categories C, Zl and Zp of Unicode).

    Parameters
    ----------
    text : str
    kept : str
        Controls that lay out the text.
    """
    plain = text
    for control in kept:
        plain = plain.replace(control, "")
    if plain.isprintable():
        return text
    return "".join(c if c.isprintable() or c in kept or _is_space(c) else escaped(c) for c in text)


def on_a_line(text: str) -> str:
    """Visible text without an end of line or a tab in it."""
    return visible(text, "")


def escaped(text: str) -> str:
    """All characters of a text as JSON may write them, in units of UTF-16."""
    units = text.encode("utf-16-be", "surrogatepass").hex()
    return "".join(f"\\u{units[i : i + 4]}" for i in range(0, len(units), 4))


def brief(value: "Any") -> str:
    """A value of a document as an error quotes it, whatever it is, on a part of a line."""
    if isinstance(value, dict | list):
        return f"{'an object' if isinstance(value, dict) else 'a list'} of {len(value)}"
    if isinstance(value, int) and value.bit_length() > _MOST_BITS:
        return f"a number of {value.bit_length()} bits"
    text = repr(value)
    return text if len(text) <= _LONGEST else f"{text[:_LONGEST]}…"


def _is_space(character: str) -> bool:
    from unicodedata import category  # few texts have any but the plain one

    return category(character) == "Zs"
