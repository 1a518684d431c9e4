"""Play random fault schedules and print the seed of each that breaks an invariant.

    python tools/fault_schedules.py --count 10000       on the line in memory
    python tools/fault_schedules.py --pty 300           on pseudo-terminals, by the wall clock

A schedule is a handful of motions, gain writes, stops, dead hosts and pulled cables. The line
loses, repeats, delays, cuts, merges, flips and swaps frames. Some schedules cut the board's power.
tests/firmware_interface/fault_schedule.py says what must hold. Repeat one with
--first SEED --count 1.
"""

import argparse
import logging
import sys
import tempfile
import time
import traceback
from collections.abc import Callable
from pathlib import Path

_ROOT = Path(__file__).parents[1]
sys.path[:0] = [str(_ROOT), str(_ROOT / "tests" / "firmware_interface")]

from fault_line import FaultyLine  # noqa: E402
from fault_schedule import run_schedule  # noqa: E402
from memory_line import MemoryLine, virtual_time  # noqa: E402
from pty_bench import pty_bench  # noqa: E402

_PTY_SPEED = 2.0


def in_memory(seed: int) -> None:
    """Play a schedule in memory: the same for the same seed."""
    line = MemoryLine(FaultyLine(seed=seed))
    with virtual_time(line):
        run_schedule(seed, line)


def on_a_pty(seed: int) -> None:
    """Play a schedule on a pseudo-terminal of its own."""
    with (
        tempfile.TemporaryDirectory() as folder,
        pty_bench(Path(folder), FaultyLine(seed=seed), _PTY_SPEED) as bench,
    ):
        run_schedule(seed, bench)


def play(what: str, schedule: Callable[[int], None], seeds: range) -> int:
    """Play schedules; gives how many break an invariant."""
    broken = 0
    started_s = time.monotonic()
    for seed in seeds:
        try:
            schedule(seed)
        except Exception:
            broken += 1
            print(f"{what}, seed {seed}: {traceback.format_exc()}", flush=True)
    taken_s = time.monotonic() - started_s
    print(f"{what}: {len(seeds)} schedules, {broken} broken, {taken_s:.0f} s", flush=True)
    return broken


def main() -> None:
    """Entry point."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--count", type=int, default=0, help="schedules in memory")
    parser.add_argument("--pty", type=int, default=0, help="schedules on pseudo-terminals")
    parser.add_argument("--first", type=int, default=0, help="first seed")
    given = parser.parse_args()
    logging.disable(logging.CRITICAL)
    broken = 0
    if given.count:
        broken += play("memory", in_memory, range(given.first, given.first + given.count))
    if given.pty:
        broken += play("pseudo-terminal", on_a_pty, range(given.first, given.first + given.pty))
    sys.exit(1 if broken else 0)


if __name__ == "__main__":
    main()
