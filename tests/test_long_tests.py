"""The gate runs long tests without training alone: one that needs training would run nowhere."""

from pathlib import Path

from tests.conftest import LONG


def test_no_long_test_is_skipped_without_training() -> None:
    folder = Path(__file__).parent
    for place in LONG:
        files = sorted((folder / place).rglob("*.py")) if place.endswith("/") else [folder / place]
        assert files, place
        for file in files:
            assert "importorskip" not in file.read_text("utf-8"), file
