"""Parts of the figure of a diagnosis: colours, units, broken lines, the band of noise."""

from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from edge_ident.diagnosis.result import AxisDiagnosis

Array = NDArray[np.float64]

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
