"""External vibrations: the strongest sinusoids in time in a residual."""

from dataclasses import dataclass
from functools import cached_property, partial
from typing import Final, Self

import numpy as np
from numpy.typing import NDArray

from edge_ident.diagnosis.fit.candidates import Candidate
from edge_ident.diagnosis.fit.library import Grid
from edge_ident.diagnosis.prepare.axis_data import AxisData, Segment, once
from edge_ident.model.rigid_body import EXTERNAL_VIBRATION
from edge_ident.signals.conditioning import SAMPLES_PER_CUTOFF_PERIOD
from edge_ident.signals.filters import driven, motion_lines

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
class _Recorded:
    """The Fourier transform of what is compared of one recording; it is zero between the samples.

    Attributes
    ----------
    places : (n,) array of int
        Of the compared samples, on an even grid.
    length : int
        Of that grid, with zeros behind it.
    tried : slice
        Of the frequencies.
    grid : Grid
        These, and the recording (`edge_ident.model.rigid_body`).
    own : (F,) array of bool
        Frequencies between others that the motion itself does not have: its drive and its friction
        act there.
    """

    places: NDArray[np.intp]
    length: int
    tried: slice
    grid: Grid
    own: NDArray[np.bool_]

    @classmethod
    def of(cls, segment: Segment) -> Self:
        """All frequencies that a recording resolves, up to half the rate of its samples.

        The filter passes a part of what lies between its cut-off and there, and a spring would take
        its place.
        """
        begin_s, end_s = segment.motion.time_s[[0, -1]].tolist()
        places = segment.sample_index - segment.sample_index[0]
        step = max(int(np.gcd.reduce(places)), 1)
        step_s, duration_s = step * segment.period_s, end_s - begin_s
        length = round(duration_s / (_STEP * step_s))
        every = np.fft.rfftfreq(length, step_s)
        highest_hz = 0.5 * SAMPLES_PER_CUTOFF_PERIOD * segment.cutoff_hz
        first, last = np.searchsorted(every, [_FEWEST_PERIODS / duration_s, highest_hz]).tolist()
        frequency_hz = np.asarray(every[first:last], dtype=np.float64)
        lines = motion_lines(segment.motion.velocity, segment.period_s, highest_hz)
        own = ~driven(frequency_hz, lines, 1.0 / duration_s)
        own[:1] = own[-1:] = False
        grid = {"begin": begin_s, "end": end_s, "clock": float(segment.motion.clock)}
        grid = {name: np.full(len(frequency_hz), value) for name, value in grid.items()}
        grid = {"frequency": frequency_hz, **grid}
        return cls(places // step, length, slice(first, last), grid, own)

    def power(self, values: Array) -> Array:
        """Magnitude (F,) of the spectrum of compared samples (n,)."""
        even = np.zeros(self.length)
        even[self.places] = values
        return np.asarray(np.abs(np.fft.rfft(even))[self.tried])


@dataclass(frozen=True)
class Spectrum:
    """Frequencies at which something may shake an axis, of one recording after the other."""

    data: AxisData
    recorded: tuple[_Recorded, ...]

    @classmethod
    def of(cls, data: AxisData) -> Self:
        """What is computed of a recording once, wherever its effort is moved."""
        recorded = (once(s.cache, _Recorded, partial(_Recorded.of, s)) for s in data.segments)
        return cls(data, tuple(recorded))

    @cached_property
    def grid(self) -> Grid:
        """Frequencies (F,), and the recording of each."""
        grids = [part.grid for part in self.recorded]
        return {name: np.concatenate([grid[name] for grid in grids]) for name in grids[0]}

    def strongest(self, residual: Array) -> Grid:
        """Frequencies of the highest peaks of a residual (n,) at the valid samples.

        Those of the motion are left out.
        """
        whole = np.zeros(len(self.data.valid))
        whole[self.data.valid] = residual
        each = zip(self.recorded, self.data.by_segment(whole), strict=True)
        power = np.concatenate([part.power(values) for part, values in each])
        own = np.concatenate([part.own for part in self.recorded])
        peaks = np.flatnonzero((power[1:-1] >= power[:-2]) & (power[1:-1] >= power[2:])) + 1
        peaks = peaks[own[peaks]]
        strongest = peaks[np.argsort(power[peaks])[::-1][:_STRONGEST]]
        return {name: values[strongest] for name, values in self.grid.items()}
