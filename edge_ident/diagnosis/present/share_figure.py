"""Figure: the contribution of each cause, over the residual of the model without it."""

from typing import Any

import numpy as np

from edge_ident.diagnosis.present import panels
from edge_ident.diagnosis.present.explained_variance import running_time
from edge_ident.diagnosis.present.panels import Array
from edge_ident.diagnosis.present.wording import spoken
from edge_ident.diagnosis.result import AxisDiagnosis
from edge_ident.support.drawing import new_figure


def share_figure(name: str, axis: AxisDiagnosis) -> Any:
    """Draw a row for each cause: over time, position and velocity.

    The grey points are the residual of the extended model without this cause (component and
    residual plots: Larsen and McCleary, Technometrics 14 (1972) 781). The coloured points, the
    contribution of the cause, lie among them where its formula is right.
    """
    traces, units = axis.traces, panels.Units.of(axis)
    valid = traces.valid
    residual = (traces.effort - traces.extended_effort)[valid]
    figure = new_figure(13, 0.6 + 2.6 * len(traces.contributions))
    grid = figure.subplots(len(traces.contributions), 3, squeeze=False, sharey="row", sharex="col")
    over = {
        "time (s)": running_time(traces),
        f"position ({units.position})": traces.position,
        f"velocity ({units.velocity})": traces.velocity,
    }
    for row, (effect, part) in zip(grid, traces.contributions.items(), strict=True):
        for panel, x in zip(row, over.values(), strict=True):
            panels.cloud(panel, x[valid], residual + part[valid], "0.5", 0.5)
            panels.by_direction(panel, x[valid], part[valid], traces.velocity[valid], means=False)
        row[0].set_ylim(*_range(residual + part[valid]))
        row[0].set_title(f"axis {name}, {spoken(effect)}", loc="left", fontsize=10)
        row[0].set_ylabel(f"effort ({units.effort})")
    for panel, label in zip(grid[-1], over, strict=True):
        panel.set_xlabel(label)
    _add_legend(grid[0, 0])
    return figure


def _range(values: Array) -> tuple[float, float]:
    """Limits that show all but the farthest values and zero, with a margin."""
    low, high = np.quantile(np.append(values, 0.0), (0.002, 0.998))
    margin = 0.1 * float(high - low) or 1.0
    return float(low) - margin, float(high) + margin


def _add_legend(panel: Any) -> None:
    for colour, label in (
        (panels.FORWARD, "this cause, forward"),
        (panels.BACKWARD, "this cause, backward"),
        ("0.5", "residual without it"),
    ):
        panel.plot([], [], ".", color=colour, label=label)
    panel.legend(fontsize="small", loc="upper right")
