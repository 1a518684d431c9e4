"""Scores as tables."""

from collections.abc import Sequence

import numpy as np
from rich.console import Console
from rich.table import Table

from tools.paired import paired, print_paired
from tools.real_machines.scores import BETTER, HARMED, Score


def print_scores(scores: Sequence[Score], console: Console) -> None:
    """Each axis, and what all come to."""
    table = _table("residual on the other recording", "pair", "axis", "own", "other", "ratio")
    for column in ("verdict", "causes", "suspected"):
        table.add_column(column)
    for s in scores:
        table.add_row(
            s.pair,
            s.axis,
            f"{s.base_own:.2%} → {s.extended_own:.2%}",
            f"{s.base:.2%} → {s.extended:.2%}" if s.judged else s.note,
            _ratio(s),
            s.verdict,
            "; ".join(s.causes) or "–",
            "; ".join(s.suspected) or "–",
        )
    console.print(table)
    console.print(summary(scores))


def summary(scores: Sequence[Score]) -> Table:
    """Harmed, still naming, and the median ratio of those that name."""
    judged = [s for s in scores if s.judged]
    naming = [s for s in judged if s.causes]
    harmed = [s for s in judged if s.harmed]
    ratios = [s.ratio for s in naming]
    table = _table("all axes, both ways round", "axes", "harmed", "explained and harmed")
    for column in ("still naming", "ratio of these, median", "largest ratio"):
        table.add_column(column)
    table.add_row(
        f"{len(judged)} of {len(scores)}",
        str(len(harmed)),
        str(sum(s.verdict == "explained" for s in harmed)),
        str(len(naming)),
        f"{np.median(ratios):.2f}" if ratios else "–",
        f"{max(ratios):.2f}" if ratios else "–",
    )
    return table


def compare_scores(old: Sequence[Score], new: Sequence[Score], console: Console) -> int:
    """Print what two versions come to on the same axes.

    Returns
    -------
    int
        1 where something is lost beyond chance, otherwise 0.
    """
    before, after = ({f"{s.pair}, axis {s.axis}": s for s in some} for some in (old, new))
    names = [name for name in before if name in after]
    table = _table("ratio of residuals on the other recording", "", "old", "new", "old", "new")
    for name in names:
        both = (before[name], after[name])
        left = (f"{s.base:.2%} → {s.extended:.2%}" if s.judged else s.note for s in both)
        table.add_row(name, *(_ratio(s) for s in both), *left)
    console.print(table)
    better = {name: (before[name].better, after[name].better) for name in names}
    harmed = {name: (before[name].harmed, after[name].harmed) for name in names}
    rows = [
        paired(f"better by a tenth (at most {BETTER:g})", better),
        paired(f"harmed (above {HARMED:g})", harmed, wanted=False),
    ]
    title = f"{len(names)} scores in common, of {len(before)} old and {len(after)} new ones"
    return print_paired(rows, title, console)


def _ratio(score: Score) -> str:
    if not score.judged:
        return "–"
    return f"{score.ratio:.2f}{' harmed' if score.harmed else ''}"


def _table(title: str, *columns: str) -> Table:
    table = Table(*columns, title=title, title_justify="left")
    for column in table.columns:
        column.overflow = "fold"
    return table
