"""Estimates with their intervals side by side, one panel per parameter."""

from typing import TYPE_CHECKING, Any, Final

import numpy as np

from edge_ident.baselines.comparison import AxisComparison, Comparison
from edge_ident.model.model import NORMAL_95, PARAMETERS
from edge_ident.support.drawing import new_figure

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_FAR: Final = 2.0
"""Times the best relative residual, above which an estimate does not set a panel's range."""


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
