"""Figure: measured effort, predictions of both models, and their residuals over time."""

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from numpy.typing import NDArray

from edge_ident.diagnosis.result import AxisDiagnosis, Diagnosis
from edge_ident.report.diagnosis_documents import running_time
from edge_ident.report.figure import new_figure

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Array = NDArray[np.float64]


# Parts of the figure of a diagnosis: colours, units, broken lines, the band of noise.

MEASURED: Final = "0.25"
BASE: Final = "tab:orange"
EXTENDED: Final = "tab:blue"


@dataclass(frozen=True)
class Units:
    """Units of an axis, as the figures print them."""

    position: str
    effort: str

    @classmethod
    def of(cls, axis: AxisDiagnosis) -> "Units":
        """The units of an axis's model."""
        return cls(axis.model.position_unit, axis.model.effort_unit.replace("*", "·"))


def line(panel: Any, x: Array, y: Array, file: NDArray[np.intp], **style: Any) -> None:
    """Draw a line that is broken between recordings."""
    breaks = np.flatnonzero(np.diff(file)) + 1
    panel.plot(np.insert(x, breaks, np.nan), np.insert(y, breaks, np.nan), **style)


def noise_band(panel: Any, axis: AxisDiagnosis) -> None:
    """Shade one standard deviation of the noise floor to either side of zero."""
    effort = axis.traces.effort[axis.traces.valid]
    rms = axis.noise_floor * float(np.sqrt(np.mean(effort**2))) if len(effort) else 0.0
    panel.axhspan(-rms, rms, color="0.85", zorder=0, label="noise floor")


def reach(values: Array) -> float:
    """Half the height of a panel that shows all but the farthest values."""
    return 1.3 * float(np.quantile(np.abs(np.append(values, 0.0)), 0.995)) or 1.0


_DETAIL: Final = 0.08
"""Share of the samples in the detail."""


def diagnosis_figure(diagnosis: Diagnosis) -> "Figure":
    """Draw the efforts of all axes, one axis above the other."""
    count = len(diagnosis.axes)
    figure = new_figure(12, 6 * count)
    parts = figure.subfigures(count, squeeze=False)[:, 0]
    for part, (name, axis) in zip(parts, diagnosis.axes.items(), strict=True):
        _draw_axis(part, name, axis)
    return figure


def effort_figure(name: str, axis: AxisDiagnosis) -> "Figure":
    """Draw all of the time to the left, and the part that the causes change most to the right."""
    figure = new_figure(12, 6)
    _draw_axis(figure, name, axis)
    return figure


def _draw_axis(figure: Any, name: str, axis: AxisDiagnosis) -> None:
    grid = figure.subplots(
        2, 2, sharex="col", sharey="row", width_ratios=(2.2, 1), height_ratios=(1.3, 1)
    )
    units = Units.of(axis)
    time = running_time(axis.traces)
    for column, part in enumerate((slice(None), _busiest(axis))):
        _draw_efforts(grid[0][column], axis, time, part)
        _draw_residuals(grid[1][column], axis, time, part)
        grid[1][column].set_xlabel("time (s)")
        grid[1][column].margins(x=0)
    grid[0][0].set_title(f"axis {name}")
    grid[0][1].set_title("detail")
    grid[0][0].set_ylabel(f"effort ({units.effort})")
    grid[1][0].set_ylabel(f"residual ({units.effort})")
    grid[0][1].legend(fontsize="small", loc="upper right")
    grid[1][1].legend(fontsize="small", loc="upper right")


def _busiest(axis: AxisDiagnosis) -> slice:
    """The part of the time in which the extended model differs most from the base model."""
    traces = axis.traces
    changed = traces.extended_effort if axis.extends_base else traces.effort
    samples = len(changed)
    width = max(2, round(_DETAIL * samples))
    energy = np.cumsum(np.where(traces.valid, changed - traces.base_effort, 0.0) ** 2)
    first = int(np.argmax(energy[width:] - energy[:-width]))
    return slice(first, first + width)


def _draw_efforts(panel: Any, axis: AxisDiagnosis, time: Array, part: slice) -> None:
    traces = axis.traces
    x, file = time[part], traces.file[part]
    measured = {"color": MEASURED, "linewidth": 2.2, "alpha": 0.5, "label": "measured"}
    line(panel, x, traces.effort[part], file, **measured)
    for colour, label, effort in _models(axis):
        line(panel, x, effort[part], file, color=colour, linewidth=1.0, label=label)


def _draw_residuals(panel: Any, axis: AxisDiagnosis, time: Array, part: slice) -> None:
    """Draw residuals, faint at samples that are not valid."""
    traces = axis.traces
    x, file = time[part], traces.file[part]
    noise_band(panel, axis)
    shown = 0.0
    for colour, label, effort in _models(axis):
        residual = traces.effort - effort
        of_valid = np.where(traces.valid, residual, np.nan)
        line(panel, x, residual[part], file, color=colour, linewidth=0.6, alpha=0.35)
        line(panel, x, of_valid[part], file, color=colour, linewidth=0.9, label=label)
        shown = max(shown, reach(residual[traces.valid]))
    panel.set_ylim(-shown, shown)


def _models(axis: AxisDiagnosis) -> list[tuple[str, str, Array]]:
    """Colour, label and prediction of each model."""
    base = (BASE, "base model", axis.traces.base_effort)
    extended = (EXTENDED, "extended model", axis.traces.extended_effort)
    return [base, extended] if axis.extends_base else [base]
