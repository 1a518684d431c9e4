"""A comparison as a table for a person and as a document for scripts."""

from typing import Any

from rich.box import SIMPLE_HEAD
from rich.console import Group
from rich.markup import escape
from rich.text import Text

from edge_ident.baselines.comparison import AxisComparison, Comparison, Row
from edge_ident.model.model import PARAMETERS
from edge_ident.report.documents import finding_document
from edge_ident.support.console import FittingTable


def comparison_view(comparison: Comparison) -> Group:
    """One table per axis; below it, why a method gave no answer, and the warnings of others."""
    parts: list[FittingTable | Text] = []
    for name, axis in comparison.axes.items():
        parts.append(_table(name, axis))
        parts += [
            Text(f"  {', '.join(methods)}: {remark}") for remark, methods in _remarks(axis).items()
        ]
    return Group(*parts)


def _remarks(axis: AxisComparison) -> dict[str, list[str]]:
    """Reasons and warning codes, each with the methods that it concerns."""
    remarks: dict[str, list[str]] = {}
    for row in axis.rows:
        remark = row.reason or ", ".join(finding.code for finding in row.findings)
        if remark:
            remarks.setdefault(remark, []).append(row.method.replace("_", " "))
    return remarks


def _table(name: str, axis: AxisComparison) -> FittingTable:
    table = FittingTable(
        title=f"axis {escape(name)}: {axis.samples} samples, filtered at {axis.cutoff_hz:.3g} Hz",
        title_justify="left",
        box=SIMPLE_HEAD,
        padding=(0, 1, 0, 0),
        pad_edge=False,
    )
    table.add_column("method")
    for parameter, unit in zip(PARAMETERS, axis.units, strict=True):
        table.add_column(f"{parameter.split('_')[0]}\n{unit}", justify="right")
    for heading in ("resid.\n%", "fit", "time-\nspectral", "time\nms"):
        table.add_column(heading, justify="right")
    for row in axis.rows:
        in_two_lines = row.method.replace("_", "\n", 1).replace("_", " ")
        table.add_row(in_two_lines, *_cells(row))
    return table


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
