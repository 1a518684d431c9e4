"""Vibrations from outside: the frequencies of the clock that are loudest in a residual."""

from dataclasses import dataclass
from typing import Final, Self

import numpy as np
from numpy.typing import NDArray

from edge_ident.diagnosis.fit.candidates import Candidate
from edge_ident.diagnosis.fit.trying import Shapes
from edge_ident.diagnosis.prepare.view import View
from edge_ident.model.outside_vibration import OUTSIDE_VIBRATION

Array = NDArray[np.float64]

VIBRATION: Final = Candidate(OUTSIDE_VIBRATION.name, OUTSIDE_VIBRATION.search.forms[0])

_FEWEST_PERIODS: Final = 5.0
"""In the record; what repeats less often is not told from a drift, or from the motion's laps."""
_STEP: Final = 0.5
"""Of the spacing that a record resolves."""
_LOUDEST: Final = 6
"""Frequencies that are tried."""


@dataclass(frozen=True)
class Spectrum:
    """Waves of the clock at the clear samples of a view.

    Attributes
    ----------
    frequency_hz : (F,) array
    waves : (F, n) complex array
    """

    frequency_hz: Array
    waves: NDArray[np.complex64]

    @classmethod
    def of(cls, view: View) -> Self:
        """All that one recording resolves and its filter passes.

        None of several recordings: nobody knows a vibration's phase from one to the next.
        """
        first, *others = view.stretches
        duration_s = float(first.motion.time_s[-1])
        lowest, highest = _FEWEST_PERIODS / duration_s, 0.0 if others else first.cutoff_hz
        frequency_hz = np.arange(lowest, highest, _STEP / duration_s)
        angle = 2.0 * np.pi * frequency_hz[:, None] * view.of_motion("time_s")[view.clear]
        return cls(frequency_hz, np.exp(-1j * angle).astype(np.complex64))

    def loudest(self, residual: Array) -> Shapes:
        """The frequencies of the highest peaks in what a model leaves at the clear samples (n,)."""
        power = np.abs(self.waves @ residual.astype(np.complex64))
        peaks = np.flatnonzero((power[1:-1] >= power[:-2]) & (power[1:-1] >= power[2:])) + 1
        loudest = peaks[np.argsort(power[peaks])[::-1][:_LOUDEST]]
        return {"frequency": self.frequency_hz[loudest]}
