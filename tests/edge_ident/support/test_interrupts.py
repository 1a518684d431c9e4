"""Ctrl-C interrupts wherever it comes, and the exit code says so."""

import signal
import subprocess
import sys
from typing import Final

import pytest

from edge_ident.support.interrupts import INTERRUPTED

_BEGIN: Final = """
import os, signal, sys, time
from edge_ident.support.interrupts import INTERRUPTED, end_as_by_ctrl_c, exit_code_counts
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


@pytest.mark.parametrize("ending", [signal.SIGINT, signal.SIGTERM])
@pytest.mark.parametrize("place", _PLACES)
def test_an_interrupt_is_not_lost(place: str, ending: signal.Signals) -> None:
    program = _BEGIN.replace("ENDING", str(int(ending))) + _PLACES[place] + _END
    done = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, timeout=30, check=False
    )
    assert (done.returncode, done.stderr) == (INTERRUPTED, "")
