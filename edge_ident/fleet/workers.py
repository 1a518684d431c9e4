"""Recordings side by side: on a Dask cluster, or in processes of this computer.

On a cluster, the content of a recording travels with its task, so its computers need no common
folder. Where a worker is lost, the cluster's scheduler gives its task to another.
"""

import json
import os
import signal
import subprocess
import sys
import uuid
import warnings
from collections.abc import Generator, Iterable, Mapping
from contextlib import suppress
from dataclasses import asdict, dataclass
from itertools import islice
from multiprocessing.connection import wait
from typing import Any, Final

from edge_ident.errors import DataError, LinkError
from edge_ident.fleet.analysis import analyse_content
from edge_ident.fleet.result import Failed, Found
from edge_ident.support.version import VERSION

# What is to be done, and what came of it; the same for processes and for a cluster.


@dataclass(frozen=True)
class Task:
    """A recording to be analysed.

    Attributes
    ----------
    found : Found
    sha256, key : str
        Of its content; of all that its result follows from.
    options : mapping
        As JSON.
    """

    found: Found
    sha256: str
    key: str
    options: Mapping[str, Any]


Outcome = tuple[Task, dict[str, Any]]
"""A task, and the document of `edge_ident.fleet.analysis.analyse`."""
Outcomes = Generator[Outcome, None, None]
"""Outcomes as they come; closing it ends what works on the rest."""


def ended(why: str) -> dict[str, Any]:
    """The document of a task whose worker came to an end."""
    failed = Failed(
        "ended",
        f"the process that analysed it ended: {why}",
        "run the survey again; if it happens again, use fewer --jobs, or identify the file alone",
    )
    return {"axes": {}, "failed": asdict(failed), "duration_s": 0.0}


PATIENCE_S: Final = 20
"""Time for the scheduler to answer, and for a first worker to appear."""
_IN_HAND: Final = 2  # tasks for each thread of the cluster: one runs while the next is on its way


def run_on_cluster(tasks: Iterable[Task], address: str) -> Outcomes:
    """Do tasks on a cluster.

    Parameters
    ----------
    tasks : iterable of Task
    address : str
        Of the scheduler: `tcp://HOST:PORT`.

    Yields
    ------
    Outcome
        In the order in which they end.

    Raises
    ------
    DataError
        Dask is not installed here, or the cluster has another edge-ident.
    LinkError
        There is no cluster at that address, or it has no worker.
    """
    distributed = _dask()
    client = _connected(distributed, address)
    given: dict[Any, Task] = {}
    try:
        _check_version(client)
        waiting = iter(tasks)
        count = _IN_HAND * max(1, sum(client.nthreads().values()))
        for task in islice(waiting, count):
            given[_submit(client, task)] = task
        ready = distributed.as_completed(list(given), loop=client.loop)
        for future in ready:
            task = given.pop(future)
            following = next(waiting, None)
            if following is not None:
                begun = _submit(client, following)
                given[begun] = following
                ready.add(begun)
            yield task, _document(future, distributed)
    finally:
        client.cancel(list(given), force=True)
        client.close()


def installed() -> str:
    """Version of edge-ident, here or wherever it is asked."""
    return VERSION


def _submit(client: Any, task: Task) -> Any:
    content = task.found.path.read_bytes()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)  # a recording is large, and is sent once
        return client.submit(
            analyse_content, task.found.name, content, task.options,
            key=f"edge-ident-{task.key}-{uuid.uuid4().hex}", pure=False,
        )  # fmt: skip


def _document(future: Any, distributed: Any) -> dict[str, Any]:
    try:
        document: dict[str, Any] = future.result()
    except distributed.scheduler.KilledWorker:
        return ended("workers of the cluster died of it")
    except Exception as error:  # of the cluster: that of a recording is in its document
        return ended(f"{type(error).__name__}: {error}")
    return document


def _dask() -> Any:
    try:
        import distributed
    except ImportError as error:
        raise DataError(
            "a survey on a cluster needs Dask, which is not installed",
            "pip install 'edge-ident[cluster]'",
        ) from error
    return distributed


def _connected(distributed: Any, address: str) -> Any:
    next_step = "start one with: dask scheduler; and on each computer: dask worker ADDRESS"
    try:
        client = distributed.Client(address, timeout=PATIENCE_S, set_as_default=False)
    except (OSError, ValueError, TimeoutError) as error:
        raise LinkError(f"no Dask cluster answers at {address}", next_step) from error
    try:
        client.wait_for_workers(1, timeout=PATIENCE_S)
    except TimeoutError as error:
        client.close()
        raise LinkError(f"the cluster at {address} has no worker", next_step) from error
    return client


def _check_version(client: Any) -> None:
    here = installed()
    try:
        there = client.submit(installed, pure=False).result(timeout=PATIENCE_S)
    except Exception as error:
        there = f"none ({type(error).__name__})"
    if there != here:
        raise DataError(
            f"the workers of the cluster have another edge-ident: {there}, here {here}",
            f"install it on each: pip install 'edge-ident[files]=={here}'",
        )


# Recordings side by side on this computer, each in a process of its own.
#
# A process that dies takes down the recording that it had, and no other. Workers are programs of
# their own, not forks: no thread or lock of the caller is in them, and the caller's own program is
# not loaded again. They are in sessions of their own, so that Ctrl-C ends them through the caller.

COMMAND: Final = (sys.executable, "-m", "edge_ident.fleet.analysis")
ONE_THREAD: Final = {
    f"{library}_NUM_THREADS": "1"
    for library in ("OMP", "OPENBLAS", "MKL", "VECLIB_MAXIMUM", "NUMEXPR")
}
"""Every worker has one thread: side by side they use all cores."""


def run_processes(tasks: Iterable[Task], jobs: int) -> Outcomes:
    """Do tasks in so many processes.

    Parameters
    ----------
    tasks : iterable of Task
    jobs : int

    Yields
    ------
    Outcome
        In the order in which they end.
    """
    waiting = iter(tasks)
    workers: dict[Any, _Worker] = {}
    try:
        for task in islice(waiting, jobs):
            _begin(workers, task)
        while workers:
            for answers in wait(list(workers)):
                worker = workers[answers]
                task, document = worker.task, worker.answer()
                following = next(waiting, None)
                if document is not None and following is not None:
                    worker.give(following)
                else:
                    why = worker.stop()
                    del workers[answers]
                    if following is not None:
                        _begin(workers, following)
                yield task, ended(why) if document is None else document
    finally:
        for worker in workers.values():
            worker.stop()


def _begin(workers: "dict[Any, _Worker]", task: Task) -> None:
    worker = _Worker(task)
    workers[worker.answers] = worker


class _Worker:
    """A process, and the task that it has."""

    def __init__(self, task: Task) -> None:
        self._process = subprocess.Popen(
            COMMAND,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            env={**os.environ, **ONE_THREAD},
            start_new_session=True,
            text=True,
            encoding="utf-8",
        )
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        self._tasks, self.answers = self._process.stdin, self._process.stdout
        self._ended = False
        self.give(task)

    def give(self, task: Task) -> None:
        """Give it the next task; a process that has just died says so when it is asked."""
        self.task = task
        line = {"file": str(task.found.path), "options": task.options}
        with suppress(BrokenPipeError):
            print(json.dumps(line), file=self._tasks, flush=True)

    def answer(self) -> dict[str, Any] | None:
        """The document that is ready; None where the process has died."""
        line = self.answers.readline()
        self._ended = not line.endswith("\n")
        return None if self._ended else json.loads(line)

    def stop(self) -> str:
        """End the process, whatever it does, and say how it ended where it had ended itself."""
        if not self._ended:
            self._process.kill()
        code = self._process.wait()
        with suppress(BrokenPipeError):
            self._tasks.close()
        self.answers.close()
        return signal.strsignal(-code) or f"signal {-code}" if code < 0 else f"exit code {code}"
