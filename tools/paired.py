"""Two versions on the same cases: what holds in both, in one of them, in neither.

Percentages of two runs have different denominators, and their intervals hold the difference between
cases, which both versions share. Only cases on which the two differ tell them apart: as many should
change one way as the other (McNemar, Psychometrika 12 (1947) 153), which the binomial distribution
judges exactly.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Final

from rich.console import Console
from rich.table import Table
from scipy.stats import binomtest

CHANCE: Final = 0.0027
"""Two-sided probability beyond three standard deviations of a normal distribution."""


@dataclass(frozen=True)
class Paired:
    """One question, asked of each case twice.

    Attributes
    ----------
    question : str
    both, neither : int
        Cases of which it holds by both versions, by neither.
    only_old, only_new : tuple of str
        Names of the cases of which it holds by one of them.
    wanted : bool or None
        Whether a version is better where it holds; None: that says nothing of it.
    """

    question: str
    both: int
    neither: int
    only_old: tuple[str, ...]
    only_new: tuple[str, ...]
    wanted: bool | None = True

    @property
    def cases(self) -> int:
        """In common."""
        return self.both + self.neither + len(self.only_old) + len(self.only_new)

    @property
    def p(self) -> float:
        """Exact two-sided probability of a difference at least as large by chance."""
        changed = len(self.only_old) + len(self.only_new)
        return float(binomtest(len(self.only_old), changed).pvalue) if changed else 1.0

    @property
    def lost(self) -> tuple[str, ...]:
        """Names of the cases in which the new version is worse."""
        if self.wanted is None:
            return ()
        return self.only_old if self.wanted else self.only_new

    @property
    def is_loss(self) -> bool:
        """Whether the new version is worse in more cases than chance makes it."""
        changed = len(self.only_old) + len(self.only_new)
        return self.p < CHANCE and 2 * len(self.lost) > changed


def paired(
    question: str, answers: Mapping[str, tuple[bool, bool]], *, wanted: bool | None = True
) -> Paired:
    """Count the answers of two versions.

    Parameters
    ----------
    question : str
    answers : mapping of name of a case to (bool, bool)
        Whether it holds by the old version, and by the new one.
    wanted : bool or None
        Whether a version is better where it holds; None: that says nothing of it.
    """

    def those(*wanted_answer: bool) -> tuple[str, ...]:
        return tuple(name for name, answer in answers.items() if answer == wanted_answer)

    both, neither = len(those(True, True)), len(those(False, False))
    return Paired(question, both, neither, those(True, False), those(False, True), wanted)


def paired_table(rows: Iterable[Paired], title: str) -> Table:
    """The questions that some case in common answers, one a row."""
    table = Table(title=title, title_justify="left")
    table.add_column("")
    for column in ("in common", "both", "only old", "only new", "neither", "p"):
        table.add_column(column, justify="right")
    table.add_column("beyond chance")
    for row in rows:
        if row.cases:
            counts = (row.cases, row.both, len(row.only_old), len(row.only_new), row.neither)
            table.add_row(row.question, *map(str, counts), f"{row.p:.2g}", _judged(row))
    return table


def _judged(row: Paired) -> str:
    if row.p >= CHANCE or row.wanted is None:
        return ""
    return "LOST" if row.is_loss else "gained"


def print_paired(rows: Sequence[Paired], title: str, console: Console) -> int:
    """Print the table and the cases lost; 1 where something is lost beyond chance, otherwise 0."""
    console.print(paired_table(rows, title))
    lost: dict[str, list[str]] = {}
    for row in rows:
        for name in row.lost:
            lost.setdefault(name, []).append(row.question)
    for name, questions in lost.items():
        console.print(f"lost: {name}  {'; '.join(questions)}")
    return int(any(row.is_loss for row in rows))
