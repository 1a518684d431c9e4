"""Jobs in helpers give what they give here; no helper outlives its caller."""

import os
import pickle
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import pytest

from edge_ident.support import side_by_side as module
from edge_ident.support.side_by_side import OneStage, side_by_side
from tests.processes import running

Tell = Callable[..., None]


def doubled(number: int, tell: Tell) -> tuple[int, int]:
    """A result, and the process that it comes from."""
    tell(number)
    return 2 * number, os.getpid()


def here_alone(number: int, caller: int, tell: Tell) -> int:
    """Dies in a helper."""
    if os.getpid() != caller:
        os._exit(3)
    return number


def refused(number: int, tell: Tell) -> int:
    """Raises for odd numbers."""
    if number % 2:
        raise ValueError(number)
    return number


def endless(number: int, folder: Path, caller: int, tell: Tell) -> int:
    """Never ends in a helper, which says where it is; raises in the caller once all helpers are."""
    if os.getpid() != caller:
        (folder / str(os.getpid())).touch()
        time.sleep(600.0)
    while not any(folder.iterdir()):
        time.sleep(0.01)
    raise KeyboardInterrupt


def ends(process: int) -> bool:
    """Whether a process that is not ours is gone before long."""
    for _ in range(500):
        try:
            os.kill(process, 0)
        except ProcessLookupError:
            return True
        status = Path(f"/proc/{process}/stat")
        if status.exists() and status.read_text().rpartition(")")[2].split()[0] == "Z":
            return True
        time.sleep(0.02)
    return False


@pytest.mark.parametrize("processes", [1, 2, 3])
def test_results_come_in_the_order_of_the_jobs(processes: int) -> None:
    told: dict[int, int] = {}
    jobs = [(1,), (2,), (3,)]
    found = side_by_side(doubled, jobs, processes, lambda job, number: told.update({job: number}))
    assert [result for result, _ in found] == [2, 4, 6]
    assert told == {0: 1, 1: 2, 2: 3}
    helped = sum(process != os.getpid() for _, process in found)
    assert helped == 0 if processes == 1 else 1 <= helped < processes + 1


def test_the_caller_does_what_a_helper_died_of() -> None:
    jobs = [(number, os.getpid()) for number in range(3)]
    assert side_by_side(here_alone, jobs, 2, lambda job: None) == [0, 1, 2]


@pytest.mark.parametrize("processes", [1, 2])
def test_an_error_is_raised_as_it_is(processes: int) -> None:
    with pytest.raises(ValueError, match=r"^3$") as caught:
        side_by_side(refused, [(0,), (2,), (3,)], processes, lambda job: None)
    assert caught.traceback[-1].name == "refused"


def test_all_is_done_here_where_no_process_begins(monkeypatch: pytest.MonkeyPatch) -> None:
    def full(*arguments: object, **options: object) -> None:
        raise OSError(11, "no process left")

    monkeypatch.setattr(module.subprocess, "Popen", full)
    assert side_by_side(refused, [(0,), (2,)], 2, lambda job: None) == [0, 2]


@pytest.mark.skipif(os.name != "posix", reason="processes are looked up by signal 0")
def test_ctrl_c_ends_helpers_at_once(tmp_path: Path) -> None:
    jobs = [(number, tmp_path, os.getpid()) for number in range(2)]
    with pytest.raises(KeyboardInterrupt):
        side_by_side(endless, jobs, 2, lambda job: None)
    (helper,) = tmp_path.iterdir()
    assert ends(int(helper.name))


CALLER = """
import os, sys
from pathlib import Path
from edge_ident.support.side_by_side import side_by_side
from tests.edge_ident.support.test_side_by_side import waiting
side_by_side(waiting, [(Path(sys.argv[1]),)] * 2, 2, lambda job: None)
"""


def waiting(folder: Path, tell: Tell) -> None:
    """Say where the job is, and never end."""
    (folder / str(os.getpid())).touch()
    time.sleep(600.0)


@pytest.mark.skipif(os.name != "posix", reason="processes are looked up by signal 0")
@pytest.mark.parametrize("ending", [signal.SIGKILL, signal.SIGTERM, signal.SIGINT])
def test_no_helper_outlives_its_caller(tmp_path: Path, ending: signal.Signals) -> None:
    command = (sys.executable, "-c", CALLER, str(tmp_path))
    with running(command, subprocess.DEVNULL) as caller:
        while len(list(tmp_path.iterdir())) < 2:
            assert caller.poll() is None
            time.sleep(0.01)
        caller.send_signal(ending)
        caller.wait(timeout=10)
    assert all(ends(int(process.name)) for process in tmp_path.iterdir())


def test_one_stage_counts_the_parts_of_all_jobs() -> None:
    shown: list[tuple[str, int, int]] = []
    stage = OneStage(lambda *values: shown.append(values), "diagnosis", jobs=2, parts=5)
    for job, part in [(0, 1), (1, 1), (0, 0), (1, 5), (0, 5)]:
        stage.told(job, part)
    assert [done for _, done, _ in shown] == [0, 1, 2, 2, 6, 10]
    assert {(title, of) for title, _, of in shown} == {("diagnosis", 10)}


def test_a_helper_whose_caller_ends_while_it_asks_says_nothing() -> None:
    asked = pickle.dumps((doubled, (1,)))
    program = "from edge_ident.support.helper import do_job; do_job()"
    for sent in (b"", asked[: len(asked) // 2]):
        ended = subprocess.run((sys.executable, "-c", program), input=sent, capture_output=True)
        assert (ended.stdout, ended.stderr) == (b"", b"")
