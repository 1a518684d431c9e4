"""Each cause's own share of the effort, over what the rest of the model leaves."""

from typing import Any

import numpy as np

from edge_ident.diagnosis.present import panels
from edge_ident.diagnosis.present.panels import Array
from edge_ident.diagnosis.present.whereabouts import running_time
from edge_ident.diagnosis.present.wording import spoken
from edge_ident.diagnosis.result import AxisDiagnosis
from edge_ident.support.drawing import new_figure


def share_figure(name: str, axis: AxisDiagnosis) -> Any:
    """A row for each cause: over time, position and velocity.

    The grey points are what the extended model leaves without this cause (component and residual
    plots: Larsen and McCleary, Technometrics 14 (1972) 781); the coloured ones lie among them
    where the cause has the right shape.
    """
    traces, units = axis.traces, panels.Units.of(axis)
    clear = traces.clear
    residual = (traces.effort - traces.extended_effort)[clear]
    figure = new_figure(13, 0.6 + 2.6 * len(traces.shares))
    grid = figure.subplots(len(traces.shares), 3, squeeze=False, sharey="row", sharex="col")
    over = {
        "time (s)": running_time(traces),
        f"position ({units.position})": traces.position,
        f"velocity ({units.velocity})": traces.velocity,
    }
    for row, (effect, share) in zip(grid, traces.shares.items(), strict=True):
        for panel, x in zip(row, over.values(), strict=True):
            panels.cloud(panel, x[clear], residual + share[clear], "0.5", 0.5)
            panels.by_direction(panel, x[clear], share[clear], traces.velocity[clear], means=False)
        row[0].set_ylim(*_range(residual + share[clear]))
        row[0].set_title(f"axis {name}, {spoken(effect)}", loc="left", fontsize=10)
        row[0].set_ylabel(f"effort ({units.effort})")
    for panel, label in zip(grid[-1], over, strict=True):
        panel.set_xlabel(label)
    _add_legend(grid[0, 0])
    return figure


def _range(values: Array) -> tuple[float, float]:
    """Of all but the farthest values, with zero in it and a margin."""
    low, high = np.quantile(np.append(values, 0.0), (0.002, 0.998))
    margin = 0.1 * float(high - low) or 1.0
    return float(low) - margin, float(high) + margin


def _add_legend(panel: Any) -> None:
    for colour, label in (
        (panels.FORWARD, "this cause, forward"),
        (panels.BACKWARD, "this cause, backward"),
        ("0.5", "left without it"),
    ):
        panel.plot([], [], ".", color=colour, label=label)
    panel.legend(fontsize="small", loc="upper right")
