"""Parts of the figures of a diagnosis: colours, clouds of points, means over bins."""

from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from edge_ident.diagnosis.result import AxisDiagnosis

Array = NDArray[np.float64]

MEASURED: Final = "0.25"
BASE: Final = "tab:orange"
EXTENDED: Final = "tab:blue"
FORWARD: Final = "tab:green"
BACKWARD: Final = "tab:purple"
_POINTS: Final = 3000
"""Most points of a cloud; more only blacken it."""
_BINS: Final = 60
"""Most bins of a line of means."""
_PER_BIN: Final = 15
"""Mean number of samples; a bin with less than a third of it is left out."""


@dataclass(frozen=True)
class Units:
    """Units of an axis, as the figures print them."""

    position: str
    effort: str

    @classmethod
    def of(cls, axis: AxisDiagnosis) -> "Units":
        """The units of an axis's model."""
        return cls(axis.model.position_unit, axis.model.effort_unit.replace("*", "·"))

    @property
    def velocity(self) -> str:
        """Unit of the velocity."""
        return f"{self.position}/s"

    @property
    def acceleration(self) -> str:
        """Unit of the acceleration."""
        return f"{self.position}/s²"


def line(panel: Any, x: Array, y: Array, file: NDArray[np.intp], **style: Any) -> None:
    """Draw a line that is broken between recordings."""
    breaks = np.flatnonzero(np.diff(file)) + 1
    panel.plot(np.insert(x, breaks, np.nan), np.insert(y, breaks, np.nan), **style)


def cloud(panel: Any, x: Array, y: Array, colour: str, strength: float = 0.3) -> None:
    """Draw points, thinned out evenly; fewer points are larger."""
    thin = slice(None, None, max(1, len(x) // _POINTS))
    size = float(np.clip(100.0 / np.sqrt(len(x[thin]) + 1), 2.5, 5.0))
    style = {"color": colour, "alpha": strength, "markersize": size, "markeredgewidth": 0}
    panel.plot(x[thin], y[thin], ".", **style)


def mean_line(panel: Any, x: Array, y: Array, colour: str, label: str | None = None) -> None:
    """Draw means over bins of equal width on paper, whatever the panel's scale."""
    if not len(x):
        return
    bins = int(np.clip(len(x) // _PER_BIN, 1, _BINS))
    on_paper = panel.xaxis.get_transform().transform(x)
    edges = np.linspace(np.min(on_paper), np.max(on_paper), bins + 1)
    index = np.clip(np.searchsorted(edges, on_paper, side="right") - 1, 0, bins - 1)
    count = np.bincount(index, minlength=bins)
    full = 3 * count >= _PER_BIN
    mean = [np.bincount(index, weights=of, minlength=bins)[full] / count[full] for of in (x, y)]
    panel.plot(*mean, ".-", color=colour, linewidth=1.5, markersize=4, label=label)


def by_direction(panel: Any, x: Array, y: Array, velocity: Array, *, means: bool = True) -> None:
    """Draw clouds, forward and backward apart, with their means or denser without them."""
    for colour, label, part in (
        (FORWARD, "forward", velocity > 0.0),
        (BACKWARD, "backward", velocity < 0.0),
    ):
        cloud(panel, x[part], y[part], colour, 0.3 if means else 0.8)
        if means:
            mean_line(panel, x[part], y[part], colour, label)


def noise_band(panel: Any, axis: AxisDiagnosis) -> None:
    """Shade one standard deviation of the noise floor to either side of zero."""
    effort = axis.traces.effort[axis.traces.valid]
    rms = axis.noise_floor * float(np.sqrt(np.mean(effort**2))) if len(effort) else 0.0
    panel.axhspan(-rms, rms, color="0.85", zorder=0, label="noise floor")


def reach(values: Array) -> float:
    """Half the height of a panel that shows all but the farthest values."""
    return 1.3 * float(np.quantile(np.abs(np.append(values, 0.0)), 0.995)) or 1.0
