"""What the effort holds above the band beyond noise, whatever its shape.

A line that keeps its frequency stands out of the spectrum of a whole recording. A vibration that
changes its frequency or its strength is spread over that spectrum, as is a disturbance without any
line. So the power in each half octave is followed in time, and compared with that of the noise: of
the effort, and of the encoder through the inertia. Mean powers of normal noise are chi-square
distributed (Bendat and Piersol, Random Data, 2010, section 8.5). What lasts counts. What comes now
and then is mostly of the motion, such as the jolt of friction at a reversal.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final, NamedTuple, Self

import numpy as np
import scipy.fft
import scipy.stats
from numpy.typing import NDArray

from edge_ident.diagnosis.above_band.spectrum import (
    NONZERO,
    WIDEST,
    WideSignals,
    least_squares,
)
from edge_ident.signals.filters import lowpass
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


def lasting_disturbance(
    wide: WideSignals, waves: Array, inertia: float, density: float
) -> Disturbance | None:
    """What lasts above the band of one recording.

    None where nothing does, or its amplitude is not certain.

    Parameters
    ----------
    wide : WideSignals
    waves : (W, N) array
        Orders and lines that were found before; they are taken out.
    inertia : float
    density : float
        Power of the white noise of the effort, per Hz.
    """
    seen = _Seen.of(wide, waves, inertia, density)
    parts = list(seen.half_octaves())
    shown = np.any([part.excess > 0.0 for part in parts], axis=0)[seen.known]
    if not len(shown) or np.mean(shown) < _LASTS:
        return None
    means = [float(np.mean(part.excess[seen.known])) for part in parts]
    strong = [part for part, mean in zip(parts, means, strict=True) if mean > _STRONG * max(means)]
    power = np.sum([part.power - part.noise for part in strong], axis=0)[seen.known]
    amplitude = math.sqrt(2.0 * max(float(np.mean(power)), 0.0))
    independent = len(power) / (_HANN * max(part.samples for part in strong))
    std = float(np.std(power)) / math.sqrt(max(independent, 1.0)) / max(amplitude, _TINY)
    share = amplitude / math.sqrt(2.0) / max(rms(wide.effort), _TINY)
    if not amplitude > NONZERO * std:
        return None
    return Disturbance(*seen.range_hz(strong), amplitude, std, share)


class Missed(NamedTuple):
    """What is missed in a recording: its mean square, and the number of samples."""

    mean_square: float
    samples: int


def missed_above(wide: WideSignals, inertia: float, density: float) -> Missed:
    """What the base model misses above the cut-off of one recording, beyond noise."""
    seen = _Seen.of(wide, np.empty((0, len(wide.effort))), inertia, density)
    above = [part for part in seen.half_octaves() if part.lowest_hz >= wide.cutoff_hz]
    samples = int(np.count_nonzero(seen.known))
    total = sum(float(np.sum(part.excess[seen.known])) for part in above)
    return Missed(total / max(samples, 1), samples)


def together(recordings: list[Missed]) -> float:
    """Rms of what is missed in all recordings."""
    samples = sum(one.samples for one in recordings)
    energy = sum(one.mean_square * one.samples for one in recordings)
    return math.sqrt(energy / max(samples, 1))


@dataclass(frozen=True)
class _HalfOctave:
    """Half an octave.

    Attributes
    ----------
    lowest_hz, highest_hz : float
    power : (N,) array
        About each time.
    noise : float
        What that of noise is.
    excess : (N,) array
        What of the power no noise explains, nor the acceleration that the encoder hides.
    samples : int
        Over which the power is averaged.
    """

    lowest_hz: float
    highest_hz: float
    power: Array
    noise: float
    excess: Array
    samples: int


@dataclass(frozen=True)
class _Seen:
    """What the motion leaves of the effort above the band.

    Attributes
    ----------
    left : (2, N) array
        With the acceleration as far as the encoder shows it, and with all of it.
    density : (2, F) array
        Power of the noise in each, per Hz.
    weight : (N,) array
    period_s, lowest_hz, cutoff_hz : float
    """

    left: Array
    density: Array
    weight: Array
    period_s: float
    lowest_hz: float
    cutoff_hz: float

    @classmethod
    def of(cls, wide: WideSignals, waves: Array, inertia: float, density: float) -> Self:
        weight = wide.weight * _inside(wide)
        lowest_hz = _FROM * wide.cutoff_hz
        frequency_hz = _frequencies(len(weight), wide.period_s)
        encoder = inertia**2 * _encoder_density(wide, frequency_hz)
        gain = _gain(wide, frequency_hz)

        def above(signals: Array) -> Array:
            weighted = weight * signals
            return weighted - lowpass(weighted, 0.5 * lowest_hz, wide.period_s)

        shown = _shown(wide, wide.acceleration)
        rows = above(np.concatenate([_of_motion(wide, shown), wide.loads, waves]))
        effort = above(wide.effort)
        left = effort - least_squares(rows, effort) @ rows
        whole = left - inertia * above(wide.acceleration - shown)
        white = min(density, _white(left, weight, wide))
        noise = white + np.stack([gain**2 * encoder, encoder])
        return cls(np.stack([left, whole]), noise, weight, wide.period_s, lowest_hz, wide.cutoff_hz)

    @property
    def known(self) -> NDArray[np.bool_]:
        """Samples (N,) of known direction."""
        return np.asarray(self.weight > 0.5)

    def half_octaves(self) -> Iterator[_HalfOctave]:
        """All up to the highest frequency.

        Below the cut-off, encoder noise hides little of the acceleration. There what the account
        with all of it does not miss is of the motion, too.
        """
        low, highest_hz = self.lowest_hz, WIDEST / self.period_s
        count = math.ceil(math.log(highest_hz / low, _RATIO))
        while low < highest_hz:
            high = min(_RATIO * low, highest_hz)
            followed_hz = math.sqrt(low * self.lowest_hz)
            samples = 2 * int(0.5 * _PERIODS / (followed_hz * self.period_s)) + 1
            power, noise = self._power(low, high, samples)
            free = 2.0 * (high - low) * _HANN * samples * self.period_s
            chance = scipy.stats.chi2.isf(_SELDOM / count, free) / free
            limit = _STRUCTURE**2 * chance * noise[:, None]
            excess = np.where(power > limit, power - noise[:, None], 0.0)
            least = np.min(excess, axis=0) if low < self.cutoff_hz else excess[0]
            yield _HalfOctave(low, high, power[0], float(noise[0]), least, samples)
            low *= _RATIO

    def _power(self, low: float, high: float, samples: int) -> tuple[Array, Array]:
        """Power (2, N) between two frequencies about each time, and that of the noise (2,)."""
        count = self.left.shape[1]
        frequency_hz = _frequencies(count, self.period_s)
        inside = (frequency_hz >= low) & (frequency_hz < high)
        passed = np.fft.irfft(np.where(inside, np.fft.rfft(self.left), 0.0), count)
        weight = np.maximum(_averaged(self.weight**2, samples), _KNOWN)
        noise = np.sum(self.density[:, inside], axis=1) / (count * self.period_s)
        return _averaged(passed**2, samples) / weight, noise

    def range_hz(self, parts: list[_HalfOctave]) -> tuple[float, float]:
        """Frequencies between which most of the power of some half octaves lies."""
        frequency_hz = _frequencies(self.left.shape[1], self.period_s)
        inside = np.any(
            [(frequency_hz >= o.lowest_hz) & (frequency_hz < o.highest_hz) for o in parts], axis=0
        )
        power = np.abs(np.fft.rfft(self.left[0])) ** 2
        noise = 0.5 * self.density[0] / self.period_s * float(np.sum(self.weight**2))
        grown = np.maximum.accumulate(np.cumsum((power - noise)[inside]))
        ends = np.searchsorted(grown, np.array([_BEYOND, 1.0 - _BEYOND]) * grown[-1])
        low, high = frequency_hz[inside][np.minimum(ends, len(grown) - 1)].tolist()
        return low, high


def _of_motion(wide: WideSignals, shown: Array) -> Array:
    """What a motion makes of an effort (R, N): by inertia, friction and a shift in time, and as a
    controller answers the position."""
    velocity = _shown(wide, wide.velocity)
    resolved_hz = min(_RESOLVED * wide.knee_hz, WIDEST / wide.period_s)
    direction = np.sign(lowpass(wide.velocity, resolved_hz, wide.period_s))
    jerk = np.gradient(shown, wide.period_s)
    fast = wide.position - lowpass(wide.position, wide.cutoff_hz, wide.period_s)
    answers = np.lib.stride_tricks.sliding_window_view(np.pad(fast, _MEMORY), len(fast))
    ones = np.ones(len(fast))
    rings = _after_reversals(direction, wide.period_s)
    return np.concatenate([np.stack([shown, jerk, velocity, direction, ones]), answers, rings])


def _after_reversals(direction: Array, period_s: float) -> Array:
    """Any response (R, N) to a change of direction, the same after each: loop and chain ring."""
    step = max(round(_RINGS_S / (_RINGS * period_s)), 1)
    jumps = np.convolve(np.diff(direction, prepend=direction[0]), np.bartlett(2 * step + 1), "same")
    return np.stack([np.pad(jumps, (k * step, 0))[: len(jumps)] for k in range(_RINGS)])


def _white(left: Array, weight: Array, wide: WideSignals) -> float:
    """Power of the white noise in what is left (N,), per Hz: usual at the frequencies above the
    cut-off, whatever some of them hold besides."""
    frequency_hz = _frequencies(len(left), wide.period_s)
    inside = (frequency_hz >= wide.cutoff_hz) & (frequency_hz < WIDEST / wide.period_s)
    power = np.abs(np.fft.rfft(left)[inside]) ** 2
    usual = float(np.median(power)) / math.log(2.0) if len(power) else 0.0
    return 2.0 * wide.period_s * usual / max(float(weight @ weight), _TINY)


def _inside(wide: WideSignals) -> Array:
    """Weight (N,) that fades at the ends, where a filter knows one side alone."""
    samples = len(wide.effort)
    settled = min(int(1.0 / (wide.knee_hz * wide.period_s)), samples // 20)
    count = np.arange(samples)
    from_end = np.minimum(count, count[::-1])
    rising = np.clip((from_end - settled) / max(settled, 1), 0.0, 1.0)
    return np.asarray(np.sin(0.5 * np.pi * rising) ** 2)


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


def _averaged(signals: Array, samples: int) -> Array:
    """Signals (..., N), averaged with a Hann window of so many samples."""
    window = np.hanning(samples + 2)[1:-1]
    count = signals.shape[-1]
    length = scipy.fft.next_fast_len(count + samples, real=True)
    spectrum = np.fft.rfft(signals, length) * np.fft.rfft(window / np.sum(window), length)
    first = samples // 2
    return np.asarray(np.fft.irfft(spectrum, length)[..., first : first + count])
