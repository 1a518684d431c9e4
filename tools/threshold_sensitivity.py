"""What becomes of the diagnosis when a threshold of the selection is lower or higher.

Each threshold of `select.thresholds` that decides something is lowered to 0.7 and raised to 1.4
times its value, the others unchanged, and the same recordings are diagnosed again. A share near one
has its distance from one doubled and halved instead. The recordings are of the benchmark: single
effects that show, clean drives, pairs, and disturbances that no effect explains.

    python -m tools.threshold_sensitivity --jobs 2
    python -m tools.threshold_sensitivity --read FILE        the table of a former run

What depends on no threshold is computed once for each recording.
"""

import os

# one thread for each process; before numpy is loaded
os.environ["OMP_NUM_THREADS"] = os.environ["OPENBLAS_NUM_THREADS"] = "1"

import argparse
import json
import pickle
import sys
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import asdict, dataclass, replace
from functools import wraps
from hashlib import sha256
from io import BytesIO
from pathlib import Path
from typing import Any, Final

from edge_ident.diagnosis import diagnose as engine
from edge_ident.diagnosis.fit import fitting, held_out, noise_floor, summary
from edge_ident.diagnosis.prepare import preparation
from edge_ident.diagnosis.prepare.axis_data import AxisData
from edge_ident.diagnosis.result import Diagnosis
from edge_ident.diagnosis.select import criterion, testability
from edge_ident.diagnosis.select.search import Search
from edge_ident.diagnosis.select.thresholds import thresholds
from tests.plant import EFFECTS
from tools.diagnosis_benchmark.cases import CLEAN, PAIRS, SINGLE, UNKNOWN_KIND, Batch, Case
from tools.diagnosis_benchmark.hiding import FOLDER, load_batch
from tools.diagnosis_benchmark.outcome import Outcome, judge
from tools.diagnosis_benchmark.running import Workers, shows

SEED: Final = 4004
MOTIONS: Final = ("multisine", "paper")
FACTORS: Final = (0.7, 1.4)
SPECIAL: Final = {"KEPT_TERM": (-10.0, 10.0), "BOOTSTRAP_SEED": (2, 3)}
"""What has no meaningful multiple."""
UNDECIDING: Final = ("INDISTINGUISHABLE",)
PRESENT: Final = "present values"

_PURE: Final[tuple[tuple[object, str], ...]] = (
    (preparation, "prepare_axis"),
    (fitting, "fit"),
    (held_out, "held_out_residuals"),
    (held_out, "standard_deviations"),
    (noise_floor, "noise_floor"),
    (summary, "model_fit"),
    (summary, "contributions"),
    (summary, "traces"),
    (criterion, "model_discrepancy"),
    (testability, "_orthogonal_shares"),
    (Search, "of"),
    (Search, "_coarse"),
)
"""Functions that no threshold reaches, and that take the time."""


@dataclass(frozen=True)
class Answer:
    """What a diagnosis says of one recording.

    Attributes
    ----------
    right : bool
        The first cause is a hidden effect; without hidden effects, there is no cause.
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
    return Answer(
        right=outcome.right if outcome.hidden else not found,
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
            for value in SPECIAL.get(name) or _around(threshold.value):
                found[f"{name} {value:g}"] = (name, value)
    return found


def _around(value: float) -> tuple[float, ...]:
    if isinstance(value, int):
        return tuple(round(factor * value) for factor in FACTORS)
    if FACTORS[0] < value < 1.0:
        return tuple(1.0 - factor * (1.0 - value) for factor in (2.0, 0.5))
    return tuple(factor * value for factor in FACTORS)


def plan(workers: Workers) -> list[Case]:
    """The recordings: each effect once, motions in turn; pairs and the unknown; clean drives."""
    kinds = {kind: [Batch(kind, m, SEED, 0) for m in MOTIONS] for kind in (SINGLE, CLEAN)}
    kinds |= {kind: [Batch(kind, MOTIONS[0], SEED, 0)] for kind in (PAIRS, UNKNOWN_KIND)}
    workers.simulate([batch for batches in kinds.values() for batch in batches])
    cases = []
    for place, effect in enumerate(EFFECTS):
        batch = kinds[SINGLE][place % len(MOTIONS)]
        rows = [row for row, hidden in enumerate(batch.hidden) if hidden == (effect,)]
        cases += [case for row in rows if shows(case := Case(batch, row))][:1]
    for kind, some in ((PAIRS, 4), (UNKNOWN_KIND, 2), (CLEAN, 2)):
        for batch in kinds[kind]:
            every = [Case(batch, row) for row in range(len(batch.hidden))]
            cases += [case for case in every if kind == CLEAN or shows(case)][:some]
    return cases


def compare(case: Case) -> tuple[Case, dict[str, Answer]]:
    """Diagnose one case with the present thresholds and with each change."""
    with _remembering():
        answers = {PRESENT: _diagnosed(case)}
        for label, (name, value) in variants().items():
            with _threshold(name, value):
                answers[label] = _diagnosed(case)
    return case, answers


def _diagnosed(case: Case) -> Answer:
    diagnosis = engine.diagnose([load_batch(case.batch).recording(case.row)])
    return answer(judge(case, diagnosis, 0.0), diagnosis)


@contextmanager
def _threshold(name: str, value: float) -> Iterator[None]:
    """Give a threshold another value in every module that imported it."""
    present: Any = thresholds()[name]
    changed = replace(present, value=value)
    with _exchanged([(place, attribute, changed) for place, attribute in _places(present)]):
        yield


@contextmanager
def _remembering() -> Iterator[None]:
    """Let the pure functions return what they returned for the same arguments before."""
    memory = _Memory()
    changes: list[tuple[object, str, object]] = []
    for owner, attribute in _PURE:
        present = vars(owner)[attribute]
        places = [(owner, attribute)] if isinstance(owner, type) else _places(present)
        changes += [(place, name, memory.of(present)) for place, name in places]
    with _exchanged(changes):
        yield


@contextmanager
def _exchanged(changes: Sequence[tuple[object, str, object]]) -> Iterator[None]:
    """Set attributes of modules and classes for a while."""
    before = [(owner, name, vars(owner)[name]) for owner, name, _ in changes]
    for owner, name, value in changes:
        setattr(owner, name, value)
    try:
        yield
    finally:
        for owner, name, value in before:
            setattr(owner, name, value)


def _places(wanted: object) -> list[tuple[object, str]]:
    """Modules of the diagnosis that have an object, and its name there."""
    return [
        (module, name)
        for path, module in list(sys.modules.items())
        if path.startswith("edge_ident.diagnosis")
        for name, value in list(vars(module).items())
        if value is wanted
    ]


class _Memory:
    """Results by function and by the contents of its arguments."""

    def __init__(self) -> None:
        self._results: dict[bytes, Any] = {}
        self._kept: dict[int, object] = {}

    def of(self, function: Any) -> Any:
        """The same function, with this memory; a class method stays one."""
        if isinstance(function, classmethod):
            return classmethod(self.of(function.__func__))

        @wraps(function)
        def remembered(*args: Any, **named: Any) -> Any:
            key = self._key((function.__qualname__, args, named))
            if key not in self._results:
                self._results[key] = function(*args, **named)
            return self._results[key]

        return remembered

    def _key(self, arguments: object) -> bytes:
        buffer = BytesIO()
        pickler = pickle.Pickler(buffer, protocol=5)
        pickler.persistent_id = self._identity  # type: ignore[method-assign]
        pickler.dump(arguments)
        return sha256(buffer.getvalue()).digest()

    def _identity(self, value: object) -> int | None:
        """Large objects that are made once are told apart by identity."""
        if isinstance(value, Search):
            value = value.library
        elif not isinstance(value, AxisData):
            return None
        self._kept[id(value)] = value
        return id(value)


def table(answers: Sequence[Mapping[str, Answer]]) -> str:
    """Table in Markdown, one row for each change."""
    rows: list[tuple[str, ...]] = [
        ("threshold", "first cause right", "wrong causes", "verdict changes", "causes change",
         "other lists change"),
        ("---",) * 6,
    ]  # fmt: skip
    for label in (PRESENT, *variants()):
        here = [(every[PRESENT], every[label]) for every in answers]
        rows.append((
            f"`{label.split()[0]}` = {label.split()[1]}" if label != PRESENT else label,
            str(sum(new.right for _, new in here)),
            str(sum(new.wrong for _, new in here)),
            *(
                str(sum(getattr(old, what) != getattr(new, what) for old, new in here))
                for what in ("verdicts", "causes", "lists")
            ),
        ))  # fmt: skip
    return "\n".join(f"| {' | '.join(row)} |" for row in rows)


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
