"""External vibrations: the strongest sinusoids in time in a residual."""

from dataclasses import dataclass
from typing import Final, Self

import numpy as np
import scipy.linalg
from numpy.typing import NDArray

from edge_ident.diagnosis.fit.candidates import Candidate
from edge_ident.diagnosis.fit.library import Grid
from edge_ident.diagnosis.prepare.axis_data import AxisData, Segment
from edge_ident.model.motion import cosine_and_sine
from edge_ident.model.rigid_body import EXTERNAL_VIBRATION
from edge_ident.signals.conditioning import SAMPLES_PER_CUTOFF_PERIOD
from edge_ident.signals.filters import driven, motion_lines

Array = NDArray[np.float64]
_Part = tuple[Grid, NDArray[np.complex64], NDArray[np.bool_]]

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
    """Complex exponentials at the valid samples, of one recording after the other.

    Attributes
    ----------
    grid : Grid
        Frequencies (F,), and the recording of each (`edge_ident.model.rigid_body`).
    waves : (F, n) complex array
        Zero outside their recording.
    own : (F,) array of bool
        Frequencies between others that the motion itself does not have: its drive and its friction
        act there.
    """

    grid: Grid
    waves: NDArray[np.complex64]
    own: NDArray[np.bool_]

    @classmethod
    def of(cls, data: AxisData) -> Self:
        """All frequencies that each recording resolves, up to half the rate of its samples.

        The filter passes a part of what lies between its cut-off and there, and a spring would take
        its place.
        """
        grids, waves, own = zip(*map(_kept, data.segments), strict=True)
        grid = {name: np.concatenate([part[name] for part in grids]) for name in grids[0]}
        return cls(grid, scipy.linalg.block_diag(*waves), np.concatenate(own))

    def strongest(self, residual: Array) -> Grid:
        """Frequencies of the highest peaks of a residual (n,) at the valid samples.

        Those of the motion are left out.
        """
        power = np.abs(self.waves @ residual.astype(np.complex64))
        peaks = np.flatnonzero((power[1:-1] >= power[:-2]) & (power[1:-1] >= power[2:])) + 1
        peaks = peaks[self.own[peaks]]
        strongest = peaks[np.argsort(power[peaks])[::-1][:_STRONGEST]]
        return {name: values[strongest] for name, values in self.grid.items()}


def _kept(segment: Segment) -> _Part:
    """What is computed of a recording once, wherever its effort is moved."""
    key = (_of_recording, segment.valid.tobytes())
    if key not in segment.cache:
        segment.cache[key] = _of_recording(segment)
    part: _Part = segment.cache[key]
    return part


def _of_recording(segment: Segment) -> _Part:
    """Frequencies of one recording, their exponentials, and which are not those of its motion."""
    time_s = segment.motion.time_s
    begin_s, end_s = float(time_s[0]), float(time_s[-1])
    duration_s = end_s - begin_s
    highest = 0.5 * SAMPLES_PER_CUTOFF_PERIOD * segment.cutoff_hz
    frequency_hz = np.arange(_FEWEST_PERIODS / duration_s, highest, _STEP / duration_s)
    lines = motion_lines(segment.motion.velocity, segment.period_s, highest)
    own = ~driven(frequency_hz, lines, 1.0 / duration_s)
    own[:1] = own[-1:] = False
    compared_s = time_s[segment.sample_index[segment.valid]]
    angle = -2.0 * np.pi * frequency_hz[:, None] * compared_s
    waves = np.empty(angle.shape, dtype=np.complex64)
    waves.real, waves.imag = cosine_and_sine(angle)
    place = {"begin": begin_s, "end": end_s, "clock": float(segment.motion.clock)}
    grid = {name: np.full(len(frequency_hz), value) for name, value in place.items()}
    return {"frequency": frequency_hz, **grid}, waves, own
