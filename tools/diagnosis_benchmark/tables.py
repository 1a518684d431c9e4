"""The benchmark's figures as tables."""

from collections import Counter
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import Final, Self

import numpy as np
from rich.console import Console
from rich.table import Table

from firmware_interface.plant import EFFECTS, UNKNOWN
from tools.diagnosis_benchmark.bias import JUDGED
from tools.diagnosis_benchmark.cases import CLEAN, MOTIONS, PAIRS, SINGLE, UNKNOWN_KIND
from tools.diagnosis_benchmark.outcome import Outcome
from tools.interval_coverage import wilson

_STRENGTH_BINS: Final = 8
# Columns that do not hold numbers.
_TEXTS: Final = (
    "",
    "case",
    "hidden",
    "kind",
    "motion",
    "verdict",
    "named",
    "suspected",
    "accused of",
)
_MOST_FAILURES: Final = 60  # rows of the list of cases that went wrong; the file has them all


@dataclass(frozen=True)
class Question:
    """What is counted of some cases.

    Attributes
    ----------
    title : str
    cases : sequence of Outcome
    holds : callable
    wanted : bool or None
        Whether a diagnosis is better where it holds; None: that says nothing of it.
    """

    title: str
    cases: Sequence[Outcome]
    holds: Callable[[Outcome], bool]
    wanted: bool | None = True


@dataclass(frozen=True)
class Groups:
    """Outcomes by what they tell: faults that count, disturbances that show, sound drives."""

    shown: Sequence[Outcome]
    pairs: Sequence[Outcome]
    unknown: Sequence[Outcome]
    clean: Sequence[Outcome]

    @classmethod
    def of(cls, outcomes: Sequence[Outcome]) -> Self:
        """Those among outcomes of any kind."""
        return cls(
            [o for o in outcomes if o.kind == SINGLE and o.counts],
            [o for o in outcomes if o.kind == PAIRS and o.counts],
            [o for o in outcomes if o.kind == UNKNOWN_KIND and o.seen],
            [o for o in outcomes if o.kind == CLEAN],
        )

    @property
    def all(self) -> list[Outcome]:
        """One after the other."""
        return [*self.shown, *self.pairs, *self.unknown, *self.clean]


def print_tables(outcomes: Sequence[Outcome], console: Console) -> None:
    """Everything that the outcomes have something to say on."""
    single = [o for o in outcomes if o.kind == SINGLE]
    groups = Groups.of(outcomes)
    tables = [headline(groups), false_alarms(outcomes)]
    if groups.unknown:
        tables.append(by_unknown(groups.unknown))
    if shown := groups.shown:
        tables += [by_effect(shown), confusion(shown), bias(shown, groups.clean)]
    if single:
        tables.append(by_strength(single))
    tables += [timing(outcomes), wall_time(outcomes), failures(groups.all)]
    for table in tables:
        console.print(table)


def headline(groups: Groups) -> Table:
    """What the whole benchmark comes to, by motion."""
    scales = sorted({o.scale for o in groups.all})
    sizes = " and ".join(f"{scale:g}" for scale in scales)
    title = f"faults above 1 % of the effort, at {sizes} of their size; 95 % intervals"
    table = _table(title, "", "all")
    for motion in MOTIONS:
        table.add_column(motion, justify="right")
    for asked in _of_groups(groups):
        if some := asked.cases:
            parts = [some, *([o for o in some if o.motion == m] for m in MOTIONS)]
            table.add_row(asked.title, *(_share(map(asked.holds, part)) for part in parts))
    return table


def questions(outcomes: Sequence[Outcome]) -> list[Question]:
    """All that is asked of single cases: the headline's rows, and the axes left alone."""
    judged = [o for o in outcomes if not o.failure]
    return [
        *_of_groups(Groups.of(outcomes)),
        Question("left alone: accused", judged, _accused, False),
        Question("left alone: all 'adequate'", judged, _left_adequate),
    ]


def _accused(o: Outcome) -> bool:
    """Whether an axis that was left alone has a cause."""
    return bool(o.sound_causes) or (o.kind == CLEAN and bool(o.causes))


def _left_adequate(o: Outcome) -> bool:
    """Whether each axis that was left alone is adequate."""
    return o.sound_verdict == "adequate" and (o.kind != CLEAN or o.verdict == "adequate")


def _of_groups(groups: Groups) -> list[Question]:
    """The rows of the headline."""
    shown, pairs, unknown, clean = groups.shown, groups.pairs, groups.unknown, groups.clean
    within, within_pairs = ([o for o in some if o.within_reach] for some in (shown, pairs))
    compared = [o for o in shown if o.compared]
    # of two effects that a report calls inseparable, the hidden one counts only where it says so
    rows: list[tuple[str, Sequence[Outcome], Callable[[Outcome], bool], bool | None]] = [
        ("single: first cause right", shown, lambda o: o.right, True),
        ("single: right or its one inseparable alternative", shown, lambda o: o.met, True),
        ("single: nothing else named (inseparable counts)", shown, lambda o: o.alone, True),
        ("single: that, and 'explained'", shown, lambda o: o.exact, True),
        ("single: first cause 'not separable'", shown, lambda o: o.undecided, None),
        ("single: no cause, but suspected or minor", shown, lambda o: o.suspects, None),
        ("single: another effect first", shown, lambda o: bool(o.causes) and not o.met, False),
        ("single, within reach: first cause right", within, lambda o: o.right, True),
        ("single, within reach: nothing else named", within, lambda o: o.alone, True),
        ("single, above 1 % as compared: first cause right", compared, lambda o: o.right, True),
        ("single, above 1 % as compared: nothing else named", compared, lambda o: o.alone, True),
        ("pairs: both found (inseparable counts)", pairs, lambda o: o.found_all, True),
        ("pairs, within reach: both found", within_pairs, lambda o: o.found_all, True),
        ("pairs: verdict exact", pairs, lambda o: o.exact, True),
        ("unknown: not 'explained'", unknown, lambda o: o.open, True),
        ("unknown: a confident name", unknown, lambda o: o.confident, False),
        ("unknown: any name", unknown, lambda o: bool(o.causes), False),
        ("clean: any cause", clean, lambda o: bool(o.causes), False),
        ("clean: 'adequate'", clean, lambda o: o.verdict == "adequate", True),
        ("ended with an error", groups.all, lambda o: bool(o.failure), False),
    ]
    return [Question(*row) for row in rows]


def false_alarms(outcomes: Sequence[Outcome]) -> Table:
    """How often an axis that was left alone gets a cause or a verdict other than adequate."""
    table = _table("axes left alone", "", "axes", "accused", "not adequate", "accused of")
    for kind in (CLEAN, SINGLE, PAIRS, UNKNOWN_KIND):
        some = [o for o in outcomes if o.kind == kind and not o.failure]
        axes = [(o.sound_causes, o.sound_verdict) for o in some]
        if kind == CLEAN:
            axes += [(o.causes, o.verdict) for o in some]
        if axes:
            names = Counter(cause.effect for causes, _ in axes for cause in causes)
            table.add_row(
                "both of clean drives" if kind == CLEAN else f"the other, {kind}",
                str(len(axes)),
                _share(bool(causes) for causes, _ in axes),
                _share(verdict != "adequate" for _, verdict in axes),
                ", ".join(f"{count} {name}" for name, count in names.most_common()),
            )
    return table


def by_effect(shown: Sequence[Outcome]) -> Table:
    """Right, and nothing else named, by effect and motion."""
    table = _table("right / nothing else named", "hidden")
    for motion in MOTIONS:
        for column in (motion, "right", "alone"):
            table.add_column(column, justify="right")
    for name in EFFECTS:
        cells = []
        for motion in MOTIONS:
            some = [o for o in shown if o.hidden == (name,) and o.motion == motion]
            cells += [str(len(some)), _share(o.right for o in some), _share(o.alone for o in some)]
        table.add_row(name, *cells)
    return table


def by_unknown(unknown: Sequence[Outcome]) -> Table:
    """Verdicts and names by disturbance."""
    table = _table("unknown disturbances", "hidden", "", "not explained", "confident", "accused of")
    for name in UNKNOWN:
        some = [o for o in unknown if o.hidden == (name,)]
        names = Counter(cause.effect for o in some for cause in o.causes)
        table.add_row(
            name,
            str(len(some)),
            _share(o.open for o in some),
            _share(o.confident for o in some),
            ", ".join(f"{count} {named}" for named, count in names.most_common()),
        )
    return table


def confusion(shown: Sequence[Outcome]) -> Table:
    """Hidden effects in rows, first-named causes in columns."""
    named = [*EFFECTS, "nothing"]
    table = _table("hidden (rows) and named first (columns)", "")
    for column in (*(str(n) for n in range(1, len(EFFECTS) + 1)), "nothing"):
        table.add_column(column, justify="right")
    for number, name in enumerate(EFFECTS, 1):
        firsts = [
            o.causes[0].effect if o.causes else "nothing" for o in shown if o.hidden == (name,)
        ]
        counts = [firsts.count(other) for other in named]
        table.add_row(f"{number} {name}", *(str(count) if count else "·" for count in counts))
    return table


def by_strength(single: Sequence[Outcome]) -> Table:
    """Detection against the share of the effort, over all cases."""
    table = _table(
        "single effects by their share", "share of the effort", "cases", "any cause", "right",
        "exact", "'adequate'",
    )  # fmt: skip
    for some in np.array_split(sorted(single, key=lambda o: o.share[0]), _STRENGTH_BINS):
        if len(some):
            table.add_row(
                f"{some[0].share[0]:.2%} to {some[-1].share[0]:.2%}",
                str(len(some)),
                _share(bool(o.causes) for o in some),
                _share(o.right for o in some),
                _share(o.exact for o in some),
                _share(o.verdict == "adequate" for o in some),
            )
    return table


def bias(shown: Sequence[Outcome], clean: Sequence[Outcome]) -> Table:
    """Median errors of the base parameters before and after the extension.

    Those of clean drives are what noise alone makes.
    """
    table = _table("median relative error, before → after extension (share left)", "", "cases")
    for name in JUDGED:
        table.add_column(name.replace("_", " "), justify="right")
    judged = [o for o in shown if not o.failure]
    groups = {name: [o for o in judged if o.hidden == (name,)] for name in EFFECTS}
    groups |= {f"all, {m}": [o for o in judged if o.motion == m] for m in MOTIONS}
    groups |= {"all": judged, "clean drives": [o for o in clean if not o.failure]}
    for title, some in groups.items():
        if some:
            before, after = (
                np.median([getattr(o, f"error_{when}") for o in some], axis=0)
                for when in ("before", "after")
            )
            cells = [f"{b:.2%} → {a:.2%} ({a / b:.2f})" for b, a in zip(before, after, strict=True)]
            table.add_row(title, str(len(some)), *cells)
    return table


def timing(outcomes: Iterable[Outcome]) -> Table:
    """Error of the shift between effort and position, where nothing is hidden in it."""
    table = _table("error of the shift, periods", "motion", "recordings", "median", "95 %")
    of = [o for o in outcomes if not o.failure and "time_delay" not in o.hidden]
    for motion in MOTIONS:
        errors = [abs(o.found_shift_periods - o.shift_periods) for o in of if o.motion == motion]
        if errors:
            figures = (np.median(errors), np.quantile(errors, 0.95))
            table.add_row(motion, str(len(errors)), *(f"{figure:.3f}" for figure in figures))
    return table


def wall_time(outcomes: Sequence[Outcome]) -> Table:
    """Wall time of one recording of two axes."""
    table = _table("wall time of a recording, s", "kind", "recordings", "median", "95 %", "longest")
    for kind in dict.fromkeys(o.kind for o in outcomes):
        times = [o.wall_s for o in outcomes if o.kind == kind and not o.failure]
        if times:
            figures = (np.median(times), np.quantile(times, 0.95), max(times))
            table.add_row(kind, str(len(times)), *(f"{figure:.2f}" for figure in figures))
    return table


def failures(outcomes: Iterable[Outcome]) -> Table:
    """Cases to look at again."""
    wrong = [o for o in outcomes if not (o.open if o.kind == UNKNOWN_KIND else o.exact)]
    table = _table(
        f"{len(wrong)} cases that went wrong, {_MOST_FAILURES} at most",
        "case", "hidden", "share", "detectability", "verdict", "named", "suspected",
    )  # fmt: skip
    for o in wrong[:_MOST_FAILURES]:
        table.add_row(
            o.case,
            " + ".join(o.hidden),
            " ".join(f"{share:.2%}" for share in o.share),
            " ".join(f"{index:.1f}" for index in o.detectability),
            o.failure or o.verdict,
            " + ".join(map(str, o.causes)),
            " + ".join(map(str, (*o.suspected, *o.minor))),
        )
    return table


def _share(holds: Iterable[bool]) -> str:
    """Percentage and Wilson's 95 % interval."""
    values = list(holds)
    if not values:
        return "–"
    low, high = wilson(float(np.mean(values)), len(values))
    return f"{np.mean(values):.1%} ({100 * low:.0f}–{100 * high:.0f})"


def _table(title: str, *columns: str) -> Table:
    table = Table(title=title, title_justify="left")
    for column in columns:
        table.add_column(column, justify="left" if column in _TEXTS else "right")
    return table
