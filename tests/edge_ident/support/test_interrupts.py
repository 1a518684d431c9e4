"""Ctrl-C interrupts wherever it comes, and the exit code says so."""

import signal
import subprocess
import sys
from typing import Final

import pytest

from edge_ident.support.process import INTERRUPTED

_BEGIN: Final = """
import os, signal, sys, time
from edge_ident.support.process import INTERRUPTED, end_as_by_ctrl_c, exit_code_counts
signal.signal(signal.SIGINT, signal.default_int_handler)  # a runner in the background ignores it
end_as_by_ctrl_c()
def stopped():
    os.kill(os.getpid(), ENDING)
"""
_END: Final = """
    time.sleep(60.0)
except KeyboardInterrupt:
    exit_code_counts()
    sys.exit(INTERRUPTED)
"""
_PLACES: Final = {
    "in a destructor": """
class Held:
    def __del__(self):
        stopped()
try:
    Held()
""",
    "in code of a string": """
try:
    exec("stopped()")
""",
}


@pytest.mark.parametrize(
    "ending",
    [signal.SIGINT, signal.SIGQUIT, signal.SIGTERM, signal.SIGUSR1, signal.SIGALRM, signal.SIGXCPU],
)
@pytest.mark.parametrize("place", _PLACES)
def test_an_interrupt_is_not_lost(place: str, ending: signal.Signals) -> None:
    program = _BEGIN.replace("ENDING", str(int(ending))) + _PLACES[place] + _END
    done = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, timeout=30, check=False
    )
    assert (done.returncode, done.stderr) == (INTERRUPTED, "")


_TOGETHER: Final = """
import signal, sys
from contextlib import contextmanager
from edge_ident.support.process import (
    INTERRUPTED, deaf_to_interrupts, end_as_by_ctrl_c, exit_code_counts, uncut
)
COMING = [SIGNALS]
for number in COMING:
    signal.signal(number, signal.SIG_DFL)  # a runner in the background ignores SIGINT
end_as_by_ctrl_c()
@contextmanager
@uncut
def cleaned_up():
    try:
        yield
    except BaseException:
        with deaf_to_interrupts():
            print("cleaned up", flush=True)
        raise
try:
    with cleaned_up():
        signal.pthread_sigmask(signal.SIG_BLOCK, COMING)
        for number in COMING:
            signal.raise_signal(number)
        signal.pthread_sigmask(signal.SIG_UNBLOCK, COMING)  # all of them come now
        print("not interrupted")
except KeyboardInterrupt:
    exit_code_counts()
    sys.exit(INTERRUPTED)
"""


@pytest.mark.parametrize("coming", ["2, 15", "15, 1", "2, 15, 1"])
def test_signals_that_come_together_do_not_cut_short_what_follows(coming: str) -> None:
    """A service manager sends SIGTERM and SIGHUP at once; the second met the end of `with`."""
    done = subprocess.run(
        [sys.executable, "-c", _TOGETHER.replace("SIGNALS", coming)],
        capture_output=True, text=True, timeout=30, check=False,
    )  # fmt: skip
    assert (done.returncode, done.stdout, done.stderr) == (INTERRUPTED, "cleaned up\n", "")


_TRAIN: Final = """
import signal, sys
from edge_ident.support.process import INTERRUPTED, end_as_by_ctrl_c, exit_code_counts
signal.signal(signal.SIGINT, signal.SIG_DFL)
end_as_by_ctrl_c()
try:
    signal.raise_signal(signal.SIGINT)
except KeyboardInterrupt:
    for _ in range(30):
        signal.raise_signal(signal.SIGINT)
    exit_code_counts()
    sys.exit(INTERRUPTED)
"""


def test_a_train_of_signals_ends_with_one_interruption() -> None:
    done = subprocess.run(
        [sys.executable, "-c", _TRAIN], capture_output=True, text=True, timeout=30, check=False
    )
    assert (done.returncode, done.stderr) == (INTERRUPTED, "")


def test_an_interrupt_that_something_swallowed_does_not_make_deaf() -> None:
    """After a while the next one counts again."""
    swallowed = _TRAIN.replace("for _ in range(30):", "import time; time.sleep(1.1)\n    if True:")
    done = subprocess.run(
        [sys.executable, "-c", swallowed], capture_output=True, text=True, timeout=30, check=False
    )
    assert "KeyboardInterrupt" in done.stderr


def test_after_an_interruption_no_signal_changes_the_exit_code() -> None:
    """The interpreter puts what it handles back to the default, which ends the process."""
    last = (
        "import atexit\n    atexit.register(lambda: print(signal.getsignal(2) is signal.SIG_IGN))"
    )
    done = subprocess.run(
        [sys.executable, "-c", _TRAIN.replace("    sys.exit", f"    {last}\n    sys.exit")],
        capture_output=True, text=True, timeout=30, check=False,
    )  # fmt: skip
    assert (done.returncode, done.stdout, done.stderr) == (INTERRUPTED, "True\n", "")
