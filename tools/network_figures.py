r"""Accuracy of the network on drives of an independent simulation, which training never used.

Flexible drives (`firmware_interface.plant`) in closed loop, encoder of 8400 counts, through the
signal chain of `identify`: the network alone, least squares, and random search with as many tries
as the loop may have passes.

    python tools/network_figures.py clean                    1,000 axes, 2 % effort noise
    python tools/network_figures.py effects                  one hidden effect each, by effect

A quarter of a period, as short as a record can be that turns, needs a network of its own:

    python tools/network_figures.py motion runs/quarter.csv --quarter
    edge-ident train --motion-from runs/quarter.csv --output runs/quarter
    edge-ident export runs/quarter/checkpoint.pt --output runs/quarter --no-int8
    python tools/network_figures.py effects --quarter --noise 0.05 \
        --network runs/quarter/quarter_fp32.onnx
"""

import argparse
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray
from rich.console import Console
from rich.progress import track
from rich.table import Table

from edge_ident.errors import DataError
from edge_ident.estimation import image, least_squares, network_estimate
from edge_ident.estimation.network import Network, load_network
from edge_ident.model.model import PARAMETERS
from edge_ident.signals import conditioning, recording, recording_files
from edge_ident.signals.metrics import Metric, compare
from firmware_interface.plant import EFFECTS, Motion, Noise, draw, draw_drives, paper, simulate

Array = NDArray[np.float64]

SEED: Final = 700_000
"""Far from those of training, of its evaluation, and of the tests."""
BATCH: Final = 50
"""Drives simulated at once."""
PASSES: Final = 10
NO_EFFECT: Final = "none"
QUARTER_SAMPLES: Final = 2186
QUARTER_PHASE_RAD: Final = np.pi / 4.0
"""Of the sine of x at the start: a quarter of a period around its reversal. The other axis, a
cosine, does not turn in that time, so its friction and offset are one."""


@dataclass(frozen=True)
class Case:
    """One axis of one drive, as three methods identify it.

    Attributes
    ----------
    subsampled : Subsampled
    scale : (4,) array
        What a parameter is multiplied by to give its share of the effort.
    truth : (4,) array
    found : mapping of method to (4,) array
    metric : mapping of method to Metric
    passes : int
    """

    truth: Array
    scale: Array
    found: dict[str, Array]
    metric: dict[str, Metric]
    passes: int

    def error(self, method: str) -> Array:
        """Absolute errors (4,) in shares of the effort's scale: the range of a parameter is one."""
        return np.asarray(np.abs(self.found[method] - self.truth) * self.scale)

    @property
    def left(self) -> float:
        """Relative residual of least squares."""
        return self.metric["least squares"].relative_residual

    def relative_error(self, method: str) -> Array:
        """Absolute errors (4,) over the true parameters."""
        return np.asarray(np.abs(self.found[method] - self.truth) / np.abs(self.truth))


@dataclass(frozen=True)
class Setting:
    """Network, motion, noise and how many axes of each drive are looked at."""

    network: Network
    motion: Motion
    noise: float
    axes: int

    def cases(self, effect: str | None, axes: int, seed: int) -> Iterator[Case]:
        """Simulate and identify axes of random drives, all with the effect."""
        wanted = axes // self.axes
        for first in range(0, wanted, BATCH):
            count = min(BATCH, wanted - first)
            drives = draw_drives(count, seed=seed + first)
            effects = draw([effect] if effect else [], drives, self.motion, seed=seed + first + 1)
            made = simulate(
                drives, self.motion, effects=effects, noise=Noise(self.noise), seed=seed + first + 2
            )
            hit = effects[0].hit if effects else np.ones((count, 2), dtype=bool)
            for drive, axis in np.argwhere(hit[:, : self.axes]):
                case = self.case(
                    made.time_s,
                    made.position[drive, axis],
                    made.effort[drive, axis],
                    made.base[drive, axis],
                    float(made.effort_shift_s[drive]),
                )
                if case is not None:
                    yield case

    def case(
        self, time_s: Array, position: Array, effort: Array, truth: Array, shift_s: float
    ) -> Case | None:
        """Identify one axis; None if it moves too little to be identified."""
        signals = conditioning.condition(time_s, position, effort, effort_shift_s=shift_s)
        motion = self.network.manifest.motion
        seen = image.align(signals, motion.regressor[:, 1], motion.period_s)
        if seen is None:
            raise SystemExit("the network belongs to a longer motion: name another one")
        try:
            part = least_squares.estimation_part(signals)
            solved = least_squares.fit(signals, part).parameters
        except DataError:
            return None
        looped = network_estimate.estimate(seen.regressor, seen.effort, self.network, passes=PASSES)
        scale = float(image.effort_scale(seen.effort, "effort-scale"))
        unit = scale / motion.column_scales
        found = {
            "network": looped.parameters,
            "least squares": solved,
            "random search": _guessed(seen, unit),
        }
        metric = {name: compare(seen.effort, seen.regressor @ p) for name, p in found.items()}
        return Case(truth, 1.0 / unit, found, metric, looped.passes)


def _guessed(seen: image.Subsampled, unit: Array) -> Array:
    """The best of as many random guesses as the loop may have passes."""
    rng = np.random.default_rng(SEED)
    tries = rng.uniform([0.0, 0.0, 0.0, -1.0], 1.0, (PASSES, 4)) * unit
    scores = [compare(seen.effort, seen.regressor @ guess).relative_residual for guess in tries]
    return np.asarray(tries[int(np.argmin(scores))])


def clean_table(cases: list[Case]) -> Table:
    """Metrics and errors of drives that the model describes."""
    table = Table(title=f"{len(cases)} unseen axes that the model describes")
    for column in ("", "network", "least squares", "random search"):
        table.add_column(column, justify="left" if not column else "right")
    methods = list(cases[0].found)

    def row(title: str, values: list[str]) -> None:
        table.add_row(title, *values)

    spectral = {m: np.array([case.metric[m].time_spectral for case in cases]) for m in methods}
    row("time-spectral metric ≥ 0.98", [f"{np.mean(spectral[m] >= 0.98):.1%}" for m in methods])
    row("time-spectral metric, median", [f"{np.median(spectral[m]):.5f}" for m in methods])
    for title, name in (("fit, median", "fit"), ("relative residual, median", "relative_residual")):
        values = {m: [getattr(case.metric[m], name) for case in cases] for m in methods}
        row(title, [f"{np.median(values[m]):.2%}" for m in methods])
    for index, parameter in enumerate(PARAMETERS):
        errors = {m: np.array([case.error(m)[index] for case in cases]) for m in methods}
        row(f"{parameter}: error of range, median / 95 %", [_pair(errors[m]) for m in methods])
    errors = {m: np.ravel([case.error(m) for case in cases]) for m in methods}
    row("all parameters: median / 95 %", [_pair(errors[m]) for m in methods])
    row("passes, most", [str(max(case.passes for case in cases)), "", str(PASSES)])
    return table


def effects_table(cases: dict[str, list[Case]]) -> Table:
    """Median errors of inertia, viscous and Coulomb friction, effect by effect.

    An effect shows in a recording if it doubles the variance that least squares leaves of a drive
    without one.
    """
    table = Table(title="median error, % of range: inertia / viscous / Coulomb")
    for column in ("hidden effect", "axes", "network", "least squares", "ratio", "ratio, relative"):
        table.add_column(column, justify="left" if column == "hidden effect" else "right")
    for name, some in cases.items():
        table.add_row(*effects_row(name, some))
    table.add_section()
    hidden = [case for name, some in cases.items() if name != NO_EFFECT for case in some]
    floor = np.median([case.left for case in cases[NO_EFFECT]])
    table.add_row(*effects_row("all effects", hidden))
    shown = [case for case in hidden if case.left**2 > 2.0 * floor**2]
    table.add_row(*effects_row("all that show", shown))
    return table


def effects_row(name: str, cases: list[Case]) -> list[str]:
    """Medians over axes, and over axes and parameters their ratio."""
    methods = ("network", "least squares")
    errors = {m: np.array([case.error(m)[:3] for case in cases]) for m in methods}
    relative = {m: np.median([case.relative_error(m)[:3] for case in cases]) for m in methods}
    medians = {m: 100.0 * np.median(errors[m], axis=0) for m in methods}
    return [
        name,
        str(len(cases)),
        *(" / ".join(f"{value:.2f}" for value in medians[m]) for m in methods),
        f"{np.median(errors['network']) / np.median(errors['least squares']):.2f}",
        f"{relative['network'] / relative['least squares']:.2f}",
    ]


def _pair(errors: Array) -> str:
    return f"{np.median(errors):.2%} / {np.quantile(errors, 0.95):.2%}"


def save_motion(motion: Motion, path: Path) -> None:
    """Record the x axis of one drive, for `edge-ident train --motion-from`."""
    made = simulate(draw_drives(1, seed=SEED), motion, noise=None)
    axis = recording.AxisRecord(made.position[0, 0], made.effort[0, 0], "rad", "N*m")
    path.parent.mkdir(parents=True, exist_ok=True)
    recording_files.save_recording(recording.Recording(made.time_s, {"x": axis}, str(path)), path)


def main() -> None:
    """Print one table, or write a motion."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("what", choices=["clean", "effects", "motion"])
    parser.add_argument("file", nargs="?", type=Path, help="recording that `motion` writes")
    parser.add_argument("--network", type=Path, help="default: the package's")
    parser.add_argument("--quarter", action="store_true", help="a quarter of a period")
    parser.add_argument("--noise", type=float, default=0.02, help="share of the rms effort")
    parser.add_argument(
        "--axes", type=int, default=1000, help="in all, or a tenth with each effect"
    )
    parser.add_argument("--seed", type=int, default=SEED)
    given = parser.parse_args()
    motion = paper(QUARTER_SAMPLES, phase_rad=QUARTER_PHASE_RAD) if given.quarter else paper()
    if given.what == "motion":
        if given.file is None:
            parser.error("name the recording to write")
        save_motion(motion, given.file)
        return
    network = load_network(path=given.network)
    setting = Setting(network, motion, given.noise, axes=1 if given.quarter else 2)
    console = Console(width=120)
    if given.what == "clean":
        cases = track(setting.cases(None, given.axes, given.seed), "axes", given.axes)
        console.print(clean_table(list(cases)))
        return
    by_effect = {
        name: list(
            setting.cases(
                None if name == NO_EFFECT else name, given.axes // 10, given.seed + 10_000 * number
            )
        )
        for number, name in enumerate(track([NO_EFFECT, *EFFECTS], "effects"))
    }
    console.print(effects_table(by_effect))


if __name__ == "__main__":
    main()
