"""Names and lists as people write them."""

from collections.abc import Iterable


def spoken(effect: str) -> str:
    """An effect's name in words."""
    return effect.replace("_", " ")


def listed(items: Iterable[str]) -> str:
    """Join items as a, b and c; empty for no item."""
    *first, last = list(items) or [""]
    return f"{', '.join(first)} and {last}" if first else last
