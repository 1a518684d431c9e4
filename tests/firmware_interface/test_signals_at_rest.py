"""No signal that a host can catch leaves the effort on where no watchdog runs: at rest."""

import signal
import subprocess
import sys
from typing import Final

import pytest

_AT_REST: Final = """
import os, signal, sys, time
from edge_ident.commissioning.safety import ready_to_move
from edge_ident.support.process import end_as_by_ctrl_c
from firmware_interface.board import Board
from firmware_interface.virtual.board import VirtualBoard
signal.signal(signal.SIGINT, signal.default_int_handler)  # a runner in the background ignores it
end_as_by_ctrl_c()
board = Board.connect(VirtualBoard())
coming = int(sys.argv[1])
before = signal.getsignal(coming)
try:
    with ready_to_move(board, lambda text: None):
        print(board.status().enabled)
        os.kill(os.getpid(), coming)
        time.sleep(1.0)
except KeyboardInterrupt:
    print(board.status().enabled, signal.getsignal(coming) is before)
"""


@pytest.mark.parametrize(
    "coming",
    ["SIGINT", "SIGTERM", "SIGUSR1", "SIGUSR2", "SIGALRM", "SIGXCPU", "SIGTSTP", "SIGTTOU"],
)
def test_a_signal_at_rest_switches_the_effort_off(coming: str) -> None:
    """The last two, Ctrl-Z the one, mean what they always do once the machine is left."""
    done = subprocess.run(
        [sys.executable, "-c", _AT_REST, str(int(getattr(signal, coming)))],
        capture_output=True, text=True, timeout=60, check=False,
    )  # fmt: skip
    assert (done.returncode, done.stdout) == (0, "True\nFalse True\n"), done.stderr
