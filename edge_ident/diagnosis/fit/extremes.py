"""Laws that act where a speed or an effort is larger than at any other time.

Such a law shows once, and a disturbance in time may describe it. Whether it does so any better than
a law is a question of fit: a law bends from some value on, or jumps there.
"""

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from edge_ident.diagnosis.fit.fitting import FittedModel
from edge_ident.diagnosis.fit.projection import orthonormal
from edge_ident.diagnosis.fit.term_effort import term_effort
from edge_ident.diagnosis.prepare.axis_data import AxisData

Array = NDArray[np.float64]

_BENDS: Final = (1.0, 0.9, 0.8, 0.7)
"""Parts of the range at all other times from which on a law may act."""
_JUMPS: Final = (0.0, 0.25, 0.5, 0.75)
"""Parts of what lies beyond it at which a law may jump."""


@dataclass(frozen=True)
class Extremes:
    """Where S signals (S, N) lie beyond their ranges at the quiet samples (N,), all at once."""

    signals: Array
    quiet: NDArray[np.bool_]

    def excess(self, part: float = 1.0) -> Array:
        """How far (N,) the signals lie beyond a part of these ranges; the least of them counts."""
        known = part * self.signals[:, self.quiet]
        low, high = (f(known, axis=1, keepdims=True) for f in (np.min, np.max))
        beyond = np.maximum(low - self.signals, self.signals - high)
        return np.asarray(np.maximum(np.min(beyond, axis=0), 0.0))

    @property
    def laws(self) -> Array:
        """Efforts (L, N) that add up to any law that bends or jumps there."""
        bends = [self.excess(part) for part in _BENDS]
        excess = bends[0]
        jumps = [1.0 * (excess > part * np.max(excess)) for part in _JUMPS]
        return np.array([excess**2, *bends, *jumps])


def error_with(data: AxisData, model: FittedModel, places: list[int], laws: Array) -> float:
    """Sum of squares that a model leaves with laws in the place of some of its terms.

    Parameters
    ----------
    data : AxisData
    model : FittedModel
    places : list of int
        Of the terms.
    laws : (L, N) array
        Efforts along all motions, one after the other.
    """
    ends = np.cumsum([len(s.effort) for s in data.segments])[:-1]
    parts = zip(data.segments, np.split(laws, ends, axis=1), strict=True)
    seen = np.concatenate([s.filter(part) for s, part in parts], axis=1)
    of_terms = sum(term_effort(data, model, place) for place in places)
    effort = (data.effort - model.predicted + of_terms)[data.valid]
    own = np.r_[tuple(model.columns_of(place) for place in places)]
    others = np.delete(model.derivatives, own, axis=1)
    basis = orthonormal(np.hstack([others, seen.T])[data.valid])
    left = effort - basis @ (basis.T @ effort)
    return float(left @ left)
