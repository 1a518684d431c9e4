"""Latency of every stage from the last captured sample to verified gains, as table and JSON.

The same measurement as `edge-ident profile`, kept as a script for boards that are profiled in
batches: pass several devices to compare them.

    python tools/profile_latency.py --repetitions 100 --output runs/latency virtual /dev/ttyACM0
"""

import argparse
from pathlib import Path

from edge_ident.commissioning.profiling import profile_device
from edge_ident.report import profile_document, profile_view, show, write_json


class _Lines:
    """Progress as plain lines, for logs."""

    def stage(self, title: str) -> None:
        print(f"… {title}", flush=True)

    def samples(self, in_hand: int, expected: int) -> None:
        pass

    def say(self, message: str) -> None:
        print(message, flush=True)


def main() -> None:
    """Profile each device in turn."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("devices", nargs="*", default=["virtual"])
    parser.add_argument("--repetitions", type=int, default=100)
    parser.add_argument("--baud-rate", type=int)
    parser.add_argument("--output", type=Path, default=Path("runs/latency"))
    given = parser.parse_args()
    for number, device in enumerate(given.devices):
        profile = profile_device(device, given.baud_rate, given.repetitions, _Lines())
        show(profile_view(profile))
        path = given.output / f"profile_{number}.json"
        write_json(profile_document(profile), path)
        print(f"written: {path}")


if __name__ == "__main__":
    main()
