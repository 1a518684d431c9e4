"""Where the time goes, stage by stage."""

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager


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
