"""One axis of a recording at full bandwidth, and the filters that look above the comparison."""

from dataclasses import dataclass
from functools import cached_property
from typing import Final, Self

import numpy as np
import scipy.fft
from numpy.polynomial.chebyshev import chebvander
from numpy.typing import NDArray

from edge_ident.diagnosis.above_band.spectral_lines import CELLS
from edge_ident.diagnosis.prepare.masks import direction_weight
from edge_ident.diagnosis.prepare.segment import Segment
from edge_ident.estimation.compensation import compensate_effects
from edge_ident.model.model import Model
from edge_ident.signals.filters import differentiate, lowpass, magnitude, whitening
from edge_ident.signals.recording import Recording
from edge_ident.signals.time_stamps import EvenGrid

Array = NDArray[np.float64]

WIDEST: Final = 0.4
"""Highest frequency, of the sampling rate: above it filters and interpolation distort."""
_ROUNDED: Final = 2.0 / np.pi * np.sqrt(12.0)
"""Amplitude that the encoder's rounding can give a sinusoid of the position, in standard deviations
of its noise: twice the first harmonic of a sawtooth, because the controller answers it."""
_FROM: Final = 0.5
"""Of the cut-off. What the comparison sees, but nearly no longer resolves, is looked at as well."""
_REPEATS: Final = 0.99
"""Correlation of the velocity with itself from which the motion repeats."""
_SHORTEST_LAP: Final = 0.02
_LONGEST_LAP: Final = 0.75
"""Of the record."""
_POWERS: Final = 2
"""Of the position, that a load along the stroke is made of: what it is at both ends, where a motion
to and fro turns."""
_SPEEDS: Final = 48
"""Classes of speed in which the filter's response to a wave of position is computed."""
_TINY: Final = float(np.finfo(float).tiny)


@dataclass(frozen=True)
class WideSignals:
    """One axis of one recording, N samples.

    Attributes
    ----------
    time_s, position, velocity, acceleration, effort : (N,) arrays
        Time from the first sample; filtered alike, at two fifths of the sampling rate.
    weight : (N,) array
        0 where the direction of motion is unknown, otherwise 1.
    period_s, cutoff_hz, knee_hz : float
        The last two of the comparison, up to where it hardly attenuates: a sinusoid that it
        attenuates is looked for here.
    """

    time_s: Array
    position: Array
    velocity: Array
    acceleration: Array
    effort: Array
    weight: Array
    period_s: float
    cutoff_hz: float
    knee_hz: float
    position_noise: float

    @classmethod
    def of(
        cls, recording: Recording, name: str, segment: Segment, known: Model | None = None
    ) -> Self:
        """The signals of a recording, in step as the recording states it, less known effects.

        A shift that was fitted to the band holds what a controller makes of it there.
        """
        period_s = segment.raw_period_s
        grid = EvenGrid.of(recording.time_s)
        raw = grid.resampled(recording.axes[name].position)
        widest_hz = WIDEST / period_s
        position, velocity, acceleration = differentiate(raw, widest_hz, period_s)
        delay_s = recording.effort_shift_s
        effort = lowpass(segment.raw_effort, widest_hz, period_s, delay_s=delay_s)
        if known is not None:
            added = compensate_effects(recording, name, known).effects_unfiltered
            effort = effort - lowpass(added, widest_hz, period_s)
        return cls(
            time_s=grid.time_s - grid.time_s[0],
            position=position,
            velocity=velocity,
            acceleration=acceleration,
            effort=effort,
            weight=direction_weight(segment.reversing, segment.band.balanced_hz, period_s),
            period_s=period_s,
            cutoff_hz=segment.band.balanced_hz,
            knee_hz=segment.band.knee_hz,
            position_noise=segment.position_noise,
        )

    @property
    def base(self) -> Array:
        """Acceleration, velocity, direction of motion and one, (4, N)."""
        direction = np.sign(self.velocity)
        ones = np.ones_like(direction)
        return np.stack([self.acceleration, self.velocity, direction, ones])

    @cached_property
    def friction_above(self) -> Array:
        """Velocity, direction of motion and one, (3, N), above the cut-off."""
        return self.above(self.base[1:])

    @cached_property
    def loads(self) -> Array:
        """Powers of the position (D, N), of which a load along the stroke is made; none (0, N)
        where no sample is left out.

        A weight or a spring goes on through a reversal. Where the weights leave it out there, what
        lies above the cut-off looks like waves of the position.
        """
        if np.all(self.weight == 1.0):
            return np.empty((0, len(self.position)))
        low, high = float(np.min(self.position)), float(np.max(self.position))
        place = (2.0 * self.position - low - high) / max(high - low, _TINY)
        return np.asarray(chebvander(place, _POWERS)[:, 1:].T)

    @cached_property
    def loads_above(self) -> Array:
        """The same above the cut-off."""
        return self.above(self.loads)

    @cached_property
    def white_loads_above(self) -> Array:
        """The same, filtered so that noise is white."""
        return self.white_above(self.loads)

    @cached_property
    def clean_acceleration(self) -> Array:
        """The acceleration without the frequencies at which encoder noise hides it, (N,)."""
        spectrum, _, gain = self._weighting
        samples = len(self.acceleration)
        return np.asarray(np.fft.irfft(spectrum * gain, 2 * samples)[:samples])

    def known_motion(self, rates: Array) -> Array:
        """Share (F,) of the acceleration that is left at rates (F,) in rad/s."""
        _, known, gain = self._weighting
        return np.interp(rates, known, gain)

    @cached_property
    def _weighting(self) -> tuple[NDArray[np.complex128], Array, Array]:
        """Spectrum of the acceleration, its rates in rad/s, and what is left there.

        Below the knee it is all, and above it where the axis moves by more than the rounding.
        """
        padded = np.concatenate([self.acceleration, self.acceleration[::-1]])
        spectrum = np.fft.rfft(padded)
        frequency = np.asarray(np.fft.rfftfreq(len(padded), self.period_s), dtype=np.float64)
        rate = 2.0 * np.pi * frequency
        amplitude = 2.0 / len(padded) * np.abs(spectrum)
        rounded = _ROUNDED * self.position_noise * rate**2
        gain = np.maximum(whitening(frequency / self.knee_hz) ** 2, amplitude > rounded)
        return spectrum, rate, np.asarray(gain)

    @property
    def resolution(self) -> float:
        """Step of an encoder that has this noise."""
        return float(np.sqrt(12.0)) * self.position_noise

    @cached_property
    def lap_s(self) -> float | None:
        """Time after which the velocity repeats; None where it does not."""
        velocity = lowpass(self.velocity, self.cutoff_hz, self.period_s)
        velocity = velocity - np.mean(velocity)
        samples = len(velocity)
        length = scipy.fft.next_fast_len(2 * samples, real=True)
        power = np.abs(np.fft.rfft(velocity, length)) ** 2
        overlap = np.arange(samples, 0, -1)
        alike = np.fft.irfft(power, length)[:samples] / overlap
        lags = np.arange(int(_SHORTEST_LAP * samples), int(_LONGEST_LAP * samples))
        peaks = lags[(alike[lags] > alike[lags - 1]) & (alike[lags] >= alike[lags + 1])]
        for lag in peaks[alike[peaks] > _REPEATS * alike[0]]:
            first, second = velocity[:-lag], velocity[lag:]
            if np.sum((first - second) ** 2) < 2.0 * (1.0 - _REPEATS) * np.sum(first**2):
                before, here, after = alike[lag - 1 : lag + 2]
                shift = 0.5 * (before - after) / (before - 2.0 * here + after)
                return float((lag + shift) * self.period_s)
        return None

    @cached_property
    def leakage(self) -> float:
        """Largest power of a line beside it, through the gaps of the weight, over that of the
        line."""
        gaps = np.abs(np.fft.rfft(self.weight**2)) ** 2
        return float(np.max(gaps[1:CELLS]) / max(gaps[0], _TINY))

    @cached_property
    def halves(self) -> tuple[slice, slice]:
        """The record in two parts with as many samples of known direction each."""
        known = np.cumsum(self.weight)
        middle = int(np.searchsorted(known, 0.5 * np.sum(self.weight)))
        return slice(0, middle), slice(middle, None)

    @cached_property
    def usual_speeds(self) -> tuple[float, float]:
        """Speeds that one sample in twenty does not reach, and exceeds."""
        speed = np.abs(self.velocity[self.weight > 0.5])
        low, high = np.quantile(speed, [0.05, 0.95])
        return float(low), float(high)

    def whitened(self, signals: Array) -> Array:
        """Signals (..., N), weighted and filtered so that the noise of effort and encoder together
        is white."""
        return self.weight * self.white(signals)

    def white(self, signals: Array) -> Array:
        """The same, not weighted."""
        return lowpass(signals, WIDEST / self.period_s, self.period_s, knee_hz=self.knee_hz)

    def white_above(self, signals: Array) -> Array:
        """The white signals (..., N), weighted, without what lies below the cut-off."""
        return self.above(self.white(signals))

    def above(self, signals: Array) -> Array:
        """Signals (..., N), weighted, without what lies below the cut-off."""
        weighted = self.weight * signals
        return np.asarray(weighted - lowpass(weighted, _FROM * self.cutoff_hz, self.period_s))

    def energy_above(self, rates: Array, *, white: bool) -> Array:
        """Share (F,) of the energy above the cut-off, of waves of position (rad per its unit).

        With `white`, of what whitening leaves of them.
        """
        speed = np.abs(self.velocity)
        edges = np.linspace(0.0, float(np.max(speed)), _SPEEDS + 1)
        weight = np.histogram(speed, edges, weights=self.weight**2)[0]
        centre = 0.5 * (edges[1:] + edges[:-1])
        wave_hz = np.outer(rates, centre) / (2.0 * np.pi)
        passed = 1.0 - magnitude(wave_hz / (_FROM * self.cutoff_hz))
        if white:
            passed = passed * whitening(wave_hz / self.knee_hz)
        return np.asarray(passed**2 @ weight / max(float(np.sum(weight)), 1.0))

    def waves(self, along: Array, rate: float) -> Array:
        """Cosine and sine (2, N) of time or position."""
        return np.stack([np.cos(rate * along), np.sin(rate * along)])
