"""The error budget on a page: one bar that adds up, and the curves with their bands."""

from dataclasses import dataclass

import numpy as np
from markupsafe import Markup

from edge_ident.diagnosis.error_budget import NOISE, BudgetCurve, BudgetEntry, ErrorBudget
from edge_ident.report.page.card import Table
from edge_ident.report.page.chart import Chart, Layer
from edge_ident.report.page.scale import across, around
from edge_ident.report.page.wording import digits, sentence, unit_text


@dataclass(frozen=True)
class BudgetPicture:
    """What the page shows of an error budget.

    Attributes
    ----------
    missed : str
        How much is missed.
    bar : Markup
    table : Table
    charts : list of Chart
    """

    missed: str
    bar: Markup
    table: Table
    charts: list[Chart]


def budget_picture(key: str, budget: ErrorBudget) -> BudgetPicture:
    """Draw a budget; `key` is unique in the page."""
    pairs = [(entry, curve) for entry in budget.entries for curve in entry.curves]
    return BudgetPicture(
        missed=sentence(budget.sentence),
        bar=_bar(budget),
        table=Table(
            "Where this error lies (shares add up to 100 %)",
            ("along", "share", "effort, rms", "beyond the simple model"),
            list(budget.rows),
        ),
        charts=[
            _chart(f"{key}-{number}", entry, curve) for number, (entry, curve) in enumerate(pairs)
        ],
    )


def _bar(budget: ErrorBudget) -> Markup:
    """The shares side by side."""
    parts, begin = [], 0.0
    curves = 0
    for entry in budget.entries:
        share = max(entry.share, 0.0)
        kind = "noise" if entry.where == NOISE else "rest"
        if entry.curves or entry.named:
            kind, curves = f"part{curves % 3}", curves + 1
        parts.append(
            Markup(
                '<rect class="{}" x="{:.2f}%" width="{:.2f}%" height="22"><title>{}: {}</title>'
                "</rect>"
            ).format(kind, 100.0 * begin, 100.0 * share, entry.label, _percent(share))
        )
        begin += share
    said = "; ".join(f"{entry.label} {_percent(entry.share)}" for entry in budget.entries)
    return Markup(
        '<svg class="budget" role="img" height="22" width="100%" aria-label="{}">{}</svg>'
    ).format(f"Of the error: {said}", Markup("").join(parts))


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
