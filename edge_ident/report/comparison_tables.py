"""A comparison as a table for a person and as a document for scripts."""

from collections.abc import Iterator
from functools import partial
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from edge_ident.baselines.comparison import AxisComparison, Comparison, Row
from edge_ident.model.model import NORMAL_95, PARAMETERS
from edge_ident.report.documents import finding_document
from edge_ident.report.figure import new_figure
from edge_ident.report.view import Grid, Line, Part, ResultView
from edge_ident.support.rows import Cell, Table, table_of

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def comparison_view(comparison: Comparison) -> ResultView:
    """What is shown of a comparison."""
    return ResultView(
        partial(comparison_table, comparison),
        partial(_parts, comparison),
        partial(comparison_figure, comparison),
    )


def _parts(comparison: Comparison) -> Iterator[Part]:
    """One table per axis; below it, why a method gave no answer, and the warnings of others."""
    for name, axis in comparison.axes.items():
        yield _table(name, axis)
        for remark, methods in _remarks(axis).items():
            yield Line(f"  {', '.join(methods)}: {remark}")


def _remarks(axis: AxisComparison) -> dict[str, list[str]]:
    """Reasons and warning codes, each with the methods that it concerns."""
    remarks: dict[str, list[str]] = {}
    for row in axis.rows:
        remark = row.reason or ", ".join(finding.code for finding in row.findings)
        if remark:
            remarks.setdefault(remark, []).append(row.method.replace("_", " "))
    return remarks


def _table(name: str, axis: AxisComparison) -> Grid:
    units = zip(PARAMETERS, axis.units, strict=True)
    headings = [f"{parameter.split('_')[0]}\n{unit}" for parameter, unit in units]
    return Grid(
        f"axis {name}: {axis.samples} samples, filtered at {axis.cutoff_hz:.3g} Hz",
        ("method", *headings, "resid.\n%", "fit", "time-\nspectral", "time\nms"),
        [(row.method.replace("_", "\n", 1).replace("_", " "), *_cells(row)) for row in axis.rows],
        plain=True,
    )


def _cells(row: Row) -> list[str]:
    if row.estimate is None or row.metric is None:
        return ["–"] * (len(PARAMETERS) + 3) + [f"{row.time_ms:.0f}"]
    return [
        *(
            f"{value:.4g}\n±{std:.2g}"
            for value, std in zip(row.estimate.parameters, row.estimate.std, strict=True)
        ),
        f"{100 * row.metric.relative_residual:.2f}",
        f"{row.metric.fit:.4f}",
        f"{row.metric.time_spectral:.4f}",
        f"{row.time_ms:.0f}" if row.time_ms >= 10 else f"{row.time_ms:.1f}",
    ]


def comparison_document(comparison: Comparison) -> dict[str, Any]:
    """Schema edge-ident/comparison/1; a method without an answer has null and its reason."""
    return {
        "schema": "edge-ident/comparison/1",
        "axes": {
            name: {
                "samples": axis.samples,
                "cutoff_hz": axis.cutoff_hz,
                "methods": {row.method: _method(row, axis) for row in axis.rows},
            }
            for name, axis in comparison.axes.items()
        },
    }


def _method(row: Row, axis: AxisComparison) -> dict[str, Any]:
    parameters = metric = None
    if row.estimate is not None and row.metric is not None:
        parameters = {
            name: {
                "value": float(row.estimate.parameters[i]),
                "std": float(row.estimate.std[i]),
                "unit": axis.units[i],
            }
            for i, name in enumerate(PARAMETERS)
        }
        metric = {
            "time_spectral": row.metric.time_spectral,
            "fit": row.metric.fit,
            "relative_residual": row.metric.relative_residual,
        }
    return {
        "parameters": parameters,
        "metric": metric,
        "reason": row.reason or None,
        "warnings": [finding_document(finding) for finding in row.findings],
        "time_ms": round(row.time_ms, 3),
    }


# A table that a data frame takes.

_COMPARED: Final = (
    "axis", "method", "parameter", "value", "std", "unit", "relative_residual", "time_ms", "reason",
)  # fmt: skip


def comparison_table(comparison: Comparison) -> Table:
    """A row for each parameter of each method; one with a reason where a method has no answer."""

    def rows() -> Iterator[tuple[Cell, ...]]:
        for name, axis in comparison.axes.items():
            for row in axis.rows:
                residual = None if row.metric is None else float(row.metric.relative_residual)
                rest = residual, row.time_ms, row.reason or None
                if row.estimate is None:
                    yield name, row.method, None, None, None, None, *rest
                    continue
                for i, parameter in enumerate(PARAMETERS):
                    value, std = float(row.estimate.parameters[i]), float(row.estimate.std[i])
                    yield name, row.method, parameter, value, std, axis.units[i], *rest

    return table_of(_COMPARED, rows())


# Estimates with their intervals side by side, one panel per parameter.

# Times the best relative residual, above which an estimate does not set a panel's range.
_FAR: Final = 2.0


def comparison_figure(comparison: Comparison) -> "Figure":
    """Draw every method's estimate of every parameter, a row of panels per axis."""
    rows = sum(2 + len(axis.rows) for axis in comparison.axes.values())
    figure = new_figure(12, 0.32 * rows)
    grid = figure.subplots(len(comparison.axes), len(PARAMETERS), squeeze=False, sharey="row")
    for panels, (name, axis) in zip(grid, comparison.axes.items(), strict=True):
        for index, panel in enumerate(panels):
            _draw_parameter(panel, axis, index)
        panels[0].set_yticks(
            range(len(axis.rows)), [row.method.replace("_", " ") for row in axis.rows]
        )
        panels[0].set_ylim(len(axis.rows) - 0.5, -0.5)
        panels[0].set_ylabel(f"axis {name}")
    return figure


def _draw_parameter(panel: Any, axis: AxisComparison, index: int) -> None:
    """Value and 95 % interval of every method; an arrow where the value lies outside."""
    low, high = _range(axis, index)
    panel.set_xlim(low, high)
    panel.set_title(f"{PARAMETERS[index].replace('_', ' ')} ({axis.units[index]})", fontsize=10)
    panel.locator_params(axis="x", nbins=5)
    panel.grid(axis="x", alpha=0.3)
    for line, row in enumerate(axis.rows):
        if row.estimate is None:
            panel.text(0.5 * (low + high), line, "no answer", ha="center", va="center", alpha=0.5)
            continue
        value, std = float(row.estimate.parameters[index]), float(row.estimate.std[index])
        if low <= value <= high:
            panel.errorbar(value, line, xerr=NORMAL_95 * std, fmt="o", color="tab:blue", capsize=3)
            continue
        edge, side, arrow = (low, "left", "◀") if value < low else (high, "right", "▶")
        text = f"{arrow} {value:.3g}" if side == "left" else f"{value:.3g} {arrow}"
        panel.text(edge, line, text, ha=side, va="center", color="tab:red", fontsize=9)


def _range(axis: AxisComparison, index: int) -> tuple[float, float]:
    """From the lowest to the highest interval of the estimates that describe the effort."""
    answered = [(row.estimate, row.metric) for row in axis.rows if row.estimate and row.metric]
    best = min((metric.relative_residual for _, metric in answered), default=0.0)
    shown = [
        (estimate.parameters[index], NORMAL_95 * estimate.std[index])
        for estimate, metric in answered
        if metric.relative_residual <= _FAR * best
    ]
    if not shown:
        return 0.0, 1.0
    low = float(np.min([value - reach for value, reach in shown]))
    high = float(np.max([value + reach for value, reach in shown]))
    margin = 0.15 * (high - low) or 0.1 * abs(low) or 1.0
    return low - margin, high + margin
