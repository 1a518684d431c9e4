"""What each choice of the recipe is worth: the rows of the ablation table in docs/accuracy.md.

    python tools/ablations.py                   all rows, about an hour on one core
    python tools/ablations.py min-max rotations

Every network is trained here, in the minutes that its row says, and judged on recordings of drives
that training never saw: parameter errors in shares of the effort (their range is one), and the
torque that the answer misses. Rows of one block differ in the one thing that they name.
"""

import argparse
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray
from rich.console import Console
from rich.table import Table

from edge_ident.estimation.image import effort_scale
from edge_ident.estimation.network import Network, load_network
from edge_ident.signals.metrics import compare
from export.checkpoint import trained_network
from export.configuration import IMPROVED, Configuration
from export.evaluate import (
    DriveSet,
    EvaluationDrives,
    evaluation_drives,
    guessed,
    identified,
    solved,
)
from export.motion import paper_motion
from export.torch_runtime import TorchNetwork
from export.train import TrainingProgress, train

Array = NDArray[np.float64]
Answer = Callable[[DriveSet], Array]

SCRATCH: Final = replace(
    IMPROVED,
    name="from scratch",
    motions=32,
    drives_with_effect=0,
    start_shares=None,
    loss="sigmoid",
    learning_rate=1e-3,
    head_steps=0,
    dense_steps=0,
    dense_examples=0,
    steps=1000,
    batch=32,
)
"""The paper's image and loss, from random weights, with Adam."""
SHORT: Final = replace(
    IMPROVED,
    name="short",
    motions=32,
    drives_with_effect=6,
    head_steps=3000,
    dense_steps=1500,
    dense_examples=20_000,
    steps=200,
)
"""The improved recipe in a sixth of its time."""
ROWS: Final[dict[str, Configuration | None]] = {
    "reference": SCRATCH,
    "min-max": replace(SCRATCH, normalization="min-max"),
    "rotations": replace(SCRATCH, rotations=True),
    "50-points": replace(SCRATCH, points=50),
    "200-points": replace(SCRATCH, points=200),
    "improved-short": SHORT,
    "improved-no-effects": replace(SHORT, drives_with_effect=0),
    "shipped-fp32": None,
    "shipped-int8": None,
    "no-network": None,
}


@dataclass(frozen=True)
class Judged:
    """One answer to all drives of a set."""

    error_median: float
    error_p95: float
    residual_median: float
    metric_passed: float


def judge(drives: DriveSet, found: Array) -> Judged:
    """Compare found parameters (n, 4) with the truth."""
    error = np.abs(drives.shares(found - drives.parameters))
    metrics = [
        compare(base, regressor @ parameters)
        for base, regressor, parameters in zip(
            drives.base_effort, drives.regressor, found, strict=True
        )
    ]
    return Judged(
        error_median=float(np.median(error)),
        error_p95=float(np.quantile(error, 0.95)),
        residual_median=float(np.median([metric.relative_residual for metric in metrics])),
        metric_passed=float(np.mean([metric.time_spectral >= 0.98 for metric in metrics])),
    )


def loop(network: Network, passes: int) -> Answer:
    """The loop of the runtime, guard included."""
    return lambda drives: identified(network, drives, passes)


def unguarded(network: Network, passes: int) -> Answer:
    """The network applied to its own answers, whatever they are."""
    manifest = network.manifest

    def answer(drives: DriveSet) -> Array:
        scale = effort_scale(drives.effort, manifest.normalization)[:, None]
        scaled, measured = drives.regressor / drives.column_scales, drives.effort / scale
        here = np.random.default_rng(1).uniform([0.0, 0.0, 0.0, -1.0], 1.0, (len(scale), 4))
        for _ in range(passes):
            model = (scaled @ here[:, :, None])[:, :, 0]
            here = here - network.residuals_of(model, measured)
        return here * scale / drives.column_scales

    return answer


class Ablations:
    """Runs rows and collects them in one table."""

    def __init__(self, console: Console) -> None:
        self._console = console
        self._motion = paper_motion()
        self._drives: dict[int, EvaluationDrives] = {}
        self.table = Table("row", "answer", "drives", "error median", "error 95 %", "residual",
                           "metric ≥ 0.98", "minutes")  # fmt: skip

    def run(self, name: str) -> None:
        """One row of `ROWS`, all its answers."""
        configuration, began_s = ROWS[name], time.perf_counter()
        if name == "no-network":
            answers: dict[str, Answer] = {
                "random search, 8 tries": guessed,
                "least squares": solved,
            }
        elif configuration is None:
            network: Network = load_network("int8" if name.endswith("int8") else "fp32")
            answers = {"at most 10 passes": loop(network, 10)}
        else:
            network = self._train(configuration)
            answers = {"one pass": loop(network, 1)}
            if configuration.start_shares is None:
                answers["8 passes, guarded"] = loop(network, 8)
                answers["8 passes, no guard"] = unguarded(network, 8)
            else:
                answers["at most 10 passes"] = loop(network, 10)
        minutes = (time.perf_counter() - began_s) / 60.0
        drives = self._evaluation_drives(configuration.points if configuration else 100)
        for title, answer in answers.items():
            for kind, some in (("noisy", drives.noisy), ("one effect", drives.disturbed)):
                self._add(name, title, kind, judge(some, answer(some)), minutes)

    def _add(self, name: str, title: str, kind: str, found: Judged, minutes: float) -> None:
        shares = (found.error_median, found.error_p95, found.residual_median)
        row = [name, title, kind, *(f"{share:.2%}" for share in shares)]
        row += [f"{found.metric_passed:.1%}", f"{minutes:.1f}"]
        self.table.add_row(*row)
        self._console.print(" | ".join(row))

    def _train(self, configuration: Configuration) -> TorchNetwork:
        with tempfile.TemporaryDirectory() as folder, self._console.status("training") as status:

            def show(progress: TrainingProgress) -> None:
                status.update(f"{progress.stage} {progress.step} of {progress.steps}")

            path = train(
                configuration,
                self._motion,
                Path(folder) / "checkpoint.pt",
                resume=False,
                accelerator=None,
                on_progress=show,
            )
            return TorchNetwork(*trained_network(path))

    def _evaluation_drives(self, points: int) -> EvaluationDrives:
        if points not in self._drives:
            self._drives[points] = evaluation_drives(self._motion, points)
        return self._drives[points]


def main() -> None:
    """Train and judge the rows asked for."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("rows", nargs="*", metavar="ROW", help=", ".join(ROWS))
    given = parser.parse_args()
    ablations = Ablations(Console(width=130, stderr=True))
    for name in given.rows or ROWS:
        ablations.run(name)
    Console(width=130).print(ablations.table)


if __name__ == "__main__":
    main()
