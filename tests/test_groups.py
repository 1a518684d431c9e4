"""The gate runs each group of tests where it can run: none is skipped in the only place it has."""

from pathlib import Path

from tests.conftest import DEV, DURATIONS, LONG, OLDEST, REAL_TIME

FOLDER = Path(__file__).parent


def test_what_needs_training_or_the_site_is_said_to() -> None:
    """All else runs without, and must not be skipped there."""
    asking = {
        file.relative_to(FOLDER).as_posix()
        for file in FOLDER.rglob("test_*.py")
        if "importorskip(" in file.read_text("utf-8") and file != Path(__file__)
    }
    assert asking
    assert not [place for place in asking if not place.startswith(DEV)]


def test_every_group_names_what_there_is() -> None:
    for place in (*REAL_TIME, *DEV, *OLDEST, *LONG):
        assert (FOLDER / place).exists(), place


def test_every_duration_is_that_of_a_test_file_that_there_is() -> None:
    for line in DURATIONS.read_text("utf-8").splitlines():
        seconds, test = line.split(" ", 1)
        assert float(seconds) > 0.0
        assert (FOLDER.parent / test.partition("::")[0]).is_file(), test
