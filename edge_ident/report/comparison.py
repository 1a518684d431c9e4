"""A comparison as a table for a person and as a document for scripts."""

from collections.abc import Iterator
from dataclasses import asdict
from typing import Any, Final

import numpy as np

from edge_ident.baselines.comparison import AxisComparison, Comparison, Row
from edge_ident.model.model import NORMAL_95, PARAMETERS, Estimate
from edge_ident.report import chart, documents, numbers, view
from edge_ident.support.rows import Cell, Table, table_of
from edge_ident.support.words import spoken


def _parts(comparison: Comparison) -> Iterator[view.Part]:
    """One table per axis; below it, why a method gave no answer, and the warnings of others."""
    for name, axis in comparison.axes.items():
        yield _table(name, axis)
        for remark, methods in _remarks(axis).items():
            yield view.Line(f"  {', '.join(methods)}: {remark}")


def _remarks(axis: AxisComparison) -> dict[str, list[str]]:
    """Reasons and warning codes, each with the methods that it concerns."""
    remarks: dict[str, list[str]] = {}
    for row in axis.rows:
        remark = row.reason or ", ".join(finding.code for finding in row.findings)
        if remark:
            remarks.setdefault(remark, []).append(spoken(row.method))
    return remarks


def _table(name: str, axis: AxisComparison) -> view.Grid:
    units = zip(PARAMETERS, axis.units, strict=True)
    headings = [f"{parameter.split('_')[0]}\n{unit}" for parameter, unit in units]
    return view.Grid(
        f"axis {name}: {axis.samples} samples, filtered at {axis.cutoff_hz:.3g} Hz",
        ("method", *headings, "resid.\n%", "fit", "time-\nspectral", "time\nms"),
        [(spoken(row.method).replace(" ", "\n", 1), *_cells(row)) for row in axis.rows],
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
    return {
        "parameters": row.estimate and documents.estimate_document(row.estimate, axis.units),
        "metric": row.metric and asdict(row.metric),
        "reason": row.reason or None,
        "warnings": [asdict(finding) for finding in row.findings],
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


# Estimates with their intervals side by side, one chart per parameter.

# Times the best relative residual, above which an estimate does not set a chart's range.
_FAR: Final = 2.0


def _charts(comparison: Comparison) -> list[list[chart.Chart]]:
    """Every method's estimate of every parameter, a row of charts per axis."""
    return [
        [_parameter(name, axis, index) for index in range(len(PARAMETERS))]
        for name, axis in comparison.axes.items()
    ]


def _parameter(name: str, axis: AxisComparison, index: int) -> chart.Chart:
    """Value and 95 % interval of every method; one that lies far out stands at the edge."""
    low, high = _range(axis, index)
    layers = []
    for place, row in enumerate(axis.rows):
        if row.estimate is None:
            continue
        value, reach = _with_reach(row.estimate, index)
        inside, line = low <= value <= high, np.full(2, float(place))
        ends = np.array([value - reach, value + reach])
        layers.append(chart.Layer("line", "extended", ends, line))
        mark = np.clip([value], low, high)
        layers.append(chart.Layer("marks", "extended" if inside else "backward", mark, line[:1]))
    methods = [f"{spoken(r.method)}{'' if r.estimate else ', no answer'}" for r in axis.rows]
    names = tuple("" if index else method for method in methods)  # once in a row of charts
    return chart.Chart(
        "", f"axis {name}", "",
        (spoken(PARAMETERS[index]), numbers.unit_text(axis.units[index])), ("", ""),
        chart.Scale(low, high), chart.Scale(len(names) - 0.5, -0.5, names=names), tuple(layers),
        height=40 + 25 * len(names),
    )  # fmt: skip


def _with_reach(estimate: Estimate, index: int) -> tuple[float, float]:
    """A parameter, and half of its 95 % interval."""
    return float(estimate.parameters[index]), NORMAL_95 * float(estimate.std[index])


def _range(axis: AxisComparison, index: int) -> tuple[float, float]:
    """From the lowest to the highest interval of the estimates that describe the effort."""
    answered = [(row.estimate, row.metric) for row in axis.rows if row.estimate and row.metric]
    best = min((metric.relative_residual for _, metric in answered), default=0.0)
    shown = [
        _with_reach(estimate, index)
        for estimate, metric in answered
        if metric.relative_residual <= _FAR * best
    ]
    if not shown:
        return 0.0, 1.0
    scale = chart.around(
        np.array([end for value, reach in shown for end in (value - reach, value + reach)])
    )
    return scale.low, scale.high


VIEW: Final = view.ResultView(comparison_table, _parts, _charts)
