"""Measured recordings of real machines, which are not part of the project."""

from dataclasses import dataclass
from pathlib import Path

import pytest


@dataclass(frozen=True)
class MeasuredData:
    """The folder of measured recordings."""

    folder: Path

    def __truediv__(self, file: str) -> Path:
        """Path of a recording; skips the test, and says why, where there is none."""
        path = self.folder / file
        if not path.is_file():
            pytest.skip(f"needs the measured recording {file}: set EDGE_IDENT_DATA to its folder")
        return path
