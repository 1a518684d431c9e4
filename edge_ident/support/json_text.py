"""JSON as every document of this project is written and read."""

import json
import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from edge_ident.support.atomic_files import atomic_write


def to_json(document: Mapping[str, Any]) -> str:
    """One document, readable and with numbers that any parser takes (no NaN)."""
    return json.dumps(document, indent=2, allow_nan=False, ensure_ascii=False)


def from_json(text: str | bytes) -> Any:
    """What a document says.

    Raises
    ------
    ValueError
        It is no JSON, or too deeply nested.
    """
    try:
        return json.loads(text)
    except RecursionError as error:
        raise ValueError("it is too deeply nested") from error


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
        partial.write_text(to_json(document) + "\n", encoding="utf-8")


def finite(value: float) -> float | None:
    """JSON has no infinity."""
    return value if math.isfinite(value) else None
