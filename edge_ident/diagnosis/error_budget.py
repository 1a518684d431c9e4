"""The error budget of an axis: where the effort lies that the base model misses.

Its entries add up to the mean square of what is missed. Two that overlap share what they have in
common half and half: each entry's share is its product with all that is missed.
"""

from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from edge_ident.model.model import Term
from edge_ident.support.rows import Readable

Array = NDArray[np.float64]

ABOVE_BAND: Final = "above the band"
REPEATS: Final = "repeats, along no curve"
UNREPEATED: Final = "does not repeat"
NOISE: Final = "noise"


@dataclass(frozen=True)
class BudgetCurve:
    """What the base model misses as a curve over one quantity.

    Attributes
    ----------
    what : str
        What it is a curve of, such as friction.
    over : str
        The quantity.
    coordinate : (P,) array
        Over the range that the recordings visit.
    values, low, high : (P,) arrays
        The curve beyond the base model, and its 90 % band.
    unit, coordinate_unit : str
    """

    what: str
    over: str
    coordinate: Array
    values: Array
    low: Array
    high: Array
    unit: str
    coordinate_unit: str

    def document(self) -> dict[str, Any]:
        """For scripts."""
        return {
            "of": self.what,
            "over": self.over,
            "coordinate": {
                "values": self.coordinate.tolist(),
                "unit": self.coordinate_unit,
                "range": [float(self.coordinate[0]), float(self.coordinate[-1])],
            },
            "values": self.values.tolist(),
            "band": {"low": self.low.tolist(), "high": self.high.tolist(), "coverage": 0.9},
            "unit": self.unit,
        }

    def __str__(self) -> str:
        low, high = float(np.min(self.values)), float(np.max(self.values))
        unit = self.unit.replace("*", "·")
        return f"{self.what} {low:+.2g} to {high:+.2g} {unit}".replace("-", "\N{MINUS SIGN}")


@dataclass(frozen=True)
class AgreeingCurve:
    """A curve in the extended model: every part of the recordings predicts the others better by it.

    Attributes
    ----------
    term : Term
        It as a table (`edge_ident.model.measured_curves`).
    curve : BudgetCurve
        With its band.
    share : float
        Rms of its effort beyond the base model, over that of the whole effort.
    freedom : float
        Its effective degrees of freedom.
    """

    term: Term
    curve: BudgetCurve
    share: float
    freedom: float

    def document(self) -> dict[str, Any]:
        """For scripts."""
        source = {} if self.term.source_axis is None else {"source_axis": self.term.source_axis}
        return {"effect": self.term.effect, **source, "share": self.share, **self.curve.document()}

    def __str__(self) -> str:
        return f"{self.curve} over {self.curve.over}"


@dataclass(frozen=True)
class BudgetEntry:
    """One place where effort is missed.

    Attributes
    ----------
    where : str
    share : float
        Of the mean square of all that is missed.
    interval : (float, float)
        Of the share, 90 %.
    effort : float
        Rms of an effort with this mean square.
    curves : tuple of BudgetCurve
    named : tuple of str
        Effects of the diagnosis that are this.
    together_with : tuple of str
        Quantities from which the motion does not tell it.
    """

    where: str
    share: float
    interval: tuple[float, float]
    effort: float
    curves: tuple[BudgetCurve, ...] = ()
    named: tuple[str, ...] = ()
    together_with: tuple[str, ...] = ()


@dataclass(frozen=True, repr=False)
class ErrorBudget(Readable):
    """Where the effort lies that the base model of an axis misses.

    Attributes
    ----------
    entries : tuple of BudgetEntry
        The largest first; last what lies above the band, what follows no curve, and noise.
    missed : float
        Rms of the effort that the base model misses.
    share_of_effort : float
        The same over the rms effort.
    cutoff_hz : float
        Up to which motion and effort are compared.
    unit : str
        Of the effort.

    Examples
    --------
    >>> import edge_ident
    >>> budget = edge_ident.diagnose([edge_ident.simulate()]).budget["x"]
    >>> round(sum(entry.share for entry in budget.entries), 6)
    1.0
    """

    entries: tuple[BudgetEntry, ...]
    missed: float
    share_of_effort: float
    cutoff_hz: float
    unit: str

    @property
    def along_curves(self) -> float:
        """Share of what is missed that curves account for."""
        return float(sum(entry.share for entry in self.entries if entry.curves))

    def share(self, where: str) -> float:
        """Share of what is missed at one place, alone or with what is not told from it; 0 where
        there is none."""
        found = (e for e in self.entries if where in (e.where, *e.together_with))
        return float(sum(entry.share for entry in found))

    def document(self) -> list[dict[str, Any]]:
        """For scripts."""
        return [
            {
                "where": entry.where,
                "share": entry.share,
                "interval": list(entry.interval),
                "effort": {"rms": entry.effort, "unit": self.unit},
                "named": list(entry.named),
                "together_with": list(entry.together_with),
                "curves": [curve.document() for curve in entry.curves],
            }
            for entry in self.entries
        ]
