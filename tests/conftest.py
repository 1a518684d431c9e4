"""Measured recordings, and processes that a test starts: none outlives the tests."""

import functools
import math
import os
import signal
import time
import uuid
import zlib
from collections.abc import Iterator
from pathlib import Path

# three processes share the cores; before numpy is loaded
os.environ.setdefault("OMP_NUM_THREADS", "1")

import pytest
import typer

from tests.measured import MeasuredData
from tests.repetitions import THOROUGH

_MARK = "EDGE_IDENT_TESTS"
"""Environment variable that every process below the tests inherits."""

if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    # A shell script starts background jobs with SIGINT ignored, and every child inherits that.
    # The tests interrupt commands, so their children must not.
    signal.signal(signal.SIGINT, signal.default_int_handler)
for _ignored in (signal.SIGQUIT, signal.SIGHUP):  # a script's, too, and nohup's
    if signal.getsignal(_ignored) is signal.SIG_IGN:
        signal.signal(_ignored, signal.SIG_DFL)

REAL_TIME = ("firmware_interface", "test_link_overhead.py", "test_refusals.py", "test_run.py")
"""Folder and files below this one whose tests wait for boards that go by the clock."""

LONG = (
    "accuracy/",
    "edge_ident/diagnosis/test_real_machines.py",
    "test_synthetic_machines.py",
    "edge_ident/diagnosis/test_hidden_effects.py",
    "test_page_commands.py",
    "edge_ident/experiment/",
    "edge_ident/commissioning/",
    "edge_ident/fleet/",
    "plant/",
    "test_plant.py",
    "edge_ident/cli/test_survey_command.py",
    "edge_ident/cli/test_entry.py",
    "edge_ident/diagnosis/",
    "edge_ident/estimation/test_compensation.py",
    "edge_ident/model/test_supported_range.py",
    "edge_ident/cli/test_terminal.py",
    "test_examples.py",
    "edge_ident/estimation/test_effort_checks.py",
    "edge_ident/cli/test_bringup_page.py",
    "edge_ident/cli/test_stop_command.py",
    "edge_ident/cli/test_board_gains_command.py",
    "edge_ident/simulation/",
    "edge_ident/cli/test_model_option.py",
    "test_bad_recordings.py",
    "edge_ident/cli/test_home_command.py",
    "edge_ident/model/effects/test_new_effect.py",
    "edge_ident/estimation/test_least_squares.py",
    "edge_ident/cli/test_hide_options.py",
    "edge_ident/cli/test_init_command.py",
    "edge_ident/report/",
    "edge_ident/identification/test_adequacy.py",
    "edge_ident/identification/test_long_recordings.py",
    "edge_ident/control/",
    "test_command_pages.py",
    "edge_ident/baselines/",
    "edge_ident/cli/test_capture_command.py",
)
"""Folders and files below this one whose tests compute for long, the longest first."""
DEV = (
    "export/",
    "edge_ident/test_public_api.py",
    "edge_ident/estimation/test_network.py",
    "edge_ident/estimation/test_rank_one.py",
    "test_notebook.py",
    "test_paper_figures.py",
    "test_site.py",
)
"""Those that need training or the site, and the whole public API, which is the same on every
Python; the gate runs them in README's environment alone, on the oldest."""
OLDEST = (
    "edge_ident/cli/test_command.py",
    "edge_ident/drive/",
    "edge_ident/identification/test_identify.py",
    "edge_ident/model/test_model_files.py",
    "edge_ident/support/",
)
"""Those that run there as well, on the oldest Python: imports, models, and an identification."""
DURATIONS = Path(__file__).with_name("durations.txt")
"""Tests that take longer than a second or so: how long each took, in s, on a quiet core."""
FLOORS = ("accuracy/",)
"""Those that run however long they take, wherever --up-to is given."""
_QUICK_S = 1.0
_UP_TO = "EDGE_IDENT_TESTS_UP_TO"
"""Environment variable that tells the workers the longest test."""
_ONE_OF_EACH = "EDGE_IDENT_TESTS_ONE_OF_EACH"
"""The same: whether a test that is repeated with other values runs with one of them."""
_FIRST = ("test_run.py", *LONG)
"""What begins, in this order."""


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption(
        "--thorough", action="store_true", help="also the repetitions, and however long they take"
    )
    parser.addoption(
        "--up-to", type=float, metavar="SECONDS",
        help="only tests that take less by tests/durations.txt (default: all of files that are "
        f"named; of the whole suite {_QUICK_S:g}, and each test with one of its values)",
    )  # fmt: skip


def pytest_configure(config: pytest.Config) -> None:
    """Tell what is decided when tests are imported, in the workers of pytest-xdist as well."""
    if config.getoption("--thorough"):
        os.environ[THOROUGH] = "yes"
    if not hasattr(config, "workerinput"):  # workers do not know what was asked for
        whole = config.args_source is pytest.Config.ArgsSource.TESTPATHS
        asked = config.getoption("--up-to")
        os.environ[_UP_TO] = str(asked or (_QUICK_S if whole else math.inf))
        os.environ[_ONE_OF_EACH] = "yes" if whole and not asked else ""


@pytest.fixture(scope="session")
def thorough(pytestconfig: pytest.Config) -> bool:
    """Whether the repetitions run that the gate leaves out."""
    return bool(pytestconfig.getoption("--thorough"))


def pytest_ignore_collect(collection_path: Path, config: pytest.Config) -> bool | None:
    """Files none of whose tests are asked for are not imported: that takes seconds a process."""
    place = collection_path.relative_to(Path(__file__).parent).as_posix()
    asked = config.option.markexpr
    if collection_path.suffix != ".py" or not asked:
        return None
    by_the_clock = place.split("/")[0] in REAL_TIME
    if asked == "real_time":
        left_out = not by_the_clock and "mark.real_time" not in collection_path.read_text("utf-8")
        return left_out or None
    left_out = (
        (by_the_clock and "not real_time" in asked)
        or (place.startswith(LONG) and "not long" in asked)
        or (place.startswith(DEV) and "not dev" in asked)
        or (not place.startswith((*DEV, *OLDEST)) and asked == "dev or oldest")
    )
    return left_out or None  # --ignore may still leave it out


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Mark the groups; the long tests begin, so that no worker ends alone."""
    if not config.getoption("--thorough"):
        repeated = ["thorough", *(["stand_in"] if _measured().folder.is_dir() else [])]
        long = _longer_than(float(os.environ[_UP_TO]))
        one_of_each = bool(os.environ[_ONE_OF_EACH])
        kept, left_out = [], []
        for item in items:
            floor = _place(item).startswith(FLOORS)
            too_long = one_of_each if floor else item.nodeid in long
            out = too_long or any(item.get_closest_marker(kind) for kind in repeated)
            (left_out if out else kept).append(item)
        if one_of_each:
            chosen = set(_one_of_each(kept))
            left_out += [item for item in kept if item not in chosen]
            kept = [item for item in kept if item in chosen]
        config.hook.pytest_deselected(items=left_out)
        items[:] = kept
    for item in items:
        place = _place(item)
        if place.split("/")[0] in REAL_TIME:
            item.add_marker(pytest.mark.real_time)
        for group, places in {"long": LONG, "dev": DEV, "oldest": OLDEST}.items():
            if place.startswith(places):
                item.add_marker(group)
    items.sort(key=_turn)


def _one_of_each(items: list[pytest.Item]) -> Iterator[pytest.Item]:
    """Of a test with several values one, drawn by its name: so that all kinds of values are there,
    and always the same."""
    by_test: dict[str, list[pytest.Item]] = {}
    for item in items:
        by_test.setdefault(item.nodeid.partition("[")[0], []).append(item)
    for name, of_test in by_test.items():
        yield of_test[zlib.crc32(name.encode()) % len(of_test)]


def _longer_than(limit_s: float) -> set[str]:
    """Tests that took so long when they were measured."""
    lines = (line.split(" ", 1) for line in DURATIONS.read_text("utf-8").splitlines())
    return {test for seconds, test in lines if float(seconds) >= limit_s}


def _place(item: pytest.Item) -> str:
    return item.path.relative_to(Path(__file__).parent).as_posix()


def _turn(item: pytest.Item) -> int:
    place = _place(item)
    return next((turn for turn, long in enumerate(_FIRST) if place.startswith(long)), len(_FIRST))


@pytest.fixture(scope="session")
def measured_data() -> MeasuredData:
    """Measured recordings."""
    return _measured()


def _measured() -> MeasuredData:
    """Of EDGE_IDENT_DATA, else of ../shared/data beside the checkout."""
    given = os.environ.get("EDGE_IDENT_DATA")
    return MeasuredData(Path(given) if given else Path(__file__).parents[2] / "shared" / "data")


@pytest.fixture(scope="session", autouse=True)
def nothing_of_the_person_who_tests(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    """Tests, and the commands that they start, find no settings and leave nothing behind."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("EDGE_IDENT_CONFIG_FILE", os.path.join(os.path.devnull, "none"))
        patch.setenv("XDG_CACHE_HOME", str(tmp_path_factory.mktemp("cache")))
        yield


@pytest.fixture(scope="session", autouse=True)
def command_line_is_built_once() -> Iterator[None]:
    """`CliRunner` builds it for every call: that takes longer than most commands."""
    with pytest.MonkeyPatch.context() as patch:
        built = functools.cache(typer.main.get_command)
        patch.setattr("typer.testing._get_command", built)
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
