"""JSON as every document of this project is written."""

import json
from collections.abc import Mapping
from typing import Any


def to_json(document: Mapping[str, Any]) -> str:
    """One document, readable and with numbers that any parser takes (no NaN)."""
    return json.dumps(document, indent=2, allow_nan=False, ensure_ascii=False)
