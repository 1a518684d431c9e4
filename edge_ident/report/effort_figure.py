"""Measured effort against a model, and the residual."""

from typing import TYPE_CHECKING, Any, Final

import numpy as np

from edge_ident.identification.result import EffortTrace, Identification
from edge_ident.report.figure import new_figure

if TYPE_CHECKING:
    from matplotlib.figure import Figure

# Sampling periods from which the residual's line is broken: the axis stood still there.
_GAP: Final = 1.5


def effort_figure(identification: Identification) -> "Figure":
    """A column per axis: effort and model above, residual below."""
    figure = new_figure(10, 5)
    axes = identification.axes
    grid = figure.subplots(2, len(axes), sharex=True, squeeze=False)
    for (top, bottom), (name, axis) in zip(grid.T, axes.items(), strict=True):
        draw_effort(top, bottom, name, axis.trace, axis.units[3])
        bottom.set_xlabel("time (s)")
    return figure


def draw_effort(top: Any, bottom: Any, axis: str, trace: EffortTrace, unit: str) -> None:
    """Draw one axis into two panels."""
    unit = unit.replace("*", "·")
    top.plot(trace.time_s, trace.measured, label="measured, filtered", linewidth=1.5)
    top.plot(trace.time_s, trace.modelled, "--", label="identified model", linewidth=1)
    top.set_title(f"axis {axis}")
    top.set_ylabel(f"effort ({unit})")
    top.legend(fontsize="small")
    gaps = np.flatnonzero(np.diff(trace.time_s) > _GAP * np.median(np.diff(trace.time_s))) + 1
    time_s, residual = trace.time_s, trace.measured - trace.modelled
    time_s, residual = (np.insert(column, gaps, np.nan) for column in (time_s, residual))
    bottom.plot(time_s, residual, color="tab:red", linewidth=1)
    bottom.set_ylabel(f"residual ({unit})")
