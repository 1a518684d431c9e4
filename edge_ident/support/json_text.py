"""JSON as every document of this project is written and read."""

import json
import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final

from edge_ident.support.atomic_files import atomic_write

NOT_TEXT: Final = "backslashreplace"
"""What becomes of the bytes of a file's name that are no text; JSON reads it back."""


def to_json(document: Mapping[str, Any]) -> str:
    """One document, readable and with numbers that any parser takes (no NaN)."""
    return json.dumps(document, indent=2, allow_nan=False, ensure_ascii=False)


def from_json(text: str | bytes) -> Any:
    """What a document says.

    Raises
    ------
    ValueError
        It is no JSON, says one thing twice, or is too deeply nested.
    """
    try:
        return json.loads(text, object_pairs_hook=_each_once)
    except RecursionError as error:
        raise ValueError("it is too deeply nested") from error


def _each_once(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    """An object; of two values of one name, nobody knows which is meant."""
    found = dict(pairs)
    if len(found) < len(pairs):
        names = [name for name, _ in pairs]
        twice = next(name for name in names if names.count(name) > 1)
        raise ValueError(f"it has {twice!r} twice in one place")
    return found


def read_json(path: Path) -> Any:
    """What a file says.

    Raises
    ------
    OSError
    ValueError
        As `from_json`, or it is no UTF-8.
    """
    return from_json(path.read_text(encoding="utf-8"))


def write_json(document: Mapping[str, Any], path: Path) -> None:
    """Write a document atomically, with the folders that lead to it."""
    with atomic_write(path) as partial:
        partial.write_text(to_json(document) + "\n", encoding="utf-8", errors=NOT_TEXT)


def finite(value: float) -> float | None:
    """JSON has no infinity."""
    return value if math.isfinite(value) else None
