"""The bandwidths of the comparison, chosen from the noise of effort and encoder.

The effort noise has the same power density at all frequencies. The encoder noise, seen through the
torque of the inertia, has a density that grows with the fourth power of the frequency. Above the
knee the encoder noise dominates, and the filter attenuates by as much: each frequency counts by the
inverse of its noise, so what is seen at low frequencies stays as clear in a wider band. But least
squares may reduce the inertia, and with it the encoder noise, rather than explain the effort. So an
estimate ends where both noises are equally strong. The search for causes goes on: what compliance,
play or a delay adds to the base model grows with the frequency, up to as fast as the encoder noise.
"""

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from edge_ident.model.motion import Motion
from edge_ident.signals.conditioning import (
    SAMPLED_PER_PERIOD,
    acceleration_noise,
    at_rest,
    crept,
    filtered_regressor,
    widened,
)
from edge_ident.signals.filters import LONG, lowpass, magnitude, whitening
from edge_ident.signals.metrics import quantile

Array = NDArray[np.float64]


_LOWEST_KNEE: Final = 0.12
"""Lowest knee over the cut-off of the identification. A lower one would leave nothing of the short
segments between reversals."""
_BALANCED: Final = 2.1
"""Cut-off of an estimate over knee: below it both filtered noises are equally strong."""
_SEEN: Final = 4.0
"""Cut-off of the search for causes over knee: what the filter leaves there is a sixteenth."""
_MEDIAN_OF_NORMAL: Final = 0.6745
"""Median of the absolute value of a normal variable, in standard deviations."""
_MOTION_BAND: Final = 2.0
"""Bandwidth of the motion over that of the comparison. A narrower motion would reverse and stop at
other moments than the axis; a wider one brings noise that the weighting folds into the band."""
_WIDEST: Final = 0.2
"""Highest bandwidth of the motion, of the sampling rate."""
_LAGS: Final = 12
"""Samples for which a controller answers the rounding of its encoder, and by which either column
may be recorded late."""
_EDGE_PERIODS: Final = 2.0
"""Periods of the filter's cut-off at either end of a record, in which it is not settled."""
_TINY: Final = float(np.finfo(float).tiny)


@dataclass(frozen=True)
class Band:
    """The low-pass filter of the comparison.

    It passes everything below the knee. From there to the cut-off it attenuates with the square of
    the frequency, so that the noise of effort and encoder together is white.
    """

    cutoff_hz: float
    knee_hz: float

    def lowpass(self, signal: Array, period_s: float) -> Array:
        """Filter a signal (..., N), zero-phase."""
        return lowpass(signal, self.cutoff_hz, period_s, knee_hz=self.knee_hz)

    def motion_hz(self, sampling_s: float) -> float:
        """Bandwidth of the motion, of a recording with this sampling period."""
        return min(_MOTION_BAND * self.cutoff_hz, _WIDEST / sampling_s)

    @property
    def balanced_hz(self) -> float:
        """Up to which the comparison hardly attenuates: the cut-off of an estimate."""
        return min(_BALANCED * self.knee_hz, self.cutoff_hz)

    @property
    def acceleration_gain(self) -> float:
        """Filtered acceleration, 1/s², of a motion of amplitude 1 at the cut-off."""
        passed = float(whitening(np.array(self.cutoff_hz / self.knee_hz)))
        return (2.0 * np.pi * self.cutoff_hz) ** 2 * passed

    def power(self, frequency_hz: Array) -> Array:
        """Squared magnitude of the frequency response."""
        passed = magnitude(frequency_hz / self.cutoff_hz) * whitening(frequency_hz / self.knee_hz)
        return np.asarray(passed**2)


def comparison_band(
    position: Array,
    effort: Array,
    noise: float,
    density: float,
    widest_hz: float,
    period_s: float,
) -> Band:
    """Find the band in which causes are looked for.

    Parameters
    ----------
    noise : float
        Standard deviation of the encoder noise.
    density : float
        Power density of the effort noise, per Hz.
    widest_hz : float
        Upper limit of the cut-off.
    """
    regressor = filtered_regressor(position, widest_hz, period_s)
    smooth = lowpass(effort, widest_hz, period_s)
    inertia = abs(float(np.linalg.lstsq(regressor, smooth, rcond=None)[0][0]))
    return search_band(inertia, noise, density, widest_hz, period_s)


def search_band(
    inertia: float, noise: float, density: float, widest_hz: float, period_s: float
) -> Band:
    """The same for a known inertia, in the unit of effort per acceleration."""
    knee_hz = _knee_hz(inertia, noise, density, widest_hz, period_s)
    return Band(min(_SEEN * knee_hz, widest_hz), knee_hz)


def balanced_band(
    inertia: float, noise: float, density: float, widest_hz: float, period_s: float
) -> Band:
    """The band of an estimate, in which encoder noise and effort noise are balanced."""
    knee_hz = _knee_hz(inertia, noise, density, widest_hz, period_s)
    return Band(min(_BALANCED * knee_hz, widest_hz), knee_hz)


def _knee_hz(
    inertia: float, noise: float, density: float, widest_hz: float, period_s: float
) -> float:
    """Frequency at which both noises have the same density."""
    # the integral of f⁴ up to the widest frequency is a fifth of its value there
    encoder = np.sqrt(5.0) * inertia * acceleration_noise(noise, widest_hz, period_s)
    ratio = np.sqrt(density * widest_hz) / max(float(encoder), _TINY)
    return widest_hz * max(float(np.sqrt(ratio)), _LOWEST_KNEE)


def white_noise(effort: Array, position: Array, cutoff_hz: float, period_s: float) -> float:
    """Standard deviation of the white noise in the effort, from its highest frequencies.

    The controller's answer to the rounding of its encoder is no noise, because it drives the axis.
    The recorded position holds the same rounding. So the part of the effort that follows from the
    position by a short linear filter is subtracted first.
    """
    above_hz = min(max(3.0 * cutoff_hz, 0.05 / period_s), 0.25 / period_s)
    both = np.stack([effort, position])
    high = both - lowpass(both, above_hz, period_s)
    # at its ends the filter reflects both alike, though one is late
    first = _LAGS + min(round(_EDGE_PERIODS / (above_hz * period_s)), len(effort) // 10)
    last = len(effort) - first
    inside = high[0, first:last]
    moved = high[1, first - _LAGS + 1 : last + _LAGS]
    moved = moved / max(float(np.max(np.abs(high[1, first:last]))), _TINY)
    # normal equations take a quarter of the time, and squares of 1e-7 are resolved
    products, of_effort = _lagged_products(moved, 2 * _LAGS), np.correlate(moved, inside)
    answer = np.linalg.lstsq(products, of_effort, rcond=1e-14)[0]
    left = inside - np.correlate(moved, answer)
    # the median ignores the steps of friction, which reach these frequencies now and then
    deviation = quantile(np.abs(left), 0.5) / _MEDIAN_OF_NORMAL
    return float(deviation / np.sqrt(1.0 - 2.0 * above_hz * period_s))


def fast_effort(effort: Array, cutoff_hz: float, period_s: float) -> float:
    """Standard deviation of the effort (N,) above a cut-off, without the steps of friction.

    That of a tone is close to its amplitude: of half of its samples, the sine is above 0.7.
    """
    fast = np.abs(effort - lowpass(effort, cutoff_hz, period_s))
    return float(quantile(fast, 0.5) / _MEDIAN_OF_NORMAL)


def _lagged_products(signal: Array, lags: int) -> Array:
    """Products (L, L) of every two of the L lagged parts, as long as can be, of a signal (N,).

    From one lag to the next, a product loses one sample and gains another.
    """
    samples = len(signal) - lags + 1
    products = np.empty((lags, lags))
    products[0] = products[:, 0] = np.correlate(signal, signal[:samples])
    change = np.multiply.outer(signal[samples:], signal[samples:])
    change -= np.multiply.outer(signal[: lags - 1], signal[: lags - 1])
    for lag in range(lags - 1):
        products[lag + 1, 1:] = products[lag, :-1] + change[lag]
    return products


# Samples that the diagnosis leaves out.
#
# Three kinds of sample say nothing about the model: those at which the encoder does not resolve the
# direction of motion, those at which encoder quantization aliases into the band, and the first
# ones, at which friction and play remember the time before the record.

Mask = NDArray[np.bool_]

SMEAR_PERIODS: Final = 0.7
"""Cut-off periods to either side over which the filter spreads a single sample."""
TURN_NOISE: Final = 8.0
"""Distance from a turning point, in standard deviations of the encoder noise, below which the
direction is unknown. It is 2.3 counts of an encoder without other noise."""
LEAST_WEIGHT: Final = 0.5
"""Filtered direction weight, from 0 to 1, from which a sample is compared: most of what the filter
mixes into it is of known direction."""
_TAPER_PERIODS: Final = 0.4
"""Cut-off periods over which the direction weight falls to zero, and rises again. A sharper edge
would spread over the band."""
_RUN_IN: Final = 0.1
"""Part of the travel that the axis covers before friction and play have forgotten the time before
the record. What builds up over a longer distance is not searched for."""
_STILL_NOISE: Final = 6.0
"""Range of the position, in the same unit, of an axis at rest: less than two counts."""
_HARMONICS: Final = 2
"""Harmonics of the rounding error, a sawtooth, that are considered."""
_DITHER: Final = 0.5
"""Noise, in counts, that makes the rounding error white."""
_SLOW_SWEEP: Final = 8.0
"""Cut-off periods in which an aliased tone may cross the band and still look like motion."""


def longer_or_faster(sampling_hz: float) -> str:
    """What to do where hardly a sample is of known direction."""
    return (
        "record a longer motion, or one that is gentler and turns less often, or sample faster: "
        f"{sampling_hz:.4g} Hz shows reversals that are {SAMPLED_PER_PERIOD / sampling_hz:.2g} s "
        "apart, or more"
    )


def reversals(motion: Motion) -> NDArray[np.intp]:
    """Last samples before the velocity changes its sign."""
    return np.flatnonzero(np.diff(np.sign(motion.velocity)) != 0)


def direction_weight(unknown: Mask, cutoff_hz: float, period_s: float) -> Array:
    """Weight (N,) that falls smoothly from 1, far from unknown directions, to 0 at them."""
    return 1.0 - tapered(unknown, _TAPER_PERIODS / (cutoff_hz * period_s))


def run_in(position: Array) -> int:
    """First of N samples up to which the axis has covered a part of the travel.

    A play or a presliding of that width has forgotten the time before the record then, on whichever
    side of the start that part lies (wiping out, Mayergoyz, Phys. Rev. Lett. 56 (1986) 1518).
    """
    covered = np.maximum.accumulate(position) - np.minimum.accumulate(position)
    return int(np.argmax(covered > _RUN_IN * np.ptp(position)))


def tapered(mask: Mask, by: float) -> Array:
    """Weight (N,) that rises smoothly from 0, far from a mask, to 1 inside it.

    The rise begins twice `by` samples before the mask.
    """
    half = int(np.ceil(by))
    window = np.hanning(2 * half + 3)
    spread = np.convolve(widened(mask, half), window / np.sum(window), "same")
    return np.asarray(np.clip(spread, 0.0, 1.0))


def tone_count(count: float, noise: float) -> float:
    """Count of an encoder whose rounding error is a tone at a steady speed, 0 where it is none.

    Noise of more than half a count before the rounding makes its error white, whatever the speed
    (dither, Widrow and Kollar, Quantization Noise, 2008): its first harmonic is left with less than
    a hundredth. The noise floor holds white noise already.

    Parameters
    ----------
    count : float
        Encoder resolution.
    noise : float
        Standard deviation of the encoder noise, that of the rounding among it.
    """
    return count if noise**2 - count**2 / 12.0 < (_DITHER * count) ** 2 else 0.0


def aliasing_mask(
    motion: Motion, count: float, cutoff_hz: float, period_s: float, smear: int
) -> Mask:
    """Samples (N,) at which encoder quantization aliases into the band.

    The rounding error of the encoder is a tone whose frequency is the speed in counts per second.
    At a whole number of counts per sample, sampling folds this tone to low frequencies. Where the
    speed stays there for a while, the aliased tone looks like motion, and the controller answers
    it.

    Parameters
    ----------
    motion : Motion
        (N,), filtered at the cut-off.
    count : float
        `tone_count` of the encoder.
    smear : int
        Samples by which the mask is widened.
    """
    tones = np.zeros(len(motion.velocity), dtype=np.bool_)
    harmonics = range(1, _HARMONICS + 1) if count > 0.0 else ()
    for begin in range(0, len(tones), LONG):  # in blocks: a long recording leaves little memory
        block = slice(begin, begin + LONG)
        for harmonic in harmonics:
            per_sample = harmonic * np.abs(motion.velocity[block]) * period_s / count
            folded_hz = np.abs(per_sample - np.round(per_sample)) / period_s
            sweep = harmonic * np.abs(motion.acceleration[block]) / count
            tones[block] |= (
                (per_sample > 0.5) & (folded_hz < cutoff_hz) & (sweep < cutoff_hz**2 * _SLOW_SWEEP)
            )
    return widened(tones, smear)


def unknown_directions(
    position: Array,
    turns: NDArray[np.intp],
    noise: float,
    speed: float,
    cutoff_hz: float,
    period_s: float,
) -> tuple[Mask, Mask]:
    """Samples (N,) at which the encoder does not resolve the direction of motion, in two parts.

    Reversing: samples within the encoder noise of a turning point, and standstills of at least
    half a cut-off period, in which the axis rests or creeps. Until it has moved on, its friction
    may be anything between the friction of both directions.

    Short rests, from which the axis moves on as before: the position has no turning point beyond
    the noise there. They show in the smooth velocity, which changes its sign.

    Parameters
    ----------
    position : (N,) array
        As measured.
    turns : array of int
        Samples at which the smooth velocity changes its sign.
    noise : float
        Standard deviation of the encoder noise.
    speed : float
        Typical speed.
    """
    found, width = turning_points(position, TURN_NOISE * noise), _half_period(cutoff_hz, period_s)
    near = np.zeros(len(position), dtype=np.bool_)
    near[found] = True
    # the smooth velocity shows the turning points too, a few samples aside
    near = widened(near, width)
    most = max(_STILL_NOISE * noise, crept(speed, width * period_s))
    still = at_rest(position, most, width)
    reversing = _not_away(position, found, noise) | still
    return reversing, _not_away(position, turns[~near[turns]].tolist(), noise)


def _half_period(cutoff_hz: float, period_s: float) -> int:
    """Samples in half a period of the cut-off."""
    return max(2, int(np.ceil(0.5 / (cutoff_hz * period_s))))


def _not_away(position: Array, turns: list[int], noise: float) -> Mask:
    """Samples (N,) around each turn, until the axis is beyond the noise of it."""
    found = np.zeros(len(position), dtype=np.bool_)
    for turn in turns:
        away = np.abs(position - position[turn]) > TURN_NOISE * noise
        before, after = np.flatnonzero(away[:turn]), np.flatnonzero(away[turn:])
        first = before[-1] + 1 if len(before) else 0
        found[first : turn + (after[0] if len(after) else len(away))] = True
    return found


def turning_points(position: Array, least: float) -> list[int]:
    """Extremes from which the position returns by more than `least`."""
    turns: list[int] = []
    highest = lowest = 0
    direction = 0
    for k, here in enumerate(position.tolist()):
        if here > position[highest]:
            highest = k
        if here < position[lowest]:
            lowest = k
        if direction >= 0 and position[highest] - here > least:
            turns += [highest] if direction > 0 else []
            direction, lowest = -1, k
        elif direction <= 0 and here - position[lowest] > least:
            turns += [lowest] if direction < 0 else []
            direction, highest = 1, k
    return turns
