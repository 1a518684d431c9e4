"""What is shown of an error budget: its table, and on a page a bar and the curves."""

from collections.abc import Iterator
from typing import Any, Final

import numpy as np
from markupsafe import Markup

from edge_ident.diagnosis.error_budget import NOISE, BudgetCurve, BudgetEntry, ErrorBudget
from edge_ident.report.chart import Chart, Layer, across, around
from edge_ident.report.numbers import digits, sentence, unit_text
from edge_ident.report.view import Grid, Line, Part, ResultView
from edge_ident.support.rows import Table, table_of
from edge_ident.support.words import listed, spoken


def budget_parts(budget: ErrorBudget, title: str = "") -> Iterator[Part]:
    """A budget: one sentence, and its table."""
    yield Line(title + missed_sentence(budget))
    headings = "of this, along", "share", "effort rms", "curve beyond the base model"
    yield Grid("", headings, budget_rows(budget), plain=True)


def missed_sentence(budget: ErrorBudget) -> str:
    """What is missed, in one line."""
    return (
        f"the base model misses {budget.missed:.3g} {unit_text(budget.unit)} rms, "
        f"{100.0 * budget.share_of_effort:.2g} % of the effort"
    )


def budget_rows(budget: ErrorBudget) -> list[tuple[str, str, str, str]]:
    """Where, share, rms effort, and curves with the effects that they are, as text."""
    unit = unit_text(budget.unit)
    return [
        (label(e), _percent(e.share), f"{e.effort:.2g} {unit}", _remark(e)) for e in budget.entries
    ]


def label(entry: BudgetEntry) -> str:
    """Where, with the quantities that the motion does not tell it from."""
    return " or ".join((entry.where, *entry.together_with))


def _remark(entry: BudgetEntry) -> str:
    """Curves, and the effects that they are."""
    curves = ", ".join(map(str, entry.curves))
    effects = f"named: {listed(spoken(name) for name in entry.named)}" if entry.named else ""
    return "; ".join(filter(None, (curves, effects)))


def budget_table(budget: ErrorBudget) -> Table:
    """One row for each entry."""
    names = "where", "share", "share_low", "share_high", "effort_rms", "unit", "named"
    return table_of(
        (*names, "together_with"),
        (
            (e.where, e.share, *e.interval, e.effort, budget.unit, ", ".join(e.named),
             ", ".join(e.together_with))
            for e in budget.entries
        ),
    )  # fmt: skip


# The error budget on a page: one bar that adds up, and the curves with their bands.


def budget_picture(key: str, budget: ErrorBudget) -> dict[str, Any]:
    """What the page shows of an error budget; `key` is unique in the page."""
    pairs = [(entry, curve) for entry in budget.entries for curve in entry.curves]
    headings = ("along", "share", "effort, rms", "beyond the simple model")
    title = "Where this error lies (shares add up to 100 %)"
    return {
        "missed": sentence(missed_sentence(budget)),
        "bar": _budget_bar(budget),
        "table": Grid(title, headings, budget_rows(budget)),
        "charts": [_chart(f"{key}-{number}", *pair) for number, pair in enumerate(pairs)],
    }


def _budget_bar(budget: ErrorBudget) -> Markup:
    """The shares side by side."""
    from edge_ident.report.page.rendering import picture  # a page alone needs it

    parts, begin, curves = [], 0.0, 0
    for entry in budget.entries:
        share = max(entry.share, 0.0)
        kind = "noise" if entry.where == NOISE else "rest"
        if entry.curves or entry.named:
            kind, curves = f"part{curves % 3}", curves + 1
        title = f"{label(entry)}: {_percent(share)}"
        parts.append((kind, 100.0 * begin, 100.0 * share, title))
        begin += share
    said = "; ".join(f"{label(entry)} {_percent(entry.share)}" for entry in budget.entries)
    return picture("budget", parts, f"Of the error: {said}")


def _percent(share: float) -> str:
    return f"{100.0 * share:.0f} %"


def _chart(key: str, entry: BudgetEntry, curve: BudgetCurve) -> Chart:
    """A curve with its band."""
    unit, x = unit_text(curve.unit), curve.coordinate
    low, high = float(np.min(curve.values)), float(np.max(curve.values))
    level = np.array([0.0])
    return Chart(
        key,
        sentence(f"{curve.what} over {curve.over}, beyond the simple model").removesuffix("."),
        f"It goes from {digits(low, 2)} to {digits(high, 2)} {unit}, and is "
        f"{_percent(entry.share)} of the error.",
        (curve.over, unit_text(curve.coordinate_unit)),
        (f"missed {curve.what}", unit),
        across(x),
        around(np.concatenate([curve.low, curve.high, level])),
        (
            Layer(
                "area",
                "noise",
                np.concatenate([x, x[::-1]]),
                np.concatenate([curve.low, curve.high[::-1]]),
                "90 % band",
            ),
            Layer("line", "extended", x, curve.values, "curve"),
        ),
        height=180,
    )


VIEW: Final = ResultView(budget_table, budget_parts)
