"""Latency of every stage from the last captured sample to verified gains, as table and JSON.

The same measurement as `edge-ident profile`, kept as a script for boards that are profiled in
batches: pass several devices to compare them. Their axes move by the sinusoid of the drive.

    python tools/profile_latency.py --repetitions 100 --output runs/latency virtual
    python tools/profile_latency.py --drive press.toml /dev/ttyACM0 /dev/ttyACM1
    python tools/profile_latency.py --commit
    python tools/profile_latency.py --stages
    python tools/profile_latency.py --check
    python tools/profile_latency.py --gains
    python tools/profile_latency.py --network

`--commit` measures the way from the last sample to gains read back alone, with a stop before the
commit and without, in turn.

The last four need no board. `--stages` tells what the stages of the identification of two axes of
22 s cost, `cnn` with `align`, `image` and `network` in it; `--check` what the check of the base
model costs, on two axes of 44 s; `--gains` what the design of the gains of two axes costs;
`--network` what the network costs that reads efforts, beside the one that reads their images. All
measure processor time, because on a busy machine the clock tells more of the others than of the
work.
"""

import argparse
import os
import time
from pathlib import Path
from typing import Final

os.environ.setdefault("OMP_NUM_THREADS", "1")  # before numpy is loaded, as edge-ident does

import numpy as np
from numpy.typing import NDArray

from edge_ident.commissioning.latency import board_at, measured_ways, profile_device, spread
from edge_ident.control.gain_design import design
from edge_ident.control.position_loop import LoopHardware
from edge_ident.drive.description import Drive, load_drive
from edge_ident.drive.motions import MotionName
from edge_ident.estimation.manifest import BUILT_IN, GRAPHS, Graph, load_manifest
from edge_ident.estimation.network import Network, load_network
from edge_ident.identification.identify import identify
from edge_ident.model.model import Estimate, base_axis
from edge_ident.report import machine, render, run_documents
from edge_ident.signals.metrics import POINTS
from edge_ident.simulation.simulate import simulate
from edge_ident.support import documents, stopwatch

Array = NDArray[np.float64]

CHECK_LIMIT_MS: Final = 20.0
"""Processor time that the check may take: a fiftieth of the second from the last sample to gains.
"""
GAINS_LIMIT_MS: Final = 3.0
"""Time that the gains of two axes may take."""
NETWORK_LIMIT_MS: Final = 4.0
"""Time that the network may take for two axes, all passes together."""
BATCHES: Final = (("one image", 1, 1), ("two axes", 2, 2), ("64 starts", 64, 1))
"""Name, guesses and measurements of what the network reads at once."""
_IN_A_ROW: Final = 5  # passes of one network before the other's turn, as in a loop
MOTIONS: Final[tuple[MotionName, ...]] = ("sinusoid", "multisine")


class _Lines:
    """Progress as plain lines, for logs."""

    def stage(self, title: str) -> None:
        print(f"… {title}", flush=True)

    def samples(self, in_hand: int, expected: int) -> None:
        pass

    def say(self, message: str) -> None:
        print(message, flush=True)


def identification_costs(repetitions: int) -> dict[str, float]:
    """Median processor time of each stage of an identification with its network, ms."""
    recording, network = simulate(noise=0.02), load_network("fp32")
    spent: dict[str, list[float]] = {}
    for _ in range(repetitions):
        watch = stopwatch.Stopwatch(time.process_time)
        times_ms = identify(recording, network, diagnose=False, stopwatch=watch).timing_ms
        for stage, stage_ms in times_ms.items():
            spent.setdefault(stage, []).append(stage_ms)
    return {stage: float(np.median(of_stage)) for stage, of_stage in spent.items()}


def check_cost(motion: MotionName, repetitions: int) -> tuple[float, float]:
    """Median processor time of the check in ms, and its share of the whole identification."""
    recording = simulate(motion=motion, cycles=2, noise=0.02)
    spent = []
    for _ in range(repetitions):
        watch = stopwatch.Stopwatch(time.process_time)
        times_ms = identify(recording, diagnose=False, stopwatch=watch).timing_ms
        spent.append((times_ms["adequacy"], times_ms["total"]))
    check_ms, total_ms = np.median(spent, axis=0)
    return float(check_ms), float(check_ms / total_ms)


def gains_cost(repetitions: int) -> tuple[float, float]:
    """Median processor and wall time of the gains of two axes in ms, each time of other drives."""
    rng, hardware = np.random.default_rng(1), LoopHardware(0.0025, 0.0005, 2.0 * np.pi / 8400, 12.0)
    nominal = np.array([0.43, 0.9, 1.4, 0.03])
    spent = []
    for _ in range(repetitions):
        axes = [
            base_axis(Estimate(nominal * rng.uniform(0.5, 2.0, 4), 0.005 * nominal))
            for _ in range(2)
        ]
        began_s = time.process_time(), time.perf_counter()
        for axis in axes:
            design(axis, hardware)
        spent.append((time.process_time() - began_s[0], time.perf_counter() - began_s[1]))
    processor_s, wall_s = np.median(spent, axis=0)
    return 1e3 * float(processor_s), 1e3 * float(wall_s)


def network_costs(guesses: int, measurements: int, repetitions: int) -> tuple[Array, Array]:
    """Processor time of a pass by image and by efforts, ms, in turn: two (repetitions,) arrays."""
    manifest, content = load_manifest(BUILT_IN), BUILT_IN.with_name("feed_drive_fp32.onnx")
    networks = [Network(content.read_bytes, manifest, "fp32", g) for g in ("image", "rank_one")]
    rng = np.random.default_rng(2)
    model, measured = rng.normal(size=(guesses, POINTS)), rng.normal(size=(measurements, POINTS))
    spent = np.empty((2, repetitions))
    for turn in range(repetitions):
        for network, of_network in zip(networks, spent, strict=True):
            began_s = time.process_time()
            for _ in range(_IN_A_ROW):
                network.residuals_of(model, measured)
            of_network[turn] = 1e3 * (time.process_time() - began_s) / _IN_A_ROW
    return spent[0], spent[1]


def stage_costs(repetitions: int) -> dict[Graph, float]:
    """Median processor time of the network in the identification of two axes, by graph, ms."""
    manifest, content = load_manifest(BUILT_IN), BUILT_IN.with_name("feed_drive_fp32.onnx")
    networks = {g: Network(content.read_bytes, manifest, "fp32", g) for g in GRAPHS}
    spent: dict[Graph, list[float]] = {graph: [] for graph in GRAPHS}
    for seed in range(repetitions):
        recording = simulate(noise=0.02, seed=seed)
        for graph, network in networks.items():
            watch = stopwatch.Stopwatch(time.process_time)
            times_ms = identify(recording, network, diagnose=False, stopwatch=watch).timing_ms
            spent[graph].append(times_ms["network"])
    return {graph: float(np.median(of_graph)) for graph, of_graph in spent.items()}


def show_network(repetitions: int) -> None:
    """Print what the network costs by image and by efforts."""
    for name, guesses, measurements in BATCHES:
        by_image, by_efforts = network_costs(guesses, measurements, repetitions)
        print(
            f"{name}: {np.median(by_image) / guesses:.3f} ms an image, from efforts "
            f"{np.median(by_efforts) / guesses:.3f} ms, {np.median(by_image / by_efforts):.2f} "
            "times as fast"
        )
    stage = stage_costs(repetitions)
    print(
        f"all passes of two axes: from images {stage['image']:.1f} ms, from efforts "
        f"{stage['rank_one']:.1f} ms; {_judged(stage['rank_one'], NETWORK_LIMIT_MS)}"
    )


def show_stages(repetitions: int) -> None:
    """Print what the stages of an identification cost."""
    for stage, spent_ms in identification_costs(repetitions).items():
        print(f"{stage}: {spent_ms:.1f} ms of processor time")


def show_check(repetitions: int) -> None:
    """Print what the check of the base model costs."""
    for motion in MOTIONS:
        check_ms, share = check_cost(motion, repetitions)
        print(
            f"{motion}: the check takes {check_ms:.1f} ms of processor time, {share:.0%} of the "
            f"identification; {_judged(check_ms, CHECK_LIMIT_MS)}"
        )


def show_gains(repetitions: int) -> None:
    """Print what the design of gains costs."""
    processor_ms, wall_ms = gains_cost(repetitions)
    print(
        f"the gains of two axes take {processor_ms:.1f} ms of processor time, {wall_ms:.1f} ms by "
        f"the clock; {_judged(processor_ms, GAINS_LIMIT_MS)}"
    )


def show_ways(device: str, baud_rate: int | None, drive: Drive, repetitions: int) -> None:
    """Print how long gains take from the last sample on, with a stop and without."""
    recording, network = simulate(noise=0.02), load_network("fp32")
    with board_at(device, baud_rate) as board:
        ways_ms = measured_ways(board, drive, recording, network, repetitions, _Lines())
    for way, times in ways_ms.items():
        of = spread(times)
        print(f"{way}: p50 {of.p50:.0f} ms, p95 {of.p95:.0f} ms, max {of.maximum:.0f} ms")
    medians = [spread(times).p50 for times in ways_ms.values()]
    print(f"{medians[0] / medians[-1]:.2f} times as fast without the stop")


def _judged(spent_ms: float, limit_ms: float) -> str:
    return f"limit {limit_ms:.0f} ms {'kept' if spent_ms <= limit_ms else 'missed'}"


def main() -> None:
    """Profile each device in turn, or parts of the work that need none."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("devices", nargs="*", default=["virtual"])
    parser.add_argument("--repetitions", type=int, default=100)
    parser.add_argument("--baud-rate", type=int)
    parser.add_argument("--drive", type=Path, help="description of the drive behind the devices")
    parser.add_argument("--output", type=Path, default=Path("runs/latency"))
    parser.add_argument("--commit", action="store_true", help="commit with a stop and without")
    parser.add_argument("--stages", action="store_true", help="cost of the identification alone")
    parser.add_argument("--check", action="store_true", help="cost of the check alone")
    parser.add_argument("--gains", action="store_true", help="cost of the gain design alone")
    parser.add_argument("--network", action="store_true", help="cost of the network alone")
    given = parser.parse_args()
    parts = {
        show_stages: given.stages,
        show_check: given.check,
        show_gains: given.gains,
        show_network: given.network,
    }
    for show_part, asked in parts.items():
        if asked:
            show_part(given.repetitions)
    if any(parts.values()):
        return
    drive = load_drive(given.drive)
    for number, device in enumerate(given.devices):
        if given.commit:
            show_ways(device, given.baud_rate, drive, given.repetitions)
            continue
        profile = profile_device(device, given.baud_rate, drive, given.repetitions, _Lines())
        render.show(machine.profile_view(profile))
        path = given.output / f"profile_{number}.json"
        documents.write_json(run_documents.profile_document(profile), path)
        print(f"written: {path}")


if __name__ == "__main__":
    main()
