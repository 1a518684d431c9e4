"""What starting costs: processor time and memory of whole processes.

    python tools/profile_start.py --repetitions 20

A process of `edge-ident identify` is compared with one that only imports numpy and onnxruntime, in
turn. The memory is that of `identify`, and of a whole `run` on the virtual board.
"""

import argparse
import os
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import Final

import numpy as np

from edge_ident.signals.recording_files import save_recording
from edge_ident.simulation.simulate import simulate

START_LIMIT: Final = 2.2
"""Processor time of `identify`, in times of importing numpy and onnxruntime: as much again for all
that is our own."""
MEMORY_LIMIT_MIB: Final = 90.0
"""A sixth of what a board with 512 MiB has."""


def process_cost(arguments: Sequence[str]) -> tuple[float, float]:
    """Processor time of a whole Python process in ms, and its largest memory in MiB.

    Raises
    ------
    RuntimeError
        It fails.
    """
    # compiled files stay, as where edge-ident is installed; the command line starts no threads of
    # numpy, so its opponent does not either
    kept = {k: v for k, v in os.environ.items() if k != "PYTHONDONTWRITEBYTECODE"}
    kept["OMP_NUM_THREADS"] = "1"
    process = subprocess.Popen(
        [sys.executable, *arguments], env=kept,
        stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
    )  # fmt: skip
    _, status, used = os.wait4(process.pid, 0)
    process.returncode = os.waitstatus_to_exitcode(status)
    if process.returncode:
        raise RuntimeError(f"{' '.join(arguments)}: exit code {process.returncode}")
    return 1e3 * (used.ru_utime + used.ru_stime), used.ru_maxrss / 1024.0


def start_cost(repetitions: int) -> None:
    """Print what starting costs: processor time and memory of whole processes."""
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "recording.npz"
        save_recording(simulate(noise=0.02), file)
        identified = ["-m", "edge_ident", "identify", str(file), "--json"]
        imports = ["-c", "import numpy, onnxruntime"]
        costs = np.array(
            [[process_cost(imports), process_cost(identified)] for _ in range(repetitions)]
        )
        run = ["-m", "edge_ident", "run", "--device", "virtual", "--output", folder, "--json"]
        memory_mib = {"identify": costs[:, 1, 1].max(), "run": process_cost(run)[1]}
    imports_ms, identify_ms = np.median(costs[:, :, 0], axis=0)
    times = float(np.median(costs[:, 1, 0] / costs[:, 0, 0]))
    print(
        f"identify: {identify_ms:.0f} ms of processor time, {times:.2f} times the {imports_ms:.0f} "
        f"ms of importing numpy and onnxruntime; limit {START_LIMIT} {_kept(times <= START_LIMIT)}"
    )
    for command, mib in memory_mib.items():
        kept = _kept(mib <= MEMORY_LIMIT_MIB)
        print(f"{command}: at most {mib:.0f} MiB; limit {MEMORY_LIMIT_MIB:.0f} MiB {kept}")


def _kept(within: bool) -> str:
    return "kept" if within else "missed"


def main() -> None:
    """Entry point."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--repetitions", type=int, default=20)
    start_cost(parser.parse_args().repetitions)


if __name__ == "__main__":
    main()
