"""Names, lists and numbers as people write them."""

from collections.abc import Iterable


def spoken(effect: str) -> str:
    """An effect's name in words."""
    return effect.replace("_", " ")


def listed(items: Iterable[str]) -> str:
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
