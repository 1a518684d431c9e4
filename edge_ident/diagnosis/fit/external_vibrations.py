"""External vibrations: the strongest sinusoids in time in a residual."""

from dataclasses import dataclass, replace
from typing import Final, Self

import numpy as np
from numpy.typing import NDArray

from edge_ident.diagnosis.fit.candidates import Candidate
from edge_ident.diagnosis.fit.library import Grid
from edge_ident.diagnosis.prepare.axis_data import AxisData
from edge_ident.model.external_vibration import EXTERNAL_VIBRATION
from edge_ident.signals.conditioning import SAMPLES_PER_CUTOFF_PERIOD
from edge_ident.signals.motion_lines import driven, motion_lines

Array = NDArray[np.float64]

VIBRATION: Final = Candidate(EXTERNAL_VIBRATION.name, EXTERNAL_VIBRATION.search.forms[0])
"""Competes with the causes, and is none."""

_FEWEST_PERIODS: Final = 5.0
"""Fewest periods in the record: a slower sinusoid looks like a drift or like laps."""
_STEP: Final = 0.5
"""Step of the frequencies, of the resolution of the record."""
_STRONGEST: Final = 6
"""Frequencies that are tried."""


@dataclass(frozen=True)
class Spectrum:
    """Complex exponentials at the valid samples.

    Attributes
    ----------
    frequency_hz : (F,) array
    waves : (F, n) complex array
    of_motion : (F,) array of bool
        Frequencies that the motion itself has: its drive and its friction act there.
    """

    frequency_hz: Array
    waves: NDArray[np.complex64]
    of_motion: NDArray[np.bool_]

    @classmethod
    def of(cls, data: AxisData) -> Self:
        """All frequencies that a single recording resolves, up to half the rate of its samples.

        The filter passes a part of what lies between its cut-off and there, and a spring would take
        its place. There are none for several recordings, because the phase from one to the next is
        unknown.
        """
        first, *others = data.segments
        duration_s = float(first.motion.time_s[-1])
        highest = 0.5 * SAMPLES_PER_CUTOFF_PERIOD * first.cutoff_hz
        lowest = highest if others else _FEWEST_PERIODS / duration_s
        frequency_hz = np.arange(lowest, highest, _STEP / duration_s)
        lines = motion_lines(first.motion.velocity, first.period_s, highest)
        of_motion = driven(frequency_hz, lines, 1.0 / duration_s)
        angle = 2.0 * np.pi * frequency_hz[:, None] * data.of_motion("time_s")[data.valid]
        return cls(frequency_hz, np.exp(-1j * angle).astype(np.complex64), of_motion)

    def at(self, kept: NDArray[np.bool_]) -> "Spectrum":
        """The same at fewer of the samples (n,)."""
        return self if np.all(kept) else replace(self, waves=self.waves[:, kept])

    def strongest(self, residual: Array) -> Grid:
        """Frequencies of the highest peaks of a residual (n,) at the valid samples.

        Those of the motion are left out.
        """
        power = np.abs(self.waves @ residual.astype(np.complex64))
        peaks = np.flatnonzero((power[1:-1] >= power[:-2]) & (power[1:-1] >= power[2:])) + 1
        peaks = peaks[~self.of_motion[peaks]]
        strongest = peaks[np.argsort(power[peaks])[::-1][:_STRONGEST]]
        return {"frequency": self.frequency_hz[strongest]}
