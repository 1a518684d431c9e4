"""Virtual boards in processes of their own, as a user starts them, with settings for trouble."""

import sys
from collections.abc import Iterator
from contextlib import contextmanager

from tests.processes import running

_SERVE = """
from dataclasses import replace
from firmware_interface.registers import Fault
from firmware_interface.virtual.server import serve
from firmware_interface.virtual.settings import DEFAULT_LIMITS, BoardSettings
tight = replace(
    DEFAULT_LIMITS, gain_maximum=replace(DEFAULT_LIMITS.gain_maximum, proportional=60.0)
)
serve(on_ready=lambda device: print(device, flush=True), settings=BoardSettings({settings}),
      speed={speed}, {where})
"""


@contextmanager
def served_board(
    where: str = "pty=True", speed: float | None = None, settings: str = "", before: str = ""
) -> Iterator[str]:
    """A virtual board in another process; yields its device URL.

    Parameters
    ----------
    where : str
        Keyword of `serve`: "pty=True" or "tcp_port=0".
    speed : float or None
        Of real time; None lets time pass with the requests.
    settings : str
        Arguments of `BoardSettings`, as source text.
    before : str
        Source text that runs before it serves.
    """
    source = before + _SERVE.format(settings=settings, speed=speed, where=where)
    with running([sys.executable, "-c", source], errors=None) as process:
        assert process.stdout is not None
        yield process.stdout.readline().strip()
