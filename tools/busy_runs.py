"""Whether `edge-ident run` ends well on a computer that is busy with other things.

    python -m tools.busy_runs --runs 20
    python -m tools.busy_runs --runs 4 --board python --busy 8 --speed 2

A board on a pseudo-terminal in real time, runs on it as a user starts them, one after the other,
and beside them processes that do nothing but compute. Prints how each run ended, and the load.
The first run finds gains to be improved, the others the gains that it left.
"""

import argparse
import json
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Final

_ROOT = Path(__file__).parents[1]
sys.path[:0] = [str(_ROOT / "tests" / "firmware_interface")]

from conformance_boards import build_firmware, c_command, python_command, serving  # noqa: E402

from edge_ident.support.process import end_as_by_ctrl_c  # noqa: E402

_RUN: Final = (sys.executable, "-m", "edge_ident", "run", "--no-diagnose", "--json")
_COMPUTE: Final = (sys.executable, "-c", "while True: pass")
_LONGEST_S: Final = 900.0


@dataclass(frozen=True)
class BusyRun:
    """How a run ended.

    Attributes
    ----------
    exit_code : int
    said : str
        Its conclusion, or its error.
    seconds, load : float
        How long it took, and the load of the computer then.
    """

    exit_code: int
    said: str
    seconds: float
    load: float

    def __str__(self) -> str:
        return f"exit {self.exit_code}, {self.seconds:.0f} s, load {self.load:.1f}: {self.said}"


@contextmanager
def busy(processes: int) -> Iterator[None]:
    """So many processes that compute while the body runs."""
    with ExitStack() as ending:
        for _ in range(processes):
            process = subprocess.Popen(_COMPUTE)
            ending.callback(process.wait)
            ending.callback(process.kill)
        yield


def run_on(device: str, folder: Path) -> BusyRun:
    """One run, in a folder of its own."""
    began_s = time.monotonic()
    ended = subprocess.run(
        [*_RUN, "--device", device, "--output", str(folder)],
        capture_output=True,
        text=True,
        timeout=_LONGEST_S,
        check=False,
    )
    document = json.loads(ended.stdout) if ended.stdout else {}
    said = document.get("conclusion") or document.get("cause") or ended.stderr
    return BusyRun(ended.returncode, said, time.monotonic() - began_s, os.getloadavg()[0])


def runs(command: list[str], count: int, processes: int, folder: Path) -> Iterator[BusyRun]:
    """Runs on one board, one after the other, beside so many busy processes."""
    with serving(command) as board, busy(processes):
        for number in range(count):
            yield run_on(board.url, folder / f"run_{number}")


def main() -> int:
    """Run the campaign; gives how many runs did not end well."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--runs", type=int, default=20)
    parser.add_argument("--busy", type=int, default=4, help="processes beside")
    parser.add_argument("--speed", type=float, default=1.0)
    parser.add_argument("--board", choices=("c", "python"), default="c")
    asked = parser.parse_args()
    failed = 0
    with tempfile.TemporaryDirectory() as folder:
        if asked.board == "c":
            build_firmware(Path(folder), "all")
            command = c_command(Path(folder), speed=asked.speed)
        else:
            command = python_command(speed=asked.speed)
        for ended in runs(command, asked.runs, asked.busy, Path(folder)):
            print(ended, flush=True)
            failed += ended.exit_code != 0
    print(f"{asked.runs - failed} of {asked.runs} runs ended well")
    return failed


if __name__ == "__main__":
    end_as_by_ctrl_c()
    sys.exit(min(main(), 1))
