"""What the figures of a diagnosis are made of: colours, clouds of points, means over bins."""

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
"""Of a cloud; more only blacken it."""
_BINS: Final = 60
"""Of a line of means, at most."""
_PER_BIN: Final = 15
"""Samples, were they even; a bin with less than a third of it is left out."""


@dataclass(frozen=True)
class Units:
    """Of an axis, as they are written at the figures' axes."""

    position: str
    effort: str

    @classmethod
    def of(cls, axis: AxisDiagnosis) -> "Units":
        """Those of its model."""
        return cls(axis.model.position_unit, axis.model.effort_unit.replace("*", "·"))

    @property
    def velocity(self) -> str:
        """Position a second."""
        return f"{self.position}/s"

    @property
    def acceleration(self) -> str:
        """Velocity a second."""
        return f"{self.position}/s²"


def line(panel: Any, x: Array, y: Array, file: NDArray[np.intp], **style: Any) -> None:
    """A line that is broken between recordings."""
    breaks = np.flatnonzero(np.diff(file)) + 1
    panel.plot(np.insert(x, breaks, np.nan), np.insert(y, breaks, np.nan), **style)


def cloud(panel: Any, x: Array, y: Array, colour: str, strength: float = 0.3) -> None:
    """Points, thinned out evenly; the fewer, the larger."""
    thin = slice(None, None, max(1, len(x) // _POINTS))
    size = float(np.clip(100.0 / np.sqrt(len(x[thin]) + 1), 2.5, 5.0))
    style = {"color": colour, "alpha": strength, "markersize": size, "markeredgewidth": 0}
    panel.plot(x[thin], y[thin], ".", **style)


def mean_line(panel: Any, x: Array, y: Array, colour: str, label: str | None = None) -> None:
    """Means over bins that are equally wide on paper, whatever the panel's scale."""
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
    """Clouds, forward and backward apart, with their means or dense enough to do without."""
    for colour, label, part in (
        (FORWARD, "forward", velocity > 0.0),
        (BACKWARD, "backward", velocity < 0.0),
    ):
        cloud(panel, x[part], y[part], colour, 0.3 if means else 0.8)
        if means:
            mean_line(panel, x[part], y[part], colour, label)


def noise_band(panel: Any, axis: AxisDiagnosis) -> None:
    """Where noise alone would leave two residuals of three."""
    rms = axis.noise_floor * float(np.sqrt(np.mean(axis.traces.effort**2)))
    panel.axhspan(-rms, rms, color="0.85", zorder=0, label="noise floor")


def reach(values: Array) -> float:
    """Half of a panel's height that shows all but the farthest values."""
    return 1.3 * float(np.quantile(np.abs(np.append(values, 0.0)), 0.995)) or 1.0
