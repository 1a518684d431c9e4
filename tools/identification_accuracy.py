"""How far `identify` is off on drives of a simulation that it does not know, and what it says.

The cases are those of `tools.diagnosis_benchmark`: flexible drives of two axes in closed loop
(`firmware_interface.plant`), one axis with one hidden effect, the other sound, or both sound. An
answer is wrong where a parameter is off by more than 5 % and by more than 3 of its standard
deviations. Of axes with an effect, parameters are left out that the motion cannot show: even an
estimator that knows the effect, and lacks only its size, would miss them by more than 5 % in three
standard deviations.

    python -m tools.identification_accuracy --drives 2
    python -m tools.identification_accuracy --motion paper --no-diagnose
    python -m tools.identification_accuracy --read FILE

Simulations are kept where the benchmark of the diagnosis keeps its own.
"""

import os

# one thread for each process; before numpy is loaded
os.environ["OMP_NUM_THREADS"] = os.environ["OPENBLAS_NUM_THREADS"] = "1"

import argparse
import json
import sys
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass
from functools import partial
from multiprocessing import get_context
from pathlib import Path
from typing import Any, Final, Self

import numpy as np
from numpy.typing import NDArray
from rich.console import Console
from rich.table import Table

from edge_ident.errors import EdgeIdentError
from edge_ident.estimation.network import load_network
from edge_ident.identification.identify import identify
from edge_ident.identification.result import AxisIdentification
from firmware_interface.plant import EFFECTS
from tools.diagnosis_benchmark.bias import mean_parameters
from tools.diagnosis_benchmark.cases import CLEAN, MOTIONS, SINGLE, Case, plan
from tools.diagnosis_benchmark.hiding import AXES, FOLDER, load_batch, simulate_batch

Array = NDArray[np.float64]

WRONG: Final = 0.05
"""Relative error from which a parameter may be called wrong."""
DEVIATIONS: Final = 3.0
"""Its standard deviations from which it is."""
JUDGED: Final = 3
"""Inertia, viscous and Coulomb friction; an offset has no natural scale."""


@dataclass(frozen=True)
class Answer:
    """What `identify` says of one axis, held against the truth.

    Attributes
    ----------
    case, axis, hidden : str
        `hidden` is empty for a sound axis.
    source, verdict : str
        Which estimate is the answer; the verdict of the diagnosis, empty without one.
    trusted : bool
    error, deviations, shown : tuples of 3
        Relative error of inertia, viscous and Coulomb friction, the error in standard deviations,
        and whether the motion can show the parameter.
    causes : tuple of str
    failure : str
        Of an identification that ended with an error; all else is empty then.
    """

    case: str
    axis: str
    hidden: str
    source: str = ""
    verdict: str = ""
    trusted: bool = False
    error: tuple[float, ...] = ()
    deviations: tuple[float, ...] = ()
    shown: tuple[bool, ...] = ()
    causes: tuple[str, ...] = ()
    findings: tuple[str, ...] = ()
    failure: str = ""

    @property
    def worst(self) -> float:
        """Largest relative error among the parameters that the motion can show."""
        return max((e for e, s in zip(self.error, self.shown, strict=True) if s), default=0.0)

    @property
    def wrong(self) -> bool:
        """Whether a parameter that the motion can show lies outside what is said of it."""
        judged = zip(self.error, self.deviations, self.shown, strict=True)
        return any(s and e > WRONG and d > DEVIATIONS for e, d, s in judged)

    @classmethod
    def read(cls, line: str) -> Self:
        """From one line of JSON."""
        values: dict[str, Any] = json.loads(line)
        for key, value in values.items():
            values[key] = tuple(value) if isinstance(value, list) else value
        return cls(**values)


def answers(case: Case, *, diagnose: bool = True) -> list[Answer]:
    """Identify one case; both axes where nothing is hidden, else the axis that has the effect."""
    hidden = load_batch(case.batch)
    hit = int(hidden.axis[case.row])
    name = case.hidden[0] if case.hidden else ""
    rows = [hit] if name else range(len(AXES))
    network = load_network() if case.batch.motion == "paper" else None
    try:
        found = identify(hidden.recording(case.row), network, diagnose=diagnose)
    except EdgeIdentError as error:
        return [Answer(str(case), AXES[row], name, failure=str(error)) for row in rows]
    detectability = float(hidden.detectability[case.row][0]) if name else np.inf
    return [
        judge(
            str(case),
            AXES[row],
            name,
            found.axes[AXES[row]],
            hidden.truth[case.row, row],
            detectability,
            float(hidden.time_s[-1]),
        )
        for row in rows
    ]


def judge(
    case: str,
    name: str,
    hidden: str,
    axis: AxisIdentification,
    truth: Array,
    detectability: float,
    duration_s: float,
) -> Answer:
    """Hold one axis against the truth (4,).

    Parameters
    ----------
    detectability : float
        Of the effect beside the base model (`diagnosis_benchmark.reach`); infinite without one.
    """
    off = np.abs(mean_parameters(axis.model, duration_s) - truth)[:JUDGED]
    return Answer(
        case=case,
        axis=name,
        hidden=hidden,
        source=axis.source.value,
        verdict="" if axis.diagnosis is None else axis.diagnosis.verdict.value,
        trusted=axis.trusted,
        error=tuple((off / np.abs(truth[:JUDGED])).tolist()),
        deviations=tuple((off / axis.estimate.std[:JUDGED]).tolist()),
        shown=tuple(can_show(axis.least_squares.parameters, truth, detectability).tolist()),
        causes=axis.compensated_effects,
        findings=tuple(finding.code for finding in axis.findings if finding.blocks),
    )


def can_show(base: Array, truth: Array, detectability: float) -> NDArray[np.bool_]:
    """Which of the judged parameters (3,) a motion can show in spite of the effect.

    The effect moves the base model's parameters by its part along their columns. What is left of it
    beside them is the detectability, in deviations of the noise: its inverse is the relative
    deviation of the effect's size, and so of that move.
    """
    known = np.abs(base - truth)[:JUDGED] / detectability
    return np.asarray(DEVIATIONS * known <= WRONG * np.abs(truth[:JUDGED]))


def print_tables(found: Sequence[Answer], console: Console) -> None:
    """One row for each motion, sound axes and those with an effect apart."""
    table = Table(title="identification")
    for heading in (
        "motion", "axes", "count", "failed", "trusted", "trusted and wrong", "worst error: median",
        "90 %", "explained", "of these trusted", "median error of base, viscous, Coulomb",
    ):  # fmt: skip
        table.add_column(heading, justify="right")
    for motion in (*MOTIONS, "all"):
        for sound in (True, False):
            group = [a for a in found if motion in (a.case.split("/")[1], "all")]
            group = [a for a in group if (a.hidden == "") == sound]
            if group:
                table.add_row(motion, "sound" if sound else "one effect", *_row(group))
    console.print(table)
    for a in found:
        if a.trusted and a.wrong:
            console.print("trusted and wrong:", asdict(a))


def _row(group: Sequence[Answer]) -> Iterator[str]:
    trusted = [a for a in group if a.trusted]
    explained = [a for a in group if a.verdict == "explained"]
    worst = [a.worst for a in trusted] or [np.nan]
    yield str(len(group))
    yield str(sum(bool(a.failure) for a in group))
    yield f"{len(trusted)}"
    yield f"{sum(a.wrong for a in trusted)}"
    yield f"{np.median(worst):.2%}"
    yield f"{np.quantile(worst, 0.9):.2%}"
    yield str(len(explained))
    yield str(sum(a.trusted for a in explained))
    errors = np.array([a.error for a in group if a.error])
    yield ", ".join(f"{value:.2%}" for value in np.median(errors, axis=0)) if len(errors) else ""


def planned(motions: Sequence[str], drives: int, seed: int, noise: float) -> list[Case]:
    """Single effects, so many drives for each, and half as many sound drives as effects."""
    cases = []
    for motion in motions:
        cases += plan(SINGLE, motion, drives, EFFECTS, seed, noise)
        cases += plan(CLEAN, motion, 1, EFFECTS, seed, noise)[: drives * len(EFFECTS) // 2]
    return cases


def main() -> int:
    """Identify the cases and print the tables."""
    given = _arguments()
    console = Console(width=200, highlight=False)
    if given.read:
        print_tables([Answer.read(x) for x in given.read.read_text("utf-8").splitlines()], console)
        return 0
    cases = planned(given.motion, given.drives, given.seed, given.noise)
    for batch in dict.fromkeys(case.batch for case in cases):
        simulate_batch(batch)
    given.output.parent.mkdir(parents=True, exist_ok=True)
    found = []
    with given.output.open("w", encoding="utf-8") as file:
        for of_case in _identified(cases, given.jobs, diagnose=not given.no_diagnose):
            for one in of_case:
                print(json.dumps(asdict(one)), file=file, flush=True)
            found += of_case
    print_tables(found, console)
    console.print(f"every axis: {given.output}")
    return 0


def _identified(cases: Sequence[Case], jobs: int, *, diagnose: bool) -> Iterator[list[Answer]]:
    """Answers in the order of the cases."""
    work = partial(answers, diagnose=diagnose)
    if jobs == 1:
        yield from map(work, cases)
        return
    with get_context("fork").Pool(jobs) as pool:
        yield from pool.imap(work, cases)


def _arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--drives", type=int, default=2, help="for each effect")
    parser.add_argument(
        "--motion", type=lambda text: text.split(","), default=list(MOTIONS), metavar="A,B"
    )
    parser.add_argument("--noise", type=float, default=0.02, help="share of the rms effort")
    parser.add_argument("--seed", type=int, default=1, help="1 to 99 for development")
    parser.add_argument("--no-diagnose", action="store_true", help="the base model alone")
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--output", type=Path, default=FOLDER / "identification.jsonl")
    parser.add_argument("--read", type=Path, metavar="FILE", help="print its tables again")
    return parser.parse_args()


if __name__ == "__main__":
    sys.exit(main())
