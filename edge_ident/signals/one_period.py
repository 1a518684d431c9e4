"""One period of a periodic motion, conditioned as a board does it that identifies by itself.

A microcontroller has no room for a whole recording. It adds up the samples of one period to means
over 1024 equal blocks while they come, and works on these. A period closes on itself, so the
Fourier transform needs no padding. Filter, derivatives, alignment and the effort's shift are
factors of its harmonics. The rest is as in `edge_ident.signals.conditioning`: the same filter for
effort and regressor, the same rule for the cut-off, standstills bridged alike.

The firmware does the same in C, step by step (docs/chip.md); the tests compare both.
"""

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from edge_ident.signals import conditioning, metrics
from edge_ident.signals.filters import Array, magnitude

Complex = NDArray[np.complex128]

BLOCKS: Final = 1024
"""Means that stand for a period: 47 a second on the built-in motion, which the filter of 5.6 Hz
needs a third of."""
ALIGNED_HARMONICS: Final = 50
"""What 100 points can show of the velocity that the phase is taken from."""
_MISSING_SHARE: Final = 0.002  # share of the period that the capture may lack at its end
_TINY: Final = float(np.finfo(float).tiny)


@dataclass(frozen=True)
class Blocks:
    """One axis over one period.

    Attributes
    ----------
    position, effort : (1024,) arrays
        Means over blocks, in counts; the position from its first sample on.
    noise : float
        Standard deviation of a sample's position, in counts.
    """

    position: Array
    effort: Array
    noise: float

    @classmethod
    def of(cls, position: NDArray[np.int64], effort: NDArray[np.int64]) -> "Blocks":
        """Blocks of the samples of a period, in counts.

        The sums are exact integers, rounded once to single precision, which is what the board has
        room for. The noise is that of `edge_ident.signals.conditioning`.
        """
        relative = position - position[0]
        white = np.sqrt(np.mean(np.diff(relative, 3).astype(np.float64) ** 2) / 20.0)
        return cls(_means(relative), _means(effort), float(max(white, 1.0 / np.sqrt(12.0))))


def _means(samples: NDArray[np.int64]) -> Array:
    """Means over equal blocks; a sample at a border counts for both in its shares."""
    before = np.concatenate([[0], np.cumsum(samples)])
    borders = np.arange(BLOCKS + 1) * len(samples)  # in 1024ths of a sample
    whole, part = borders // BLOCKS, borders % BLOCKS
    last = np.append(samples, 0)[whole]
    sums = np.diff(before[whole] * BLOCKS + part * last)
    return np.asarray(sums.astype(np.float32).astype(np.float64) / len(samples))


def period_samples(period_s: float, sampling_s: float, captured: int) -> int:
    """Samples of the period of a motion, 0 where so many captured ones are too few."""
    samples = round(period_s / sampling_s)
    if captured < BLOCKS or captured < samples * (1.0 - _MISSING_SHARE):
        return 0
    return min(samples, captured)


@dataclass(frozen=True)
class KnownMotion:
    """What is known beforehand of the motion.

    Attributes
    ----------
    acceleration_rms : float
    harmonics : (50,) complex array
        Of its velocity, from the first on, as `numpy.fft.rfft` of 1024 points gives them.
    """

    acceleration_rms: float
    harmonics: Complex

    @classmethod
    def of(cls, regressor: Array) -> "KnownMotion":
        """Known motion from the subsampled regressor (100, 4) of a period."""
        coefficients = np.zeros(BLOCKS)
        coefficients[: len(regressor)] = metrics.dct2(regressor[:, 1])
        velocity = metrics.idct2(coefficients) * np.sqrt(BLOCKS / len(regressor))
        return cls(
            float(np.sqrt(np.mean(regressor[:, 0] ** 2))),
            np.fft.rfft(velocity)[1 : ALIGNED_HARMONICS + 1],
        )


@dataclass(frozen=True)
class Period:
    """One axis over one period, smooth, from the phase of the known motion on.

    Attributes
    ----------
    regressor : (100, 4) array
    effort : (100,) array
    moving_share : float
        Of the period.
    """

    regressor: Array
    effort: Array
    moving_share: float


def choose_cutoff(noise: float, motion: KnownMotion, sampling_s: float, period_s: float) -> float:
    """The cut-off of `edge_ident.signals.conditioning`, for the acceleration of a known motion."""
    ceiling_hz = min(
        1.0 / (conditioning.SAMPLED_PER_PERIOD * sampling_s),
        BLOCKS / period_s / conditioning.SAMPLES_PER_CUTOFF_PERIOD,
    )
    cutoff_hz = conditioning.resolving_cutoff_hz(motion.acceleration_rms, noise, sampling_s)
    return float(max(conditioning.FEWEST_CUTOFF_PERIODS / period_s, min(ceiling_hz, cutoff_hz)))


def condition_period(
    blocks: Blocks,
    motion: KnownMotion,
    *,
    unit: float,
    effort_unit: float,
    sampling_s: float,
    period_s: float,
    effort_shift_s: float,
) -> Period:
    """Filter, differentiate, align and subsample one axis.

    Parameters
    ----------
    blocks : Blocks
    motion : KnownMotion
    unit, effort_unit : float
        One count, SI.
    sampling_s, period_s : float
    effort_shift_s : float
        Time from a sample's stamp to the middle of the interval in which its effort acted.
    """
    block_s = period_s / BLOCKS
    cutoff_hz = choose_cutoff(unit * blocks.noise, motion, sampling_s, period_s)
    frequency = np.asarray(np.fft.rfftfreq(BLOCKS, block_s), dtype=np.float64)
    gain, rate = magnitude(frequency / cutoff_hz), 2j * np.pi * frequency
    rate[-1] = 0.0  # the last harmonic has no derivative
    position = np.fft.rfft(unit * blocks.position) * gain
    shift = _shift(position * rate, motion)
    turn = np.exp(-rate * shift * block_s)
    velocity = np.fft.irfft(position * turn * rate, BLOCKS)
    acceleration = np.fft.irfft(position * turn * rate**2, BLOCKS)
    direction = np.fft.irfft(np.fft.rfft(_direction(velocity, acceleration, block_s)) * gain)
    late = turn * np.exp(-rate * effort_shift_s)
    effort = np.fft.irfft(np.fft.rfft(effort_unit * blocks.effort) * gain * late, BLOCKS)
    raw = np.roll(blocks.position, int(np.floor(shift + 0.5)))
    moving = ~conditioning.standing(raw, blocks.noise, cutoff_hz, block_s)
    columns = conditioning.bridge(np.stack([acceleration, velocity, direction, effort]), moving)
    seen = metrics.subsample(columns.T)
    return Period(
        np.column_stack([seen[:, :3], np.ones(metrics.POINTS)]), seen[:, 3], float(np.mean(moving))
    )


def _direction(velocity: Array, acceleration: Array, block_s: float) -> Array:
    """Sign of the velocity, its mean over each block: as effort and position are means."""
    reached = np.maximum(0.5 * block_s * np.abs(acceleration), _TINY)
    return np.clip(velocity / reached, -1.0, 1.0)


def _shift(velocity: Complex, motion: KnownMotion) -> float:
    """Blocks by which to turn the period to the phase of the known motion, as a fraction.

    The largest of the circular correlation, and a parabola through its neighbours.
    """
    product = np.zeros(BLOCKS // 2 + 1, dtype=np.complex128)
    known = slice(1, len(motion.harmonics) + 1)
    product[known] = motion.harmonics * np.conj(velocity[known])
    match = np.fft.irfft(product, BLOCKS)
    best = int(np.argmax(match))
    before, here, after = (float(match[(best + step) % BLOCKS]) for step in (-1, 0, 1))
    curvature = before - 2.0 * here + after
    return best + (0.5 * (before - after) / curvature if curvature < 0.0 else 0.0)
