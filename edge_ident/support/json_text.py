"""JSON as every document of this project is written and read."""

import json
import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final

from edge_ident.support.atomic_files import atomic_write
from edge_ident.support.limits import (
    MOST_CHARACTERS,
    MOST_DESCRIPTION_BYTES,
    check_document,
    check_size,
    read_document,
)
from edge_ident.support.visible_text import visible

NOT_TEXT: Final = "backslashreplace"
"""What becomes of the bytes of a file's name that are no text; JSON reads it back."""


def to_json(document: Mapping[str, Any]) -> str:
    """One document, readable, of numbers that any parser takes (no NaN); all of it is visible."""
    return visible(json.dumps(document, indent=2, allow_nan=False, ensure_ascii=False))


def from_json(text: str | bytes) -> Any:
    """What a document says.

    Raises
    ------
    ValueError
        It is no JSON, says one thing twice, or is more than `edge_ident.support.limits` allow.
    """
    try:
        document = json.loads(text, object_pairs_hook=_each_once, parse_int=_whole)
    except RecursionError as error:
        raise ValueError("it is too deeply nested") from error
    return check_document(document)


def _each_once(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    """An object; of two values of one name, nobody knows which is meant."""
    found: dict[str, Any] = {}
    for name, value in pairs:
        if name in found:
            raise ValueError(f"it has {name!r:.60} twice in one place")
        found[name] = value
    return found


def _whole(digits: str) -> int:
    """An integer; Python refuses to read thousands of digits, in words that do not help here."""
    check_size("digits in an integer", len(digits), MOST_CHARACTERS)
    return int(digits)


def read_json(path: Path) -> Any:
    """What a file says.

    Raises
    ------
    OSError
    ValueError
        As `from_json`, or it is too large or no UTF-8.
    """
    return from_json(read_document(path))


def write_json(document: Mapping[str, Any], path: Path) -> None:
    """Write a document atomically, with the folders that lead to it."""
    with atomic_write(path) as partial:
        partial.write_text(to_json(document) + "\n", encoding="utf-8", errors=NOT_TEXT)


def finite(value: float) -> float | None:
    """JSON has no infinity."""
    return value if math.isfinite(value) else None


# TOML as it is read here, from files that a person may have got from anybody.


def from_toml(text: str) -> dict[str, Any]:
    """What a text says.

    Raises
    ------
    ValueError
        It is no TOML, or more than `edge_ident.support.limits` allow.
    """
    import tomllib  # most users have no settings

    check_size("characters", len(text), MOST_DESCRIPTION_BYTES)
    longest = max(map(len, text.splitlines()), default=0)
    check_size("characters in a line", longest, MOST_CHARACTERS)  # the parser's time is its square
    try:
        document: dict[str, Any] = check_document(tomllib.loads(text))
    except RecursionError as error:
        raise ValueError("it is nested too deeply") from error
    return document
