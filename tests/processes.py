"""Processes that tests start: whatever happens in the test, they end with it."""

import subprocess
from collections.abc import Iterator, Sequence
from contextlib import contextmanager


@contextmanager
def running(
    command: Sequence[str], errors: int | None = subprocess.PIPE, *, own_session: bool = False
) -> Iterator[subprocess.Popen[str]]:
    """A command with its output in a pipe; at the end SIGTERM, and SIGKILL where that fails.

    Parameters
    ----------
    errors : int, optional
        Where its stderr goes; None: where that of the tests goes.
    own_session : bool
        Ctrl-C at the terminal does not reach it.
    """
    with subprocess.Popen(
        command,
        stdout=subprocess.PIPE,
        stderr=errors,
        text=True,
        start_new_session=own_session,
    ) as process:
        try:
            yield process
        finally:
            stop(process)


def stop(process: subprocess.Popen[str]) -> None:
    """End a process that may have ended already; one that ignores SIGTERM fails the test."""
    process.terminate()
    try:
        process.wait(timeout=10)
    except subprocess.TimeoutExpired:
        process.kill()
        process.wait()
        raise
