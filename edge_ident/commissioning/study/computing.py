"""Long computations beside a board: Ctrl-C works at any time, and they end when time is up.

The work runs in a thread of its own. A computation that is out of time or interrupted ends where it
next tells its progress.
"""

import threading
import time
from collections.abc import Callable
from dataclasses import dataclass
from math import inf
from typing import Final, TypeVar

from edge_ident.errors import EdgeIdentError

Progress = Callable[[str, int, int], None]
_T = TypeVar("_T")

_LOOK_S: Final = 0.1
"""Between two looks at the time."""


class OutOfTimeError(EdgeIdentError):
    """A computation took longer than the user allowed."""


class _EndedError(Exception):
    """Nobody waits for this computation any more."""


@dataclass
class Budget:
    """Computing time that is left, s."""

    left_s: float = inf
    whole_s: float = inf

    def __post_init__(self) -> None:
        self.whole_s = self.left_s


def computed(work: Callable[[Progress], _T], budget: Budget, on_progress: Progress) -> _T:
    """Compute within a budget.

    Parameters
    ----------
    work : callable
        Gets what it is to tell its progress.
    budget : Budget
        From which the time is taken.
    on_progress : callable

    Raises
    ------
    OutOfTimeError
    """
    ended, began_s = threading.Event(), time.monotonic()
    found: list[_T] = []
    failed: list[BaseException] = []

    def told(stage: str, done: int, total: int) -> None:
        if ended.is_set():
            raise _EndedError
        on_progress(stage, done, total)

    def run() -> None:
        try:
            found.append(work(told))
        except BaseException as error:  # raised again where it is asked for
            failed.append(error)

    thread = threading.Thread(target=run, daemon=True)  # a stop does not wait for it
    thread.start()
    try:
        while thread.is_alive():
            thread.join(_LOOK_S)
            if thread.is_alive() and time.monotonic() - began_s > budget.left_s:
                raise OutOfTimeError(
                    f"the diagnosis was not done within {budget.whole_s:g} s",
                    "allow more time with --diagnose-within, or diagnose the captures of the run "
                    "with edge-ident diagnose",
                )
    finally:
        ended.set()
        budget.left_s -= time.monotonic() - began_s
    if failed:
        raise failed[0]
    return found[0]
