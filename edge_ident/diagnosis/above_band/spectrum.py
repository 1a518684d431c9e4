"""Sinusoids that stand out of the effort in its whole bandwidth, and what accounts for them."""

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Final, Self

import numpy as np
import scipy.ndimage
from numpy.polynomial.chebyshev import chebvander
from numpy.typing import NDArray

from edge_ident.diagnosis.prepare.axis_data import Segment
from edge_ident.diagnosis.prepare.bandwidth import direction_weight
from edge_ident.estimation.compensation import compensate_effects
from edge_ident.model.model import Model
from edge_ident.signals.filters import differentiate, fast_length, lowpass, magnitude, whitening
from edge_ident.signals.recording import Recording
from edge_ident.signals.time_stamps import EvenGrid

Array = NDArray[np.float64]


# Periodograms over time and over position, and the peaks that noise does not reach.
#
# The ordinates of a periodogram of noise are exponentially distributed about the local power
# density (Brillinger 1981, Time Series, theorem 5.2.6). So the highest of n ordinates exceeds
# ln(n/p) times that density with probability p. The density is measured beside the peak, by a
# running median.

FALSE_ALARM: Final = 1e-3
"""Probability that noise alone makes a line anywhere in a spectrum."""
NONZERO: Final = 3.0
"""Standard deviations of a certain amplitude."""
_OVERSAMPLED: Final = 2
"""Ordinates per resolution cell."""
CELLS: Final = 48
"""Resolution cells in a block of the running median. Its density is then known to 20 %."""
REPEATED: Final = 4.0
"""Factor on the noise level at harmonics of the motion: what repeats with it is not exponentially
distributed, and a second lap is no second look."""
_FEWEST_HARMONICS: Final = 24
"""Harmonics of the motion among which their level is measured."""
_BINS_PER_WAVE: Final = 8
"""Bins of position in the shortest wave: they lose 3 % of its amplitude."""
_REFINED: Final = 81
"""Places about an ordinate at which a peak is computed."""
_PARTS: Final = 256
"""Parts of the record over which the phase of a peak is followed."""
_TINY: Final = float(np.finfo(float).tiny)


@dataclass(frozen=True)
class Periodogram:
    """Power of the sinusoids in a signal.

    Attributes
    ----------
    rate : (F,) array
        Angular: rad/s over time, rad per unit of position over position.
    power : (F,) array
        Energy that a sinusoid of that rate explains.
    level : (F,) array
        Mean power of the noise about it.
    cell : float
        Resolution of the rate.
    """

    rate: Array
    power: Array
    level: Array
    cell: float

    @property
    def prominence(self) -> Array:
        """Power over the highest that noise reaches, (F,); a line exceeds one."""
        highest = np.log(max(len(self.rate), 1) / FALSE_ALARM)
        return np.asarray(self.power / (np.maximum(self.level, _TINY) * highest))

    def beside_harmonics(self, fundamental: float) -> "Periodogram":
        """The same with the noise at harmonics of a rate measured at harmonics alone.

        What repeats with the motion is no line beside it. Often half of the harmonics are
        empty, so their upper quartile is taken.
        """
        step = self.rate[1] - self.rate[0]
        numbers = np.arange(np.ceil(self.rate[0] / fundamental), self.rate[-1] // fundamental + 1)
        at = np.clip(np.round((numbers * fundamental - self.rate[0]) / step), 0, len(self.rate) - 1)
        if not len(at):
            return self
        half = max(int(np.ceil(CELLS * self.cell / fundamental / 2.0)), _FEWEST_HARMONICS // 2)
        level = scipy.ndimage.percentile_filter(self.power[at.astype(np.intp)], 75, 2 * half + 1)
        level = level / np.log(4.0)
        off = np.abs(self.rate / fundamental - np.round(self.rate / fundamental)) * fundamental
        on = np.interp(self.rate, numbers * fundamental, level)
        raised = np.where(off < self.cell, REPEATED * np.maximum(self.level, on), self.level)
        return replace(self, level=raised)

    def rate_std(self, power: float, level: float) -> float:
        """Standard deviation of the rate of a peak: Cramér-Rao (Rife and Boorstyn, IEEE Trans.
        Information Theory 20 (1974) 591)."""
        return float(np.sqrt(1.5 * level / power) * self.cell / np.pi)


def over_time(
    signal: Array, weight: Array, period_s: float, lowest: float, highest: float
) -> Periodogram:
    """Periodogram over time.

    Parameters
    ----------
    signal, weight : (N,) arrays
        The weight is that of the samples in the signal: a sinusoid in it is multiplied by it.
    lowest, highest : float
        Range of the rate, rad/s.
    """
    cell = 2.0 * np.pi / (period_s * len(signal))
    length = fast_length(_OVERSAMPLED * len(signal))
    spectrum = np.fft.rfft(weight * signal, length)
    rate = 2.0 * np.pi / (period_s * length) * np.arange(len(spectrum), dtype=np.float64)
    power = np.abs(spectrum) ** 2 / max(float(weight @ weight), _TINY)
    inside = (rate >= lowest) & (rate <= highest)
    found = _of(rate[inside], power[inside], cell)
    # noise that falls steeply is no line where it is highest
    return replace(found, level=np.maximum(found.level, local_level(found.power, CELLS // 2)))


def over_position(signal: Array, position: Array, energy_at: tuple[Array, Array]) -> Periodogram:
    """Periodogram over position, of a signal that need not move evenly or one way.

    Parameters
    ----------
    signal : (N,) array
        Multiplied by the conjugate of what multiplies a sinusoid in it.
    energy_at : two (F,) arrays
        Rates, and the energy of a sinusoid of amplitude one at them; zero where none is searched.
    """
    highest = float(energy_at[0][-1])
    start, travel = float(np.min(position)), max(float(np.ptp(position)), _TINY)
    cell = 2.0 * np.pi / travel
    bins = int(np.ceil(_BINS_PER_WAVE * highest / cell)) + 1
    index = np.minimum(((position - start) * (bins / travel)).astype(np.intp), bins - 1)
    binned = np.bincount(index, signal, bins)
    length = fast_length(_OVERSAMPLED * bins)
    spectrum = np.fft.rfft(binned, length)
    rate = cell * bins / length * np.arange(len(spectrum))
    energy = np.interp(rate, *energy_at, left=0.0, right=0.0)
    inside = energy > 0.0
    power = np.abs(spectrum[inside]) ** 2 / energy[inside]
    return _of(rate[inside], power, cell)


def local_level(power: Array, cells: int = CELLS) -> Array:
    """Mean of exponentially distributed ordinates (F,), by a running median over so many cells."""
    half = cells * _OVERSAMPLED // 2
    blocks = len(power) // half
    if blocks < 2:
        return np.full(len(power), np.median(power) / np.log(2.0) if len(power) else 0.0)
    whole = power[: blocks * half].reshape(blocks, half)
    medians = np.median(np.hstack([whole[:-1], whole[1:]]), axis=1) / np.log(2.0)
    centres = half * np.arange(1, blocks)
    return np.asarray(np.interp(np.arange(len(power)), centres, medians))


def refined(signal: Array, along: Array, rate: float, cell: float) -> float:
    """The rate (rad per unit of `along`) of a peak, between the ordinates beside it."""
    start, length = float(np.min(along)), max(float(np.ptp(along)), _TINY)
    index = ((along - start) * (_PARTS / length)).astype(np.intp)
    turned = signal * np.exp(-1j * rate * along)
    parts = np.bincount(index, turned.real) + 1j * np.bincount(index, turned.imag)
    centre = length / _PARTS * np.arange(len(parts))
    off = cell / _OVERSAMPLED * np.linspace(-1.0, 1.0, _REFINED)
    power = np.abs(np.exp(-1j * np.outer(off, centre)) @ parts)
    return rate + float(off[np.argmax(power)])


def _of(rate: Array, power: Array, cell: float) -> Periodogram:
    return Periodogram(rate, power, local_level(power), cell)


# One axis of a recording at full bandwidth, and the filters that look above the comparison.


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
        length = fast_length(2 * samples)
        power = np.abs(np.fft.rfft(velocity, length)) ** 2
        alike = np.fft.irfft(power, length)[:samples] / np.arange(samples, 0, -1)
        highest = scipy.ndimage.maximum_filter1d(alike, 3)
        peaks = np.flatnonzero((alike == highest) & (alike >= _REPEATS * alike[0]))
        for lag in peaks[(peaks >= _SHORTEST_LAP * samples) & (peaks < _LONGEST_LAP * samples)]:
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
        found = self.weight * signals
        found -= lowpass(found, _FROM * self.cutoff_hz, self.period_s)
        return found

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


# The effort above the band without what the motion explains, and the lines that stand out of it.
#
# Where encoder noise hides the acceleration, nobody knows what the inertia takes of the effort. So
# there are three accounts of it: with the acceleration where noise does not hide it, with all of
# it, and with none.


_FEWEST_PERIODS: Final = 5.0
"""Fewest periods of a line in the record."""
_CLIPPED: Final = 5.0
"""Robust standard deviations at which a residual is clipped: a sinusoid does not reach them."""
_MEDIAN_OF_NORMAL: Final = 0.6745
_HIDDEN: Final = 0.5
"""Share of the acceleration that is left at a frequency, below which encoder noise hides it."""
_LEAKED: Final = 0.5
"""Share of the noise about a line that stays without it, below which the line made most of it."""


def least_squares(rows: Array, signal: Array) -> Array:
    """Amplitudes (R,) with which rows (R, N) make up a signal (N,)."""
    gram, moment = rows @ rows.T, rows @ signal
    length = np.sqrt(np.maximum(np.diag(gram), _TINY))
    scaled = gram / np.outer(length, length)
    return np.asarray(np.linalg.lstsq(scaled, moment / length, rcond=1e-12)[0] / length)


def inertia(wide: WideSignals, waves: Array) -> float:
    """Inertia by generalized least squares over the whole band, beside waves (W, N)."""
    rows = wide.whitened(np.concatenate([wide.base, waves]))
    return max(float(least_squares(rows, wide.whitened(wide.effort))[0]), 0.0)


def accounts(wide: WideSignals, mass: float, orders: Array) -> Array:
    """Effort above the band without inertia and friction, clipped, (3, N).

    First with the acceleration weighted as by Wiener: the noise that it adds stays below that of
    the effort at every frequency. Then with the whole acceleration, and with none: what weighting
    leaves out of a motion of many frequencies, and the noise that it lets through, look like lines.

    Jolts that the encoder does not resolve are larger than a line that lasts, and would take its
    place in a fit. So all is clipped but the waves of orders (W, N), which may act at high speed
    alone.
    """
    accelerations = np.stack(
        [wide.clean_acceleration, wide.acceleration, np.zeros(len(wide.effort))]
    )
    slow = np.concatenate([wide.friction_above, wide.loads_above])
    above = left_beside(slow, wide.above(wide.effort - mass * accelerations))
    rows = wide.above(orders)
    known = np.stack([least_squares(rows, one) @ rows for one in above])
    return known + np.stack([clipped(wide, one) for one in above - known])


def left_beside(rows: Array, above: Array) -> Array:
    """Efforts above the band (..., N) without what rows (R, N) account for."""
    flat = above.reshape(-1, above.shape[-1])
    left = np.stack([one - least_squares(rows, one) @ rows for one in flat])
    return left.reshape(above.shape)


def clipped(wide: WideSignals, left: Array) -> Array:
    """A residual (N,) without its impacts, which are no lines."""
    seen = np.abs(left[wide.weight > 0.5])
    most = _CLIPPED / _MEDIAN_OF_NORMAL * float(np.median(seen)) if len(seen) else 0.0
    return np.clip(left, -most, most)


def lines_over_time(wide: WideSignals, residual: Array) -> Periodogram:
    """Lines in time of a residual above the band (N,).

    Where directions are often unknown, the weight has gaps, and a line leaks through them over the
    noise that it is to stand out of. So where most of the noise about the highest ordinate goes
    with the line that it would be, what stays is the noise.
    """
    found = _lines(wide, residual)
    if not len(found.rate) or np.any(found.prominence > 1.0):
        return found
    k = int(np.argmax(found.prominence))
    if REPEATED * wide.leakage * found.power[k] < _LEAKED * found.level[k]:
        return found
    rate = refined(wide.weight * residual, wide.time_s, float(found.rate[k]), found.cell)
    line = wide.above(wide.waves(wide.time_s, rate))
    rest = _lines(wide, left_beside(line, residual))
    leaked = (np.abs(found.rate - rate) < found.cell) & (rest.level < _LEAKED * found.level)
    return replace(found, level=np.where(leaked, rest.level, found.level))


def _lines(wide: WideSignals, residual: Array) -> Periodogram:
    lowest = max(wide.cutoff_hz, _FEWEST_PERIODS / (wide.period_s * len(residual)))
    turn = 2.0 * np.pi
    found = over_time(
        residual, wide.weight, wide.period_s, turn * lowest, turn * WIDEST / wide.period_s
    )
    return found.beside_harmonics(turn / wide.lap_s) if wide.lap_s else found


def quietest_lines(wide: WideSignals, weighted: Array, none: Array) -> Periodogram:
    """Lines in time of the account (N,) with the weighted acceleration, or of that with none.

    At a frequency where encoder noise hides the motion, weighting leaves the acceleration out, but
    for what leaks from frequencies that it lets through. There the quieter one counts.
    """
    first, other = lines_over_time(wide, weighted), lines_over_time(wide, none)
    quieter = (wide.known_motion(first.rate) < _HIDDEN) & (other.level < first.level)
    return replace(
        first,
        power=np.where(quieter, other.power, first.power),
        level=np.where(quieter, other.level, first.level),
    )
