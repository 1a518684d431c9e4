"""Jobs side by side: this process does one after the other, and helpers take some off it.

A helper is a program of its own, not a fork: no thread or lock of the caller is in it. It is in a
session of its own, so that Ctrl-C ends it through the caller; and it ends by itself where the
caller is gone. The caller does a job again whose helper dies or raises an error: so it raises the
error as it is.
"""

import pickle
import subprocess
import sys
from collections.abc import Callable, Sequence
from contextlib import suppress
from queue import Empty, SimpleQueue
from threading import Thread
from typing import IO, Any, Final

_PROGRAM: Final = (
    "import sys; sys.path[:] = sys.argv[1:]; from edge_ident.support.helper import do_job; do_job()"
)
"""It has the caller's module path: what it loads is what the caller has loaded."""

Job = tuple[Any, ...]
Told = Callable[..., None]
Frame = tuple[str, Any] | None


def side_by_side(
    function: Callable[..., Any], jobs: Sequence[Job], processes: int, told: Told
) -> list[Any]:
    """What a function returns for each job.

    Parameters
    ----------
    function : callable
        Of a module. Gets the parts of a job, and a callable that tells how far it is. A helper gets
        both, and gives back the result, by pickle.
    jobs : sequence of tuple
    processes : int
        This one, and helpers for the rest.
    told : callable
        Gets the number of a job and what the job tells, in this process.
    """
    helpers = processes - 1 if sys.executable else 0
    work = _Work(function, jobs, helpers, told)
    try:
        return work.done()
    finally:
        for helper in work.helpers.values():
            helper.stop()


class OneStage:
    """Shows the progress of jobs side by side as one stage, of so many parts for each job."""

    def __init__(
        self, on_progress: Callable[[str, int, int], None], stage: str, jobs: int, parts: int
    ) -> None:
        self._on_progress, self._stage, self._of = on_progress, stage, jobs * parts
        self._done = [0] * jobs
        self.told(0, 0)

    def told(self, job: int, part: int) -> None:
        """A job has done so many of its parts; one that begins again has done what it had."""
        self._done[job] = max(self._done[job], part)
        self._on_progress(self._stage, sum(self._done), self._of)


class _Work:
    """Jobs that are done, those that helpers do, and those that nobody has begun."""

    def __init__(
        self, function: Callable[..., Any], jobs: Sequence[Job], most: int, told: Told
    ) -> None:
        self.helpers: dict[int, _Helper] = {}
        self._function, self._jobs, self._told, self._most = function, jobs, told, most
        self._waiting = list(range(len(jobs)))
        self._results: dict[int, Any] = {}

    def done(self) -> list[Any]:
        """The results, in the order of the jobs."""
        while self._waiting:
            own = self._waiting.pop(0)
            self._ask_for_help()
            self._do(own)
        for job in range(len(self._jobs)):
            while job in self.helpers:
                self._take(job, self.helpers[job].frames.get())
            if job not in self._results:
                self._do(job)
        return [self._results[job] for job in range(len(self._jobs))]

    def _do(self, job: int) -> None:
        """Do a job here, and look at the helpers whenever it tells something."""

        def tell(*values: Any) -> None:
            self._listen()
            self._told(job, *values)

        self._results[job] = self._function(*self._jobs[job], tell)
        self._listen()

    def _ask_for_help(self) -> None:
        """Give jobs that nobody has begun to helpers; where none can be had, they stay here."""
        while self._waiting and len(self.helpers) < self._most:
            try:
                job = self._waiting[-1]
                self.helpers[job] = _Helper(self._function, self._jobs[job])
                self._waiting.pop()
            except OSError:
                self._most = 0

    def _listen(self) -> None:
        """Take what helpers have sent so far."""
        for job, helper in list(self.helpers.items()):
            with suppress(Empty):
                while job in self.helpers:
                    self._take(job, helper.frames.get_nowait())
        self._ask_for_help()

    def _take(self, job: int, frame: Frame) -> None:
        """Take what a helper has sent; None where it has ended without a result."""
        if frame is not None and frame[0] == "told":
            self._told(job, *frame[1])
            return
        self.helpers.pop(job).stop()
        if frame is not None:
            self._results[job] = frame[1]


class _Helper:
    """A process that does one job, and what it has sent: frames, then None."""

    def __init__(self, function: Callable[..., Any], job: Job) -> None:
        asked = pickle.dumps((function, job))
        self._process = subprocess.Popen(
            (sys.executable, "-c", _PROGRAM, *sys.path),
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            start_new_session=True,
        )
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        self.frames: SimpleQueue[Frame] = SimpleQueue()
        self._listener = Thread(
            target=_listened, args=(self._process.stdout, self.frames), daemon=True
        )
        self._listener.start()
        try:
            with suppress(BrokenPipeError):  # it has died, and its frames say so
                self._process.stdin.write(asked)
                self._process.stdin.flush()
        except BaseException:  # Ctrl-C, before anybody else knows of the process
            self.stop()
            raise

    def stop(self) -> None:
        """End the process, whatever it does."""
        self._process.kill()
        self._process.wait()
        self._listener.join()
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        with suppress(BrokenPipeError):
            self._process.stdin.close()
        self._process.stdout.close()


def _listened(answers: IO[bytes], frames: SimpleQueue[Frame]) -> None:
    """Pass on what a helper sends until it ends; a frame that cannot be read is an end, too."""
    with suppress(Exception):
        while True:
            frames.put(pickle.load(answers))
    frames.put(None)
