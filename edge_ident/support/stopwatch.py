"""Time and memory that work takes."""

import ctypes
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Final

# Where the time goes, stage by stage.


class Stopwatch:
    """Adds up the time of named stages; the total runs from its construction.

    Parameters
    ----------
    clock : callable
        Tells the time in s; by default that of the wall.

    Examples
    --------
    >>> import edge_ident
    >>> watch = edge_ident.Stopwatch()
    >>> with watch.stage("load"):
    ...     recording = edge_ident.simulate()
    >>> found = edge_ident.identify(recording, stopwatch=watch)
    >>> "load" in found.timing_ms
    True
    """

    def __init__(self, clock: Callable[[], float] = time.perf_counter) -> None:
        self._clock = clock
        self._start_s = clock()
        self._stages_s: dict[str, float] = {}

    @contextmanager
    def stage(self, name: str) -> Iterator[None]:
        """Time the body of a with statement; stages of one name add up."""
        start_s = self._clock()
        try:
            yield
        finally:
            self.add(name, self._clock() - start_s)

    def add(self, name: str, spent_s: float) -> None:
        """Add what another stopwatch told of a stage, in s."""
        self._stages_s[name] = self._stages_s.get(name, 0.0) + spent_s

    def timing_ms(self) -> dict[str, float]:
        """Milliseconds by stage, and `total` since the start."""
        stages = self._stages_s | {"total": self._clock() - self._start_s}
        return {name: 1e3 * spent for name, spent in stages.items()}


# Memory that a process gives back to the system while it runs, or keeps.

_TRIM_THRESHOLD: Final = -1
_MMAP_THRESHOLD: Final = -3  # numbers of these parameters of glibc's `mallopt`
# Size from which memory goes back as soon as it is free. Below, that takes longer than what is
# computed there.
_LARGE_BYTES: Final = 1 << 19
_ALL_BYTES: Final = 1 << 30  # more than any array of a diagnosis


def give_back() -> None:
    """Give free memory back to the system, and from now on what is large as soon as it is free.

    glibc alone can be told so; with other C libraries nothing happens.
    """
    if library := _glibc():
        library.mallopt(_MMAP_THRESHOLD, _LARGE_BYTES)
        library.malloc_trim(0)


def keep() -> None:
    """Keep free memory for what is computed next: for a process that computes, and ends.

    Large arrays come and go, and the system clears all memory that it gives. glibc alone can be
    told so; with other C libraries nothing happens.
    """
    if library := _glibc():
        library.mallopt(_MMAP_THRESHOLD, _ALL_BYTES)
        library.mallopt(_TRIM_THRESHOLD, _ALL_BYTES)


def _glibc() -> ctypes.CDLL | None:
    """The C library of the process, where it is glibc."""
    library = ctypes.CDLL(None) if sys.platform == "linux" else None
    return library if hasattr(library, "malloc_trim") else None
