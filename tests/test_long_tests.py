"""The gate runs long tests, and those that go by the clock, without training alone: one that needs
training would run nowhere.
"""

from pathlib import Path

from tests.conftest import LONG, REAL_TIME


def test_nothing_that_runs_once_is_skipped_without_training() -> None:
    folder = Path(__file__).parent
    for place in (*LONG, *REAL_TIME):
        path = folder / place
        files = sorted(path.rglob("*.py")) if path.is_dir() else [path]
        assert files, place
        for file in files:
            assert "importorskip" not in file.read_text("utf-8"), file
