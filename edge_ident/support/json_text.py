"""JSON as every document of this project is written."""

import json
import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from edge_ident.support.atomic_files import atomic_write


def to_json(document: Mapping[str, Any]) -> str:
    """One document, readable and with numbers that any parser takes (no NaN)."""
    return json.dumps(document, indent=2, allow_nan=False, ensure_ascii=False)


def write_json(document: Mapping[str, Any], path: Path) -> None:
    """Write a document atomically, with the folders that lead to it."""
    with atomic_write(path) as partial:
        partial.write_text(to_json(document) + "\n", encoding="utf-8")


def finite(value: float) -> float | None:
    """JSON has no infinity."""
    return value if math.isfinite(value) else None
