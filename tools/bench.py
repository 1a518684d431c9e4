"""How fast the parts are, each beside a fixed opponent, as ratios within one run.

    python tools/bench.py
    python tools/bench.py --repetitions 400 --history runs/bench.jsonl

Each part and its opponent do the same work in turn on the same machine, so a ratio means the same
on a busy machine and on a quiet one. Above 1, this project's way is the faster. The opponents:

- the network as a plain fp32 graph that reads images;
- pymodbus's synchronous client, over a pseudo-terminal without pacing;
- scipy's Butterworth filter run both ways (`sosfiltfilt`) and numpy's gradient, twice;
- least squares alone, beside the whole identification with its network.

Times are processor time, but for the link's, whose client waits. Each run adds a line to the
history, and the median of the lines before stands beside each ratio.
"""

import argparse
import json
import os
import platform
import sys
import time
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, Final

os.environ.setdefault("OMP_NUM_THREADS", "1")  # before numpy is loaded, as edge-ident does
sys.path.insert(0, str(Path(__file__).parents[1]))  # the other scripts, wherever this one begins

import numpy as np
import scipy.signal
from numpy.typing import NDArray

from edge_ident.estimation.network import load_network
from edge_ident.identification.identify import identify
from edge_ident.signals.filters import differentiate
from edge_ident.simulation.simulate import simulate
from edge_ident.support.version import VERSION
from tools.link_overhead import client_times_ms
from tools.profile_latency import BATCHES, network_costs

Array = NDArray[np.float64]

HISTORY: Final = Path("runs/bench.jsonl")
CUTOFF_HZ: Final = 5.6
"""Of the filters: what `identify` chooses for the built-in drive."""


def network_ratios(repetitions: int) -> dict[str, float]:
    """The network from efforts beside the plain graph, by what is read at once."""
    ratios = {}
    for name, guesses, measurements in BATCHES:
        plain, ours = network_costs(guesses, measurements, repetitions)
        ratios[f"network, {name}: plain fp32 graph"] = float(np.median(plain / ours))
    return ratios


def link_ratio(repetitions: int) -> dict[str, float]:
    """A request by this project's link beside pymodbus's own client, ten for each repetition."""
    times_ms = client_times_ms(10 * repetitions)
    ratio = np.median(times_ms["pymodbus"]) / np.median(times_ms["edge-ident"])
    return {"a request: pymodbus's synchronous client": float(ratio)}


def filter_ratio(repetitions: int) -> dict[str, float]:
    """Filtered position, velocity and acceleration of an axis beside scipy's filter."""
    recording = simulate(noise=0.02)
    position = recording.axes["x"].position
    period_s = float(recording.time_s[1] - recording.time_s[0])
    sections = scipy.signal.butter(4, CUTOFF_HZ, fs=1.0 / period_s, output="sos")

    def theirs() -> Array:
        smooth = scipy.signal.sosfiltfilt(sections, position)
        velocity = np.gradient(smooth, period_s)
        return np.stack([smooth, velocity, np.gradient(velocity, period_s)])

    ratio = _times_as_fast(
        theirs, lambda: differentiate(position, CUTOFF_HZ, period_s), repetitions
    )
    return {"filter and derivatives: scipy's sosfiltfilt": ratio}


def identification_ratio(repetitions: int) -> dict[str, float]:
    """The whole identification beside one by least squares alone."""
    recording, network = simulate(noise=0.02), load_network("fp32")
    ratio = _times_as_fast(
        lambda: identify(recording, diagnose=False),
        lambda: identify(recording, network, diagnose=False),
        repetitions,
    )
    return {"identification with its network: least squares alone": ratio}


def _times_as_fast(
    theirs: Callable[[], object], ours: Callable[[], object], repetitions: int
) -> float:
    """Median of the ratios of their processor time to ours, taken in turn."""
    spent = np.empty((repetitions, 2))
    for row in spent:
        for place, work in enumerate((theirs, ours)):
            began_s = time.process_time()
            work()
            row[place] = time.process_time() - began_s
    return float(np.median(spent[:, 0] / spent[:, 1]))


def earlier_medians(history: Path) -> dict[str, float]:
    """Medians of each ratio in the lines of a history file; empty where there is none."""
    if not history.is_file():
        return {}
    lines = [json.loads(line)["ratios"] for line in history.read_text("utf-8").splitlines()]
    return {
        name: float(np.median([line[name] for line in lines if name in line]))
        for name in {name for line in lines for name in line}
    }


def note(history: Path, ratios: Mapping[str, float]) -> None:
    """Add a line to the history file."""
    line: dict[str, Any] = {
        "time": time.strftime("%Y-%m-%dT%H:%M:%SZ", time.gmtime()),
        "version": VERSION,
        "machine": f"{platform.machine()}, {os.cpu_count()} cores, Python "
        f"{platform.python_version()}, numpy {np.__version__}",
        "ratios": {name: round(ratio, 3) for name, ratio in ratios.items()},
    }
    history.parent.mkdir(parents=True, exist_ok=True)
    with history.open("a", encoding="utf-8") as file:
        print(json.dumps(line), file=file)


def main() -> None:
    """Measure, print, and add to the history."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n", 1)[0])
    parser.add_argument("--repetitions", type=int, default=100, help="of each measurement")
    parser.add_argument("--history", type=Path, default=HISTORY, help="file of earlier runs")
    given = parser.parse_args()
    before = earlier_medians(given.history)
    print(f"{'part: opponent':56} {'times as fast':>13} {'before':>8}")
    ratios: dict[str, float] = {}
    parts = (network_ratios, link_ratio, filter_ratio, identification_ratio)
    for part in parts:
        measured = part(given.repetitions)
        for name, ratio in measured.items():
            known = f"{before[name]:8.2f}" if name in before else f"{'–':>8}"
            print(f"{name:56} {ratio:13.2f} {known}", flush=True)
        ratios |= measured
    note(given.history, ratios)
    print(f"added to {given.history}")


if __name__ == "__main__":
    main()
