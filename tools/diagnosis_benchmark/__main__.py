"""How often `diagnose` identifies an effect in a drive of a simulation that it does not know.

Two-axis flexible drives (`firmware_interface.plant`) run in closed loop. Every drive has a board of
its own: 8400 counts a turn at the gearbox output or at the motor, a command that is held over the
sampling period and acts 0 to 1 period after its stamp, and effort noise of 0.5 to 4 %. The
recording does not state the timing, as a CSV file does not. One axis has the effect, the other has
none. Every drive has a multisine, or a phase of the paper's motion, of its own. A hidden delay is
1.5 samples or more, counted from a record in step.

What counts, and how:

- A case counts in the headline when its effect is above the tolerance: what a sound drive would not
  have needed for the same motion, and the base model with a shift of at most 1.5 samples cannot
  express, is at least 1 % of the rms effort up to 20 Hz, where the encoder shows the direction.
- Rows of their own count what is within reach as well: an ideal test, which knows the waveform and
  the noise, tells it from noise (d of 6, `reach.py`).
- Others count what is above the tolerance in what `diagnose` compares: the plant's effect, weighted
  and filtered as the recorded effort is, at the same samples. By that measure an axis is adequate
  where nothing above the tolerance is left.
- A first cause is right when it is the hidden effect. A tie is not right: where the report calls
  another effect first and the hidden one its only inseparable alternative, a row of its own counts
  it. 'Nothing else named' and 'pairs' count it.
- A delay of 45 ms or more may be a finding, which says by how much the two columns are apart and
  forbids every cause. That is right, too.
- Several terms of one effect, as two orders of a ripple, are one cause. What is suspected or minor
  is not named: it neither helps nor harms.
- An axis is accused when it has a cause. That it has no fault is known: clean drives, and the other
  axis of drives with one.
- An unknown disturbance counts when it is above the tolerance and shows; one above the band of any
  comparison, when it makes 1 % of the rms effort. A name is confident when the report separates it
  from every alternative.

    python -m tools.diagnosis_benchmark single --drives 5
    python -m tools.diagnosis_benchmark single --scale 0.4      what showed at full size, smaller
    python -m tools.diagnosis_benchmark clean pairs unknown --motion multisine
    python -m tools.diagnosis_benchmark speed                   44 s of two axes on one core
    python -m tools.diagnosis_benchmark --case single/multisine/1/0/37/1/0
    python -m tools.diagnosis_benchmark --read FILE             the tables of a former run
    python -m tools.diagnosis_benchmark compare OLD NEW         two files of outcomes, case by case

`compare` counts the cases that both files have, ends with 1 where the new one is worse beyond
chance (three standard deviations), and names the cases lost.

Simulations are kept in runs/diagnosis_benchmark and used again. Seeds 1 to 99 are for development;
the figures in docs/diagnosis_accuracy.md are of others, which no development had seen.
"""

import os

# one thread for each process; before numpy is loaded
os.environ["OMP_NUM_THREADS"] = os.environ["OPENBLAS_NUM_THREADS"] = "1"

import argparse
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Final

from rich.console import Console

from firmware_interface.plant import EFFECTS
from tools.diagnosis_benchmark.cases import DRAWN, KINDS, MOTIONS, Case, plan
from tools.diagnosis_benchmark.hiding import FOLDER
from tools.diagnosis_benchmark.looking import print_case
from tools.diagnosis_benchmark.outcome import Outcome
from tools.diagnosis_benchmark.running import Workers, select
from tools.diagnosis_benchmark.speed import print_speed
from tools.diagnosis_benchmark.tables import print_tables
from tools.diagnosis_benchmark.two_versions import compare_outcomes

DEVELOPMENT_SEED: Final = 1
REPORTING_SEED: Final = 37013
SPEED: Final = "speed"
COMPARE: Final = "compare"


def main() -> int:
    """Run what is asked for and print its tables; 1 for a loss, 130 if it was interrupted."""
    given = _arguments()
    console = Console(width=180, highlight=False)
    if given.case:
        print_case(Case.parse(given.case), console)
        return 0
    if given.read:
        print_tables(_read(given.read), console)
        return 0
    if given.what[0] == COMPARE:
        old, new = (_read(Path(name)) for name in given.what[1:])
        return compare_outcomes(old, new, console)
    code = 0
    if kinds := [kind for kind in KINDS if kind in given.what]:
        code = _benchmark(given, kinds, console)
    if SPEED in given.what and not code:
        print_speed(console)
    return code


def _read(path: Path) -> list[Outcome]:
    return [Outcome.read(line) for line in path.read_text("utf-8").splitlines()]


def _benchmark(given: argparse.Namespace, kinds: list[str], console: Console) -> int:
    """Diagnose the cases; every outcome is in the file as soon as it is known."""
    cases = [
        case
        for kind in kinds
        for motion in given.motion
        for case in plan(kind, motion, given.drives, given.effects, given.seed, given.noise)
    ]
    outcomes, code = [], 0
    given.output.parent.mkdir(parents=True, exist_ok=True)
    with given.output.open("w", encoding="utf-8") as file, Workers(given.jobs) as workers:
        try:
            for outcome in workers.diagnose(select(cases, given.scale, workers)):
                outcomes.append(outcome)
                print(outcome.line(), file=file, flush=True)
        except KeyboardInterrupt:
            code = 130
    print_tables(outcomes, console)
    console.print(f"every case: {given.output}")
    return code


def _arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument(
        "what", nargs="*", help=f"{', '.join((*KINDS, SPEED))}, or {COMPARE} and two files"
    )
    parser.add_argument(
        "--drives", type=int, default=5, help="for each effect; ten times as many of other kinds"
    )
    parser.add_argument("--motion", type=_names(MOTIONS), default=MOTIONS, metavar="A,B")
    parser.add_argument("--effects", type=_names(EFFECTS), default=EFFECTS, metavar="A,B")
    parser.add_argument("--scale", type=float, default=1.0, help="of the effects' sizes")
    parser.add_argument(
        "--noise", type=float, default=DRAWN, help="share of the rms effort; 0: drawn, 0.5 to 4 %%"
    )
    parser.add_argument(
        "--seed",
        type=int,
        default=DEVELOPMENT_SEED,
        help=f"{DEVELOPMENT_SEED} for development (default), {REPORTING_SEED} for the docs",
    )
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--output", type=Path, default=FOLDER / "outcomes.jsonl")
    parser.add_argument("--case", help="diagnose this one and print all about it")
    parser.add_argument("--read", type=Path, metavar="FILE", help="print its tables again")
    given = parser.parse_args()
    if given.what[:1] == [COMPARE]:
        if len(given.what) != 3:
            parser.error("compare needs two files of outcomes, the old one first")
    elif unknown := set(given.what) - {*KINDS, SPEED}:
        parser.error(f"what is {min(unknown)}? Known: {', '.join((*KINDS, SPEED, COMPARE))}")
    if not (given.what or given.case or given.read):
        parser.error("say what to run")
    return given


def _names(known: tuple[str, ...]) -> Callable[[str], tuple[str, ...]]:
    """Parser of a list with commas."""

    def parse(text: str) -> tuple[str, ...]:
        names = tuple(text.split(","))
        if unknown := set(names) - set(known):
            raise argparse.ArgumentTypeError(f"{min(unknown)}; known: {', '.join(known)}")
        return names

    return parse


if __name__ == "__main__":
    sys.exit(main())
