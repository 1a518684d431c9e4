r"""Network, least squares and extended model, effect by effect, on records of several lengths.

Flexible drives (`firmware_interface.plant`), which share no formula with training and diagnosis,
follow the paper's sinusoid for a quarter of a period around a reversal, one period, and two. Each
hides one effect in one axis, behind an encoder of 8400 counts a turn. The network reads one period:
it has no answer on a quarter, and on two periods it takes the last. The extended model is that of
`diagnose`, stability selection included: the base model, where nothing is named.

    python tools/record_lengths.py --axes 6
    python tools/record_lengths.py --read runs/record_lengths.jsonl

Errors are those of inertia, viscous and Coulomb friction, in shares of a parameter's range, as in
`tools/network_figures.py`. A ratio below one is won against least squares, on the axes that a
method answers for.
"""

import argparse
import json
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray
from rich.console import Console
from rich.progress import track
from rich.table import Table

import edge_ident
from edge_ident.diagnosis.diagnose import diagnose
from edge_ident.errors import DataError, EdgeIdentError
from edge_ident.estimation import least_squares, network_estimate
from edge_ident.estimation.alignment import align
from edge_ident.estimation.image import effort_scale
from edge_ident.estimation.network import Network
from edge_ident.signals.conditioning import Signals, condition
from edge_ident.signals.recording import Recording
from firmware_interface.plant import (
    EFFECTS,
    PAPER_SAMPLES,
    Noise,
    draw,
    draw_drives,
    paper,
    simulate,
)
from tools.diagnosis_benchmark.bias import mean_parameters
from tools.diagnosis_benchmark.hiding import AXES, recording_of
from tools.network_figures import NO_EFFECT, QUARTER_PHASE_RAD, QUARTER_SAMPLES

Array = NDArray[np.float64]

SEED: Final = 710_000
"""Far from those of training, of its evaluation, and of `tools/network_figures.py`."""
LENGTHS: Final = {
    "quarter": QUARTER_SAMPLES,
    "one period": PAPER_SAMPLES,
    "two periods": 2 * PAPER_SAMPLES,
}
METHODS: Final = ("network", "least squares", "extended model")


@dataclass(frozen=True)
class Case:
    """One axis with an effect.

    Attributes
    ----------
    length, effect : str
    error : mapping of method to list of float
        Errors of inertia, viscous and Coulomb friction; a method without an answer is left out.
    """

    length: str
    effect: str
    error: dict[str, list[float]]


def cases(length: str, effect: str, count: int, network: Network, seed: int) -> Iterator[Case]:
    """Identify one axis of each of some random drives, all with the effect."""
    phase_rad = QUARTER_PHASE_RAD if length == "quarter" else 0.0
    motion = paper(LENGTHS[length], phase_rad=phase_rad)
    drives = draw_drives(count, seed=seed)
    hidden = [] if effect == NO_EFFECT else [effect]
    effects = draw(hidden, drives, motion, seed=seed + 1, one_axis=True)
    made = simulate(drives, motion, effects=effects, noise=Noise(0.02), seed=seed + 2)
    for drive in range(count):
        hit = int(np.argmax(effects[0].hit[drive])) if effects else 0
        if length == "quarter" and hit != 0:
            continue  # the other axis does not turn, so its friction and offset are one
        error = _errors(recording_of(made, drive), AXES[hit], made.base[drive, hit], network)
        yield Case(length, effect, error)


def _errors(
    recording: Recording, axis: str, truth: Array, network: Network
) -> dict[str, list[float]]:
    """Of each method that has an answer."""
    record = recording.axes[axis]
    signals = condition(
        recording.time_s, record.position, record.effort, effort_shift_s=recording.effort_shift_s
    )
    answers = {
        "network": _network(signals, network),
        "least squares": _least_squares(signals),
        "extended model": _extended(recording, axis),
    }
    peaks = np.max(np.abs(signals.regressor), axis=0)
    unit = float(effort_scale(signals.effort, "effort-scale")) / peaks
    return {
        name: (np.abs(answer - truth) / unit)[:3].tolist()
        for name, answer in answers.items()
        if answer is not None
    }


def _network(signals: Signals, network: Network) -> Array | None:
    motion = network.manifest.motion
    seen = align(signals, motion.regressor[:, 1], motion.period_s)
    if seen is None:
        return None
    return network_estimate.estimate(seen.regressor, seen.effort, network).parameters


def _least_squares(signals: Signals) -> Array | None:
    try:
        return least_squares.fit(signals, least_squares.estimation_part(signals)).parameters
    except DataError:
        return None


def _extended(recording: Recording, axis: str) -> Array | None:
    try:
        model = diagnose([recording]).axes[axis].model
    except EdgeIdentError:
        return None
    return mean_parameters(model, float(recording.time_s[-1]))


def tables(found: list[Case]) -> Iterator[Table]:
    """For each length, median errors by effect."""
    for length in LENGTHS:
        here = [case for case in found if case.length == length]
        table = Table(title=f"{length}: median error, % of range; over least squares in brackets")
        for column in ("hidden effect", "axes", *METHODS):
            table.add_column(column, justify="left" if column == "hidden effect" else "right")
        names = [NO_EFFECT, *EFFECTS]
        for name in names:
            some = [case for case in here if case.effect == name]
            if some:
                table.add_row(name, str(len(some)), *_medians(some))
        table.add_section()
        hidden = [case for case in here if case.effect != NO_EFFECT]
        if hidden:
            table.add_row("all effects", str(len(hidden)), *_medians(hidden))
        yield table


def _medians(some: list[Case]) -> Iterator[str]:
    """Over axes and parameters, and over least squares on the axes where both answer."""
    for method in METHODS:
        answered = [case for case in some if {method, METHODS[1]} <= set(case.error)]
        if not answered:
            yield "–"
            continue
        error, opponent = (
            np.median([case.error[name] for case in answered]) for name in (method, METHODS[1])
        )
        of = "" if len(answered) == len(some) else f", {len(answered)} axes"
        yield f"{100 * error:.2f} ({error / opponent:.2f}{of})"


def main() -> None:
    """Identify and print, or print what a former run found."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--axes", type=int, default=6, help="with each effect, of each length")
    parser.add_argument("--only", nargs="+", choices=LENGTHS, default=list(LENGTHS))
    parser.add_argument("--seed", type=int, default=SEED)
    parser.add_argument("--output", type=Path, default=Path("runs/record_lengths.jsonl"))
    parser.add_argument("--read", type=Path, nargs="+", metavar="FILE", help="print its tables")
    given = parser.parse_args()
    if given.read:
        lines = [line for path in given.read for line in path.read_text("utf-8").splitlines()]
        found = [Case(**json.loads(line)) for line in lines]
    else:
        found = run(given.axes, given.only, given.seed, given.output)
    for table in tables(found):
        if table.row_count:
            Console(width=120).print(table)


def run(axes: int, lengths: list[str], seed: int, output: Path) -> list[Case]:
    """All cases; each is written as soon as it is known."""
    network, found = edge_ident.load_network(), []
    rows = [
        (length, effect, number)
        for length in lengths
        for number, effect in enumerate([NO_EFFECT, *EFFECTS])
    ]
    output.parent.mkdir(parents=True, exist_ok=True)
    with output.open("w", encoding="utf-8") as file:
        for length, effect, number in track(rows, "effects"):
            for case in cases(length, effect, axes, network, seed + 10_000 * number):
                file.write(json.dumps(asdict(case)) + "\n")
                file.flush()
                found.append(case)
    return found


if __name__ == "__main__":
    main()
