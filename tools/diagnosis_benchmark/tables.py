"""The benchmark's figures as tables."""

from collections import Counter
from collections.abc import Callable, Iterable, Sequence
from typing import Final

import numpy as np
from rich.console import Console
from rich.table import Table

from firmware_interface.plant import EFFECTS, UNKNOWN
from tools.diagnosis_benchmark.bias import JUDGED
from tools.diagnosis_benchmark.cases import CLEAN, MOTIONS, PAIRS, SINGLE, UNKNOWN_KIND
from tools.diagnosis_benchmark.outcome import Outcome
from tools.interval_coverage import wilson

_STRENGTH_BINS: Final = 8
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
"""Columns that do not hold numbers."""
_MOST_FAILURES: Final = 60
"""Rows of the list of cases that went wrong; the file has them all."""


def print_tables(outcomes: Sequence[Outcome], console: Console) -> None:
    """Everything that the outcomes have something to say on."""
    single = [o for o in outcomes if o.kind == SINGLE]
    shown = [o for o in single if o.counts]
    pairs = [o for o in outcomes if o.kind == PAIRS and o.counts]
    unknown = [o for o in outcomes if o.kind == UNKNOWN_KIND and o.seen]
    clean = [o for o in outcomes if o.kind == CLEAN]
    tables = [headline(shown, pairs, unknown, clean), false_alarms(outcomes)]
    if unknown:
        tables.append(by_unknown(unknown))
    if shown:
        tables += [by_effect(shown), confusion(shown), bias(shown, clean)]
    if single:
        tables.append(by_strength(single))
    tables += [timing(outcomes), wall_time(outcomes), failures([*shown, *pairs, *unknown, *clean])]
    for table in tables:
        console.print(table)


def headline(
    shown: Sequence[Outcome],
    pairs: Sequence[Outcome],
    unknown: Sequence[Outcome],
    clean: Sequence[Outcome],
) -> Table:
    """What the whole benchmark comes to, by motion."""
    scales = sorted({o.scale for o in (*shown, *pairs, *unknown, *clean)})
    sizes = " and ".join(f"{scale:g}" for scale in scales)
    title = f"faults above 1 % of the effort, at {sizes} of their size; 95 % intervals"
    table = _table(title, "", "all")
    for motion in MOTIONS:
        table.add_column(motion, justify="right")
    for title, some, holds in _rows(shown, pairs, unknown, clean):
        if some:
            groups = [some, *([o for o in some if o.motion == m] for m in MOTIONS)]
            table.add_row(title, *(_share(map(holds, group)) for group in groups))
    return table


def _rows(
    shown: Sequence[Outcome],
    pairs: Sequence[Outcome],
    unknown: Sequence[Outcome],
    clean: Sequence[Outcome],
) -> list[tuple[str, Sequence[Outcome], Callable[[Outcome], bool]]]:
    """Title of each row of the headline, its cases, and what is counted."""
    within, within_pairs = ([o for o in some if o.within_reach] for some in (shown, pairs))
    compared = [o for o in shown if o.compared]
    # of two effects that a report calls inseparable, the hidden one counts only where it says so
    return [
        ("single: first cause right", shown, lambda o: o.right),
        ("single: right or its one inseparable alternative", shown, lambda o: o.met),
        ("single: nothing else named (inseparable counts)", shown, lambda o: o.alone),
        ("single: that, and 'explained'", shown, lambda o: o.exact),
        ("single: first cause 'not separable'", shown, lambda o: o.undecided),
        ("single: no cause, but suspected or minor", shown, lambda o: o.suspects),
        ("single: another effect first", shown, lambda o: bool(o.causes) and not o.met),
        ("single, within reach: first cause right", within, lambda o: o.right),
        ("single, within reach: nothing else named", within, lambda o: o.alone),
        ("single, above 1 % as compared: first cause right", compared, lambda o: o.right),
        ("single, above 1 % as compared: nothing else named", compared, lambda o: o.alone),
        ("pairs: both found (inseparable counts)", pairs, lambda o: o.found_all),
        ("pairs, within reach: both found", within_pairs, lambda o: o.found_all),
        ("pairs: verdict exact", pairs, lambda o: o.exact),
        ("unknown: not 'explained'", unknown, lambda o: o.open),
        ("unknown: a confident name", unknown, lambda o: o.confident),
        ("unknown: any name", unknown, lambda o: bool(o.causes)),
        ("clean: any cause", clean, lambda o: bool(o.causes)),
        ("clean: 'adequate'", clean, lambda o: o.verdict == "adequate"),
        ("ended with an error", [*shown, *pairs, *unknown, *clean], lambda o: bool(o.failure)),
    ]


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
