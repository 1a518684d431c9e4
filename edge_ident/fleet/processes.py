"""Recordings side by side on this computer, each in a process of its own.

A process that dies takes down the recording that it had, and no other. Workers are programs of
their own, not forks: no thread or lock of the caller is in them, and the caller's own program is
not loaded again. They are in sessions of their own, so that Ctrl-C ends them through the caller.
"""

import json
import os
import signal
import subprocess
import sys
from collections.abc import Iterable
from contextlib import suppress
from itertools import islice
from multiprocessing.connection import wait
from typing import Any, Final

from edge_ident.fleet.tasks import Outcomes, Task, ended

COMMAND: Final = (sys.executable, "-m", "edge_ident.fleet.worker")
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
