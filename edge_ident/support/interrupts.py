"""Signals that end a command as Ctrl-C does, and how a short task is protected from them."""

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Final

ENDING: Final = tuple(s for s in signal.Signals if s.name in ("SIGINT", "SIGTERM", "SIGHUP"))
"""Ctrl-C, a service manager, a closed terminal; not every system has them all."""


def end_as_by_ctrl_c() -> None:
    """Let every ending signal raise KeyboardInterrupt, so that the machine is stopped.

    A signal that the caller has this process ignore (nohup, a shell's background) stays ignored.
    """
    for ending in ENDING:
        if signal.getsignal(ending) is not signal.SIG_IGN:
            signal.signal(ending, signal.default_int_handler)


@contextmanager
def deaf_to_interrupts() -> Iterator[None]:
    """Ignore ending signals while the body runs; it must end by itself."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    previous = {ending: signal.signal(ending, signal.SIG_IGN) for ending in ENDING}
    try:
        yield
    finally:
        for ending, handler in previous.items():
            signal.signal(ending, handler)
