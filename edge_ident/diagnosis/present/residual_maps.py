"""Figure: the residual against position, velocity, distance, time and frequency."""

from collections.abc import Mapping
from typing import Any, Final

import numpy as np
from scipy.signal import welch

from edge_ident.diagnosis.measures import Traces
from edge_ident.diagnosis.present import panels
from edge_ident.diagnosis.present.explained_variance import acceleration_at, running_time
from edge_ident.diagnosis.present.panels import Array, Units
from edge_ident.diagnosis.result import AxisDiagnosis
from edge_ident.support.drawing import new_figure

_SEGMENTS: Final = 8
"""Segments over which a spectrum is averaged, at least."""
_SPECTRUM_BAND: Final = 1.5
"""Highest frequency of the spectrum, over the bandwidth. Samples are 2.5 per period of the
bandwidth at least, so their spectrum ends at 1.25 times the bandwidth or above."""


def residual_maps(name: str, diagnosed: Mapping[str, AxisDiagnosis]) -> Any:
    """Draw a row for each quantity, the base model to the left, the extended one to the right.

    Parameters
    ----------
    name : str
        Of the axis to draw.
    diagnosed : mapping of axis name to AxisDiagnosis
        All axes; the acceleration of the others is a quantity, too.
    """
    axis = diagnosed[name]
    traces, valid = axis.traces, axis.traces.valid
    others = {
        f"acceleration of axis {other} ({Units.of(its).acceleration})": acceleration_at(
            traces, its.traces
        )
        for other, its in diagnosed.items()
        if other != name
    }
    models = {"base model": traces.base_effort}
    if axis.causes:
        models["extended model"] = traces.extended_effort
    rows = 5 + len(others)
    figure = new_figure(6.0 * len(models), 2.3 * rows)
    grid = figure.subplots(rows, len(models), squeeze=False, sharey="row", sharex="row")
    shown = panels.reach((traces.effort - traces.base_effort)[valid])
    for column, (model, effort) in zip(grid.T, models.items(), strict=True):
        residual = traces.effort - effort
        _draw_maps(column, axis, residual, others)
        for panel in column[:-1]:
            panels.noise_band(panel, axis)
            panel.set_ylim(-shown, shown)
        _draw_spectrum(column[-1], axis, residual)
        column[0].set_title(f"axis {name}, {model}")
    for panel in grid[:-1, 0]:
        panel.set_ylabel(f"residual ({Units.of(axis).effort})")
    grid[0, 0].legend(fontsize="small", loc="upper right")
    grid[-1, 0].legend(fontsize="small", loc="upper right")
    return figure


def _draw_maps(
    column: Any, axis: AxisDiagnosis, residual: Array, others: Mapping[str, Array]
) -> None:
    """Draw the valid samples; the others in grey, over the distance only.

    `others` holds accelerations (N,) by label.
    """
    traces, units = axis.traces, Units.of(axis)
    valid = traces.valid
    velocity, left = traces.velocity[valid], residual[valid]
    position, speed, distance, time, *rest = column
    panels.by_direction(position, traces.position[valid], left, velocity)
    position.set_xlabel(f"position ({units.position})")
    panels.by_direction(speed, velocity, left, velocity)
    speed.set_xlabel(f"velocity ({units.velocity})")
    distance.set_xscale("function", functions=(np.sqrt, np.square))  # most happens at reversals
    distance.set_xlim(0.0, float(np.max(traces.since_reversal)) or 1.0)
    panels.cloud(distance, traces.since_reversal[~valid], residual[~valid], "0.6")
    panels.by_direction(distance, traces.since_reversal[valid], left, velocity)
    distance.set_xlabel(f"distance since reversal ({units.position}); grey: not valid")
    seconds = running_time(traces)[valid]
    panels.cloud(time, seconds, left, "0.45")
    panels.mean_line(time, seconds, left, panels.MEASURED)
    time.set_xlabel("time (s)")
    for panel, (label, acceleration) in zip(rest, others.items(), strict=False):
        panels.by_direction(panel, acceleration[valid], left, velocity)
        panel.set_xlabel(label)


def _draw_spectrum(panel: Any, axis: AxisDiagnosis, residual: Array) -> None:
    """Draw amplitude densities, up to 1.5 times the bandwidth."""
    traces, units = axis.traces, Units.of(axis)
    for signal, colour, label in (
        (traces.effort, "0.6", "measured effort"),
        (residual, panels.MEASURED, "residual"),
    ):
        frequency, density = _density(traces, signal)
        seen = (frequency > 0.0) & (frequency <= _SPECTRUM_BAND * axis.cutoff_hz)
        panel.semilogy(frequency[seen], density[seen], color=colour, linewidth=1.2, label=label)
    panel.axvline(axis.cutoff_hz, color="0.4", linestyle=":", linewidth=1, label="bandwidth")
    panel.set_xlabel("frequency (Hz)")
    panel.set_ylabel(f"density ({units.effort}/√Hz)")


def _density(traces: Traces, signal: Array) -> tuple[Array, Array]:
    """Frequencies in Hz, and the square root of the power density (Welch 1967)."""
    period_s = float(np.median(np.diff(traces.time_s)))
    length = max(16, 2 * len(signal) // _SEGMENTS)
    frequency, power = welch(signal, 1.0 / period_s, nperseg=min(length, len(signal)))
    return frequency, np.sqrt(power)
