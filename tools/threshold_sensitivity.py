"""What becomes of the diagnosis when a threshold of the selection is lower or higher.

Each threshold of `select.thresholds` that decides something is lowered to 0.7 and raised to 1.4
times its value, the others unchanged, and the same recordings are diagnosed again. A share near one
has its distance from one doubled and halved instead. A rule that can be switched off is tried
without as well. The recordings are of the benchmark: single effects that show, clean drives, pairs,
and disturbances that no effect explains. docs/diagnosis_record.md has the result.

    python -m tools.threshold_sensitivity --jobs 2
    python -m tools.threshold_sensitivity --read FILE        the table of a former run

What depends on no threshold is computed once for each recording.
"""

import os

# one thread for each process; before numpy is loaded
os.environ["OMP_NUM_THREADS"] = os.environ["OPENBLAS_NUM_THREADS"] = "1"

import argparse
import json
import sys
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Final

import numpy as np

from edge_ident.diagnosis import diagnose as engine
from edge_ident.diagnosis.result import Diagnosis
from edge_ident.diagnosis.select.thresholds import thresholds
from edge_ident.diagnosis.verdict import Verdict
from firmware_interface.plant import EFFECTS
from tools.diagnosis_benchmark.cases import CLEAN, PAIRS, SINGLE, UNKNOWN_KIND, Batch, Case
from tools.diagnosis_benchmark.exchanging import changed_threshold, remembering
from tools.diagnosis_benchmark.hiding import FOLDER, load_batch
from tools.diagnosis_benchmark.outcome import Outcome, judge
from tools.diagnosis_benchmark.running import Workers, counts

SEED: Final = 4004
MOTIONS: Final = ("multisine", "paper")
FACTORS: Final = (0.7, 1.4)
SPECIAL: Final = {"KEPT_TERM": (-10.0, 10.0), "BOOTSTRAP_SEED": (2, 3)}
"""What has no meaningful multiple."""
OFF: Final = {
    "SUPPORTED": -np.inf,
    "NONZERO": 0.0,
    "RELIABILITY": -np.inf,
    "LARGEST": np.inf,
    "FEWEST_INDEPENDENT": 0.0,
    "ONE_OFF_ENERGY": np.inf,
    "BEAM_WIDTH": 1,
    "FOLLOWED": np.inf,
    "MOST_REFINED": 1,
    "PROMISING": 0.0,
    "STARTS": 1,
    "SLIGHTEST": -np.inf,
    "MOST_ALTERNATIVES": 1,
}
"""Values that switch a rule or a part of the search off; they are tried as well."""
UNDECIDING: Final = ("INDISTINGUISHABLE",)
PRESENT: Final = "present values"


@dataclass(frozen=True)
class Answer:
    """What a diagnosis says of one recording.

    Attributes
    ----------
    right : bool
        The first cause is a hidden effect; a clean drive has no cause; a disturbance that no
        effect explains is unexplained.
    wrong : int
        Causes of both axes that are no hidden effect.
    verdicts, causes, lists : str
        Of both axes: the verdicts, the effects named, and the rest: inseparable alternatives and
        effects that are not testable.
    """

    right: bool
    wrong: int
    verdicts: str
    causes: str
    lists: str


def answer(outcome: Outcome, diagnosis: Diagnosis) -> Answer:
    """Reduce a diagnosis to what is compared."""
    found = [cause.effect for cause in outcome.causes]
    sound = [cause.effect for cause in outcome.sound_causes]
    untested = [[n.effect for n in axis.not_testable] for axis in diagnosis.axes.values()]
    if outcome.kind == UNKNOWN_KIND:
        right = outcome.verdict == Verdict.UNEXPLAINED
    else:
        right = outcome.right if outcome.hidden else not found
    return Answer(
        right=right,
        wrong=len(sound) + sum(effect not in outcome.hidden for effect in found),
        verdicts=f"{outcome.verdict} {outcome.sound_verdict}",
        causes=f"{sorted(found)} {sorted(sound)}",
        lists=f"{sorted(map(str, (*outcome.causes, *outcome.sound_causes)))} {untested}",
    )


def variants() -> dict[str, tuple[str, float]]:
    """Label of each change, with the threshold and its new value."""
    found = {}
    for name, threshold in thresholds().items():
        if name not in UNDECIDING:
            off = [OFF[name]] if name in OFF else []
            for value in (*off, *(SPECIAL.get(name) or _around(threshold.value))):
                found[f"{name} {value:g}"] = (name, value)
    return found


def _around(value: float) -> tuple[float, ...]:
    if isinstance(value, int):
        return tuple(round(factor * value) for factor in FACTORS)
    if FACTORS[0] < value < 1.0:
        return tuple(1.0 - factor * (1.0 - value) for factor in (2.0, 0.5))
    return tuple(factor * value for factor in FACTORS)


def plan(workers: Workers) -> list[Case]:
    """The recordings: each effect in turn on either motion, pairs, unknown ones, clean drives.

    On the other motion, the effect is the faintest that shows, because there a threshold matters.
    """
    kinds = {kind: [Batch(kind, m, SEED, 0) for m in MOTIONS] for kind in (SINGLE, CLEAN)}
    kinds |= {kind: [Batch(kind, MOTIONS[0], SEED, 0)] for kind in (PAIRS, UNKNOWN_KIND)}
    workers.simulate([batch for batches in kinds.values() for batch in batches])
    every = {
        batch: [case for row in range(len(batch.hidden)) if _worth(case := Case(batch, row))]
        for batches in kinds.values()
        for batch in batches
    }
    cases = []
    for place, effect in enumerate(EFFECTS):
        first, other = (
            [case for case in every[kinds[SINGLE][number % 2]] if case.hidden == (effect,)]
            for number in (place, place + 1)
        )
        cases += [*first[:1], *sorted(other, key=_ratio)[:1]]
    for kind, some in ((PAIRS, 4), (UNKNOWN_KIND, 2), (CLEAN, 2)):
        for batch in kinds[kind]:
            cases += every[batch][:some]
    return cases


def _worth(case: Case) -> bool:
    """Whether all that is hidden is above the tolerance."""
    return not case.hidden or counts(case)


def _ratio(case: Case) -> float:
    return float(load_batch(case.batch).shows[case.row].min())


def compare(case: Case) -> tuple[Case, dict[str, Answer]]:
    """Diagnose one case with the present thresholds and with each change."""
    with remembering():
        answers = {PRESENT: _diagnosed(case)}
        for label, (name, value) in variants().items():
            with changed_threshold(name, value):
                answers[label] = _diagnosed(case)
    return case, answers


def _diagnosed(case: Case) -> Answer:
    diagnosis = engine.diagnose([load_batch(case.batch).recording(case.row)])
    return answer(judge(case, diagnosis, 0.0), diagnosis)


def table(answers: Sequence[Mapping[str, Answer]]) -> str:
    """Table in Markdown: a row for each threshold, in each cell a number for each value tried."""
    columns = ("first cause right", "wrong causes", "verdicts", "causes", "lists")
    rows: list[tuple[str, ...]] = [("threshold", "value", "tried", *columns), ("---",) * 8]
    rows.append(("none changed", "", "", *map(str, _counts(answers, PRESENT))))
    labels: dict[str, list[str]] = {}
    for label, (name, _) in variants().items():
        labels.setdefault(name, []).append(label)
    for name, some in labels.items():
        counts = zip(*(_counts(answers, label) for label in some), strict=True)
        rows.append((
            f"`{name}`",
            f"{thresholds()[name].value:g}",
            " / ".join(label.split()[1] for label in some),
            *(" / ".join(map(str, count)) for count in counts),
        ))  # fmt: skip
    return "\n".join(f"| {' | '.join(row)} |" for row in rows)


def _counts(answers: Sequence[Mapping[str, Answer]], label: str) -> tuple[int, ...]:
    """Recordings that are right; wrong causes; recordings in which each answer changes."""
    pairs = [(every[PRESENT], every[label]) for every in answers]
    changed = [
        sum(getattr(old, what) != getattr(new, what) for old, new in pairs)
        for what in ("verdicts", "causes", "lists")
    ]
    return sum(new.right for _, new in pairs), sum(new.wrong for _, new in pairs), *changed


def main() -> int:
    """Run the experiment and print its table; 130 if it was interrupted."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--output", type=Path, default=FOLDER / "threshold_sensitivity.jsonl")
    parser.add_argument("--read", type=Path, metavar="FILE", help="print its table again")
    given = parser.parse_args()
    code = 0 if given.read else _run(given.output, given.jobs)
    lines = (given.read or given.output).read_text("utf-8").splitlines()
    found = [json.loads(line)["answers"] for line in lines]
    answers = [{label: Answer(**values) for label, values in every.items()} for every in found]
    print(f"{len(answers)} recordings, seed {SEED}\n\n{table(answers)}")
    return code


def _run(output: Path, jobs: int) -> int:
    """Every recording is in the file as soon as it is done."""
    with output.open("w", encoding="utf-8") as file, Workers(jobs) as workers:
        try:
            for case, answers in workers.each(compare, plan(workers), "diagnose"):
                found = {label: asdict(one) for label, one in answers.items()}
                print(json.dumps({"case": str(case), "answers": found}), file=file, flush=True)
        except KeyboardInterrupt:
            return 130
    return 0


if __name__ == "__main__":
    sys.exit(main())
