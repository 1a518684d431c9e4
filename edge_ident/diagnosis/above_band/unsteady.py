"""What the effort holds above the band beyond noise, whatever its shape.

A line that keeps its frequency stands out of the spectrum of a whole recording. A vibration that
changes its frequency or its strength is spread over that spectrum, as is a disturbance without any
line. So the power in each half octave is followed in time, and compared with that of the noise: of
the effort, and of the encoder through the inertia. Mean powers of normal noise are chi-square
distributed (Bendat and Piersol, Random Data, 2010, section 8.5). What lasts counts. What comes now
and then is mostly of the motion, such as the jolt of friction at a reversal.
"""

import math
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Final, Self

import numpy as np
import scipy.special
from numpy.typing import NDArray

from edge_ident.diagnosis.above_band.spectrum import (
    NONZERO,
    WIDEST,
    WideSignals,
    least_squares,
)
from edge_ident.signals.filters import fast_length, lowpass
from edge_ident.signals.metrics import rms

Array = NDArray[np.float64]

_FROM: Final = 0.5
"""Lowest frequency, of the cut-off. Where the motion repeats, the comparison takes for noise what
does not repeat with it."""
_CLEAR: Final = 4.0
"""Power of the acceleration, of that of encoder noise, up to which frequency the encoder shows the
motion."""
_SMOOTHED: Final = 17
"""Ordinates of a spectrum whose mean is its density."""
_MEMORY: Final = 16
"""Samples by which a controller's answer to the position may come early or late."""
_RESOLVED: Final = 4.0
"""Highest frequency, in knees, of the velocity whose sign is the direction of motion."""
_RINGS_S: Final = 0.5
_RINGS: Final = 128
"""Time in which what a reversal excites dies away, and the points of that response."""
_RATIO: Final = 2.0**0.5
"""Ends of a half octave. A vibration that wanders stays in one for a while."""
_PERIODS: Final = 4.0
"""Periods over which a power is averaged: of the geometric mean of the lowest frequency of the half
octave and the lowest of all. What follows a reversal stays apart, and a high one is known well."""
_HANN: Final = 2.0 / 3.0
"""Length of an even average that is as good as one with a Hann window."""
_SELDOM: Final = 0.05
"""Share of the time in which noise alone stands out in one half octave or another."""
_STRUCTURE: Final = 1.2
"""Rms, of that of the noise, below which there is no structure, as in the band: few noises are
quite white."""
_LASTS: Final = 0.5
"""Share of the time in which what lasts stands out of the noise: most of it."""
_STRONG: Final = 0.1
"""Power of a half octave, of that of the strongest, from which the disturbance is in it."""
_KNOWN: Final = 0.3
"""Mean square of the weight from which the power at a time is known."""
_BEYOND: Final = 0.05
"""Share of a disturbance's power beyond either end of its range."""
_TINY: Final = float(np.finfo(float).tiny)


@dataclass(frozen=True)
class Disturbance:
    """What lasts above the band and is no noise.

    Attributes
    ----------
    lowest_hz, highest_hz : float
        Between which nine tenths of its power lie.
    amplitude, std : float
        Of a sinusoid as strong, in the unit of the effort; the standard deviation of its mean.
    share : float
        Rms over the rms of the recorded effort.
    """

    lowest_hz: float
    highest_hz: float
    amplitude: float
    std: float
    share: float


@dataclass(frozen=True)
class _HalfOctave:
    """Half an octave: its ends; at each known time the power beyond the noise, (n,), and of that
    what stands out, nor is the acceleration that the encoder hides; the samples of an average."""

    lowest_hz: float
    highest_hz: float
    power: Array
    excess: Array
    averaged: int


@dataclass(frozen=True)
class Rest:
    """What motion and sinusoids leave of the effort above the band.

    Attributes
    ----------
    left : (2, N) array
        With the acceleration as far as the encoder shows it, and with all of it.
    density : (2, F) array
        Power of the noise in each, per Hz.
    sinusoids : (N,) array
        What they make.
    """

    left: Array
    density: Array
    sinusoids: Array
    weight: Array
    wide: WideSignals

    @classmethod
    def of(cls, wide: WideSignals, waves: Array, inertia: float, density: float) -> Self:
        """Take out what follows linearly from the motion, and sinusoids.

        Parameters
        ----------
        waves : (W, N) array
            Orders and lines that were found before.
        density : float
            Power of the white noise of the effort, per Hz.
        """
        samples = len(wide.effort)
        # at the ends a filter knows one side alone
        ends = min(int(1.0 / (wide.knee_hz * wide.period_s)), samples // 20)
        to_end = np.minimum(np.arange(samples), np.arange(samples)[::-1])
        faded = np.interp(to_end, [ends, 2 * ends - ends / (samples - 2 * ends)], [0.0, 1.0])
        weight = wide.weight * np.sin(0.5 * np.pi * faded) ** 2

        def above(signal: Array) -> Array:
            weighted = weight * signal
            slow = lowpass(weighted, 0.5 * _FROM * wide.cutoff_hz, wide.period_s)
            return np.asarray(weighted - slow)

        shown = _shown(wide, wide.acceleration)
        motion = [*_of_motion(wide, shown), *wide.loads]
        signals = [*motion, *waves]  # together their spectra would be large
        rows = np.fromiter(map(above, signals), (np.float64, samples), len(signals))
        effort = above(wide.effort)
        left = effort - least_squares(rows, effort) @ rows
        beside_motion = left
        if len(waves):
            rows = rows[: len(motion)]
            beside_motion = effort - least_squares(rows, effort) @ rows
        whole = left - inertia * above(wide.acceleration - shown)
        frequency_hz = _frequencies(fast_length(samples), wide.period_s)
        encoder = inertia**2 * _encoder_density(wide, frequency_hz)
        noise = np.stack([_gain(wide, frequency_hz) ** 2 * encoder, encoder])
        noise += min(density, _white(left, weight, wide))
        return cls(np.stack([left, whole]), noise, beside_motion - left, weight, wide)

    @property
    def known(self) -> NDArray[np.bool_]:
        """Samples (N,) of known direction."""
        return np.asarray(self.weight > 0.5)

    @property
    def samples(self) -> int:
        """Number of them."""
        return int(np.count_nonzero(self.known))

    @property
    def missed(self) -> float:
        """Energy that the base model misses above the cut-off, beyond noise."""
        beside_sinusoids = replace(self, left=self.left + self.sinusoids)
        above = (o for o in beside_sinusoids.half_octaves if o.lowest_hz >= self.wide.cutoff_hz)
        return sum(float(np.sum(part.excess)) for part in above)

    def disturbance(self) -> Disturbance | None:
        """What lasts; None where nothing does, or its amplitude is not certain."""
        parts = self.half_octaves
        shown = np.any([part.excess > 0.0 for part in parts], axis=0)
        if not np.size(shown) or np.mean(shown) < _LASTS:
            return None
        means = [float(np.mean(part.excess)) for part in parts]
        strong = [p for p, mean in zip(parts, means, strict=True) if mean > _STRONG * max(means)]
        power = np.sum([part.power for part in strong], axis=0)
        amplitude = math.sqrt(2.0 * max(float(np.mean(power)), 0.0))
        independent = len(power) / (_HANN * max(part.averaged for part in strong))
        std = float(np.std(power)) / math.sqrt(max(independent, 1.0)) / max(amplitude, _TINY)
        share = amplitude / math.sqrt(2.0) / max(rms(self.wide.effort), _TINY)
        if not amplitude > NONZERO * std:
            return None
        return Disturbance(*self._range_hz(strong), amplitude, std, share)

    @cached_property
    def half_octaves(self) -> list[_HalfOctave]:
        """All up to the highest frequency.

        Below the cut-off, encoder noise hides little of the acceleration. There what the account
        with all of it does not miss is of the motion, too.
        """
        lowest_hz, highest_hz = _FROM * self.wide.cutoff_hz, WIDEST / self.wide.period_s
        count = math.ceil(math.log(highest_hz / lowest_hz, _RATIO))
        parts = []
        for k in range(count):
            low, high = lowest_hz * _RATIO**k, min(lowest_hz * _RATIO ** (k + 1), highest_hz)
            periods_s = _PERIODS / math.sqrt(low * lowest_hz)
            averaged = 2 * int(0.5 * periods_s / self.wide.period_s) + 1
            power, noise = self._power(low, high, averaged)
            free = 2.0 * (high - low) * _HANN * averaged * self.wide.period_s
            chance = scipy.special.chdtri(free, _SELDOM / count) / free
            limit = _STRUCTURE**2 * chance * noise
            beyond = (power - noise)[:, self.known]
            excess = np.where((power > limit)[:, self.known], beyond, 0.0)
            least = np.min(excess, axis=0) if low < self.wide.cutoff_hz else excess[0]
            parts.append(_HalfOctave(low, high, beyond[0], least, averaged))
        return parts

    def _power(self, low: float, high: float, averaged: int) -> tuple[Array, Array]:
        """Power (2, N) between two frequencies about each time, and that of the noise (2, 1)."""
        count, inside = self.left.shape[1], self._inside(low, high)
        passed = np.fft.irfft(np.where(inside, self._spectrum, 0.0), self._length)[:, :count]
        window = np.hanning(averaged + 2)
        length = fast_length(count + len(window))
        spectrum = np.fft.rfft(np.vstack([passed**2, self.weight**2]), length)
        spectrum *= np.fft.rfft(window / np.sum(window), length)
        middle = len(window) // 2
        mean = np.fft.irfft(spectrum, length)[:, middle : middle + count]
        noise = np.sum(self.density[:, inside], axis=1) / (self._length * self.wide.period_s)
        return mean[:2] / np.maximum(mean[2], _KNOWN), noise[:, None]

    @cached_property
    def _spectrum(self) -> NDArray[np.complex128]:
        return np.fft.rfft(self.left, self._length)

    @property
    def _length(self) -> int:
        """Of the spectra: at least as long as what is left, and quick."""
        return fast_length(self.left.shape[1])

    def _inside(self, low: float, high: float) -> NDArray[np.bool_]:
        frequency_hz = _frequencies(self._length, self.wide.period_s)
        return np.asarray((frequency_hz >= low) & (frequency_hz < high))

    def _range_hz(self, parts: list[_HalfOctave]) -> tuple[float, float]:
        """Frequencies between which most of the power of some half octaves lies."""
        inside = np.any([self._inside(part.lowest_hz, part.highest_hz) for part in parts], axis=0)
        noise = 0.5 * self.density[0] / self.wide.period_s * float(np.sum(self.weight**2))
        power = np.abs(self._spectrum[0]) ** 2 - noise
        grown = np.maximum.accumulate(np.cumsum(power[inside]))
        ends = np.searchsorted(grown, np.array([_BEYOND, 1.0 - _BEYOND]) * grown[-1])
        places = np.flatnonzero(inside)[np.minimum(ends, len(grown) - 1)]
        low, high = (places / (self._length * self.wide.period_s)).tolist()
        return low, high


def _of_motion(wide: WideSignals, shown: Array) -> list[Array]:
    """What a motion makes of an effort, R rows (N,): by inertia, friction and a shift in time, as a
    controller answers the position, and any response to a change of direction, the same after
    each: loop and chain ring."""
    resolved_hz = min(_RESOLVED * wide.knee_hz, WIDEST / wide.period_s)
    direction = np.sign(lowpass(wide.velocity, resolved_hz, wide.period_s))
    jerk = np.gradient(shown, wide.period_s)
    fast = wide.position - lowpass(wide.position, wide.cutoff_hz, wide.period_s)
    answers = np.lib.stride_tricks.sliding_window_view(np.pad(fast, _MEMORY), len(fast))
    step = max(round(_RINGS_S / (_RINGS * wide.period_s)), 1)
    jumps = np.convolve(np.diff(direction, prepend=direction[0]), np.bartlett(2 * step + 1), "same")
    late = np.pad(jumps, ((_RINGS - 1) * step, 0))
    rings = np.lib.stride_tricks.sliding_window_view(late, len(jumps))[::-step]
    velocity, ones = _shown(wide, wide.velocity), np.ones(len(fast))
    return [shown, jerk, velocity, direction, ones, *answers, *rings]


def _white(left: Array, weight: Array, wide: WideSignals) -> float:
    """Power of the white noise in what is left (N,), per Hz: usual at the frequencies above the
    cut-off, whatever some of them hold besides."""
    frequency_hz = _frequencies(len(left), wide.period_s)
    inside = (frequency_hz >= wide.cutoff_hz) & (frequency_hz < WIDEST / wide.period_s)
    power = np.abs(np.fft.rfft(left)[inside]) ** 2
    usual = float(np.median(power)) / math.log(2.0) if len(power) else 0.0
    return 2.0 * wide.period_s * usual / max(float(weight @ weight), _TINY)


# The part of a motion that the encoder shows: all up to the frequency at which its noise is as
# strong, and above that as much less as the noise grows there.


def _shown(wide: WideSignals, signal: Array) -> Array:
    """That part of a signal (N,) that follows from the position."""
    samples = len(signal)
    gain = _gain(wide, _frequencies(2 * samples, wide.period_s))
    spectrum = np.fft.rfft(np.concatenate([signal, signal[::-1]]))
    return np.asarray(np.fft.irfft(gain * spectrum, 2 * samples)[:samples])


def _gain(wide: WideSignals, frequency_hz: Array) -> Array:
    shown_hz = _shown_hz(wide)
    return np.asarray((shown_hz / np.maximum(frequency_hz, shown_hz)) ** 4)


def _shown_hz(wide: WideSignals) -> float:
    """The lowest frequency, from the knee on, at which encoder noise hides the acceleration."""
    samples = len(wide.acceleration)
    taper = np.hanning(samples)
    power = np.abs(np.fft.rfft(taper * wide.acceleration)) ** 2
    density = 2.0 * wide.period_s * power / float(taper @ taper)
    density = np.convolve(density, np.full(_SMOOTHED, 1.0 / _SMOOTHED), "same")
    frequency_hz = _frequencies(samples, wide.period_s)
    hidden = density < _CLEAR * _encoder_density(wide, frequency_hz)
    places = np.flatnonzero(hidden & (frequency_hz > wide.knee_hz))
    return float(frequency_hz[places[0]]) if len(places) else float(frequency_hz[-1])


def _encoder_density(wide: WideSignals, frequency_hz: Array) -> Array:
    """Power of the encoder noise in the acceleration, per Hz, at frequencies (F,)."""
    white = 2.0 * wide.period_s * wide.position_noise**2
    return np.asarray(white * (2.0 * np.pi * frequency_hz) ** 4)


def _frequencies(samples: int, period_s: float) -> Array:
    return np.asarray(np.fft.rfftfreq(samples, period_s), dtype=np.float64)
