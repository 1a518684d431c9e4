"""Latency of every stage from the last captured sample to verified gains, as table and JSON.

The same measurement as `edge-ident profile`, kept as a script for boards that are profiled in
batches: pass several devices to compare them.

    python tools/profile_latency.py --repetitions 100 --output runs/latency virtual /dev/ttyACM0
    python tools/profile_latency.py --check

`--check` needs no board. It tells what the check of the base model costs: two axes of 44 s, in
processor time, because on a busy machine the clock tells more of the others than of the check.
"""

import argparse
import time
from pathlib import Path
from typing import Final

import numpy as np

from edge_ident.commissioning.profiling import profile_device
from edge_ident.drive.motions import MotionName
from edge_ident.identification.identify import identify
from edge_ident.report import profile_document, profile_view, show, write_json
from edge_ident.simulation.simulate import simulate
from edge_ident.support.stopwatch import Stopwatch

CHECK_LIMIT_MS: Final = 20.0
"""Processor time that the check may take: a fiftieth of the second from the last sample to gains.
"""
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


def main() -> None:
    """Profile each device in turn, or the check of the base model."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("devices", nargs="*", default=["virtual"])
    parser.add_argument("--repetitions", type=int, default=100)
    parser.add_argument("--baud-rate", type=int)
    parser.add_argument("--output", type=Path, default=Path("runs/latency"))
    parser.add_argument("--check", action="store_true", help="cost of the check alone")
    given = parser.parse_args()
    for motion in MOTIONS if given.check else ():
        check_ms, share = check_cost(motion, given.repetitions)
        kept = "kept" if check_ms <= CHECK_LIMIT_MS else "missed"
        print(
            f"{motion}: the check takes {check_ms:.1f} ms of processor time, {share:.0%} of the "
            f"identification; limit {CHECK_LIMIT_MS:.0f} ms {kept}"
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
