"""Measured recordings, and processes that a test starts: none outlives the tests."""

import os
import signal
import time
import uuid
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.measured import MeasuredData

_MARK = "EDGE_IDENT_TESTS"
"""Environment variable that every process below the tests inherits."""

if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    # A shell script starts background jobs with SIGINT ignored, and every child inherits that.
    # The tests interrupt commands, so their children must not.
    signal.signal(signal.SIGINT, signal.default_int_handler)
if signal.getsignal(signal.SIGHUP) is signal.SIG_IGN:
    signal.signal(signal.SIGHUP, signal.SIG_DFL)  # nohup's

_REAL_TIME = ("firmware_interface", "test_link_overhead.py", "test_refusals.py", "test_run.py")
"""Folder and files below this one whose tests wait for boards that go by the clock."""


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Mark the tests that go by the clock."""
    for item in items:
        if item.path.relative_to(Path(__file__).parent).parts[0] in _REAL_TIME:
            item.add_marker(pytest.mark.real_time)


@pytest.fixture(scope="session")
def measured_data() -> MeasuredData:
    """Measured recordings: of EDGE_IDENT_DATA, else of ../shared/data beside the checkout."""
    given = os.environ.get("EDGE_IDENT_DATA")
    return MeasuredData(Path(given) if given else Path(__file__).parents[2] / "shared" / "data")


@pytest.fixture(scope="session", autouse=True)
def no_settings_of_the_person_who_tests() -> Iterator[None]:
    """Tests, and the commands that they start, find no settings file."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("EDGE_IDENT_CONFIG_FILE", os.path.join(os.path.devnull, "none"))
        yield


@pytest.fixture(scope="session", autouse=True)
def no_process_outlives_the_tests() -> Iterator[None]:
    """Fail at the end if a process that a test started still runs, and kill it."""
    mark = uuid.uuid4().hex
    os.environ[_MARK] = mark
    yield
    del os.environ[_MARK]
    deadline = time.monotonic() + 2.0  # a process that was told to end may need a moment
    while (left := _processes_with(mark)) and time.monotonic() < deadline:
        time.sleep(0.05)
    for process in left:
        os.kill(process, signal.SIGKILL)
    assert not left, f"still running: {', '.join(left.values())}"


def _processes_with(mark: str) -> dict[int, str]:
    """Other processes that inherited a mark: by number, the test that started each.

    Empty on systems without /proc.
    """
    found = {}
    for folder in Path("/proc").glob("[0-9]*"):
        try:
            environment = (folder / "environ").read_bytes().decode(errors="replace").split("\0")
        except OSError:  # it has ended, or belongs to somebody else
            continue
        if f"{_MARK}={mark}" in environment and int(folder.name) != os.getpid():
            values = dict(line.split("=", 1) for line in environment if "=" in line)
            found[int(folder.name)] = values.get("PYTEST_CURRENT_TEST", "a fixture")
    return found
