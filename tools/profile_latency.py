"""Latency of every stage from the last captured sample to verified gains, as table and JSON.

The same measurement as `edge-ident profile`, kept as a script for boards that are profiled in
batches: pass several devices to compare them.

    python tools/profile_latency.py --repetitions 100 --output runs/latency virtual /dev/ttyACM0
    python tools/profile_latency.py --check
    python tools/profile_latency.py --start --repetitions 20

`--check` needs no board. It tells what the check of the base model costs: two axes of 44 s, in
processor time, because on a busy machine the clock tells more of the others than of the check.
`--start` needs none either. It tells what a whole process of `edge-ident identify` costs beside one
that only imports numpy and onnxruntime, in turn, and how much memory it and a whole `run` on the
virtual board take.
"""

import argparse
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Final

import numpy as np

from edge_ident.commissioning.profiling import profile_device
from edge_ident.drive.motions import MotionName
from edge_ident.identification.identify import identify
from edge_ident.report import profile_document, profile_view, show, write_json
from edge_ident.signals.recording_files import save_recording
from edge_ident.simulation.simulate import simulate
from edge_ident.support.stopwatch import Stopwatch

CHECK_LIMIT_MS: Final = 20.0
"""Processor time that the check may take: a fiftieth of the second from the last sample to gains.
"""
START_LIMIT: Final = 2.2
"""Processor time of `identify`, in times of importing numpy and onnxruntime: as much again for all
that is our own."""
MEMORY_LIMIT_MIB: Final = 90.0
"""A sixth of what a board with 512 MiB has."""
MOTIONS: Final[tuple[MotionName, ...]] = ("sinusoid", "multisine")


class _Lines:
    """Progress as plain lines, for logs."""

    def stage(self, title: str) -> None:
        print(f"… {title}", flush=True)

    def samples(self, in_hand: int, expected: int) -> None:
        pass

    def say(self, message: str) -> None:
        print(message, flush=True)


def check_cost(motion: MotionName, repetitions: int) -> tuple[float, float]:
    """Median processor time of the check in ms, and its share of the whole identification."""
    recording = simulate(motion=motion, cycles=2, noise=0.02)
    spent = []
    for _ in range(repetitions):
        watch = Stopwatch(time.process_time)
        times_ms = identify(recording, diagnose=False, stopwatch=watch).timing_ms
        spent.append((times_ms["adequacy"], times_ms["total"]))
    check_ms, total_ms = np.median(spent, axis=0)
    return float(check_ms), float(check_ms / total_ms)


def process_cost(arguments: Sequence[str]) -> tuple[float, float]:
    """Processor time of a whole Python process in ms, and its largest memory in MiB.

    Raises
    ------
    RuntimeError
        It fails.
    """
    # compiled files stay, as where edge-ident is installed
    kept = {k: v for k, v in os.environ.items() if k != "PYTHONDONTWRITEBYTECODE"}
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
        f"identify: {identify_ms:.0f} ms of processor time, {times:.1f} times the {imports_ms:.0f} "
        f"ms of importing numpy and onnxruntime; limit {START_LIMIT} {_kept(times <= START_LIMIT)}"
    )
    for command, mib in memory_mib.items():
        kept = _kept(mib <= MEMORY_LIMIT_MIB)
        print(f"{command}: at most {mib:.0f} MiB; limit {MEMORY_LIMIT_MIB:.0f} MiB {kept}")


def _kept(within: bool) -> str:
    return "kept" if within else "missed"


def main() -> None:
    """Profile each device in turn, or the check of the base model, or the start."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("devices", nargs="*", default=["virtual"])
    parser.add_argument("--repetitions", type=int, default=100)
    parser.add_argument("--baud-rate", type=int)
    parser.add_argument("--output", type=Path, default=Path("runs/latency"))
    parser.add_argument("--check", action="store_true", help="cost of the check alone")
    parser.add_argument("--start", action="store_true", help="start and memory of processes alone")
    given = parser.parse_args()
    if given.start:
        start_cost(given.repetitions)
        return
    for motion in MOTIONS if given.check else ():
        check_ms, share = check_cost(motion, given.repetitions)
        print(
            f"{motion}: the check takes {check_ms:.1f} ms of processor time, {share:.0%} of the "
            f"identification; limit {CHECK_LIMIT_MS:.0f} ms {_kept(check_ms <= CHECK_LIMIT_MS)}"
        )
    if given.check:
        return
    for number, device in enumerate(given.devices):
        profile = profile_device(device, given.baud_rate, given.repetitions, _Lines())
        show(profile_view(profile))
        path = given.output / f"profile_{number}.json"
        write_json(profile_document(profile), path)
        print(f"written: {path}")


if __name__ == "__main__":
    main()
