"""Outcomes of two versions of the diagnosis, case by case."""

from collections.abc import Sequence

import numpy as np
from rich.console import Console

from tools.diagnosis_benchmark.outcome import Outcome
from tools.diagnosis_benchmark.tables import Question, questions
from tools.paired import Paired, paired, print_paired

_SAME_SHARE = 0.01
"""Relative difference of a hidden effect's share of the effort, below which it is the same: other
processors round otherwise, and an encoder makes counts of it."""


def compare_outcomes(old: Sequence[Outcome], new: Sequence[Outcome], console: Console) -> int:
    """Print what two versions say of the same cases.

    Returns
    -------
    int
        1 where something is lost beyond chance, otherwise 0.
    """
    before, after = ({o.case: o for o in some} for some in (old, new))
    common = [name for name in before if name in after]
    same = [name for name in common if _same(before[name], after[name])]
    if others := len(common) - len(same):
        console.print(f"{others} cases of the same name hide something else now: left out")
    rows = paired_outcomes([before[name] for name in same], [after[name] for name in same])
    title = f"{len(same)} cases in common, of {len(before)} old and {len(after)} new ones"
    return print_paired(rows, title, console)


def paired_outcomes(old: Sequence[Outcome], new: Sequence[Outcome]) -> list[Paired]:
    """Every question that the tables ask, of the same cases by two versions."""
    return [
        _paired(asked, again) for asked, again in zip(questions(old), questions(new), strict=True)
    ]


def _paired(old: Question, new: Question) -> Paired:
    """A question; it is asked of a case where either version asks it."""
    before, after = ({o.case: old.holds(o) for o in asked.cases} for asked in (old, new))
    names = dict.fromkeys((*before, *after))
    answers = {name: (before.get(name, False), after.get(name, False)) for name in names}
    return paired(old.title, answers, wanted=old.wanted)


def _same(old: Outcome, new: Outcome) -> bool:
    """Whether the same is hidden."""
    return old.hidden == new.hidden and np.allclose(old.share, new.share, rtol=_SAME_SHARE)
