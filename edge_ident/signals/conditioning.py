"""From measured samples to smooth signals: bandwidth, filtering, standstills.

Training and run time share this code, so the network never sees two kinds of preprocessing.
"""

from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from edge_ident.model.model import regressor, regressor_rows
from edge_ident.signals.filters import Mask, differentiate, lowpass, parts_of
from edge_ident.signals.metrics import rms
from edge_ident.signals.recording import Sampling
from edge_ident.signals.time_stamps import EvenGrid, clipped

Array = NDArray[np.float64]


SAMPLES_PER_CUTOFF_PERIOD: Final = 2.5
"""Rate after decimation, in cut-offs: what the filter passes is kept, no more."""
# Samples that are estimated from: beyond, noise moves parameters far less than model error does.
_MOST_SAMPLES: Final = 1 << 19
SAMPLED_PER_PERIOD: Final = 20
"""Gautier's rule: sample at least 100 times faster than the dynamics, filter at 5 times."""
FEWEST_CUTOFF_PERIODS: Final = 10.0
"""Fewest cut-off periods in a record; a motion without acceleration would ask for none."""
ACCELERATION_NOISE_SHARE: Final = 0.05
"""Encoder noise allowed in the acceleration; its square biases the inertia, by 0.25 %."""
_TINY: Final = float(np.finfo(float).tiny)


@dataclass(frozen=True)
class Signals:
    """One axis, smooth and evenly sampled, all columns filtered alike.

    Attributes
    ----------
    grid : EvenGrid
        On which the samples are even.
    cutoff_hz : float
        -6 dB frequency of the zero-phase filter.
    effort : (N,) array
        (D, N) where several efforts were given.
    regressor : (N, 4) array
        Columns of `edge_ident.model.model.regressor`, low-passed like the effort.
    moving : (N,) array of bool
        False where the axis stood still for longer than the filter can resolve. There the motion
        does not determine the friction. Effort and regressor are both bridged by straight lines,
        which keeps the relation between them linear.
    acceleration_noise : float
        Encoder noise in the acceleration over its rms value. Least squares underestimates the
        inertia by the square of it (errors in variables).
    unknown_share : float
        Share of samples inside gaps of the time stamps, or where the effort is clipped. They are
        bridged like standstills.
    clipped_share : float
        The clipped ones of these; all of them, where the recording was decimated before.
    sampling : Sampling or None
        Of a recording that was decimated before.
    encoder_count : float
        Smallest step of the position, 0 where it has none.
    position_noise : float
        Standard deviation of the white noise in the position.
    """

    grid: EvenGrid
    cutoff_hz: float
    effort: Array
    regressor: Array
    moving: NDArray[np.bool_]
    acceleration_noise: float
    unknown_share: float = 0.0
    clipped_share: float = 0.0
    sampling: Sampling | None = None
    encoder_count: float = 0.0
    position_noise: float = 0.0

    @property
    def period_s(self) -> float:
        """Sampling period of the even grid."""
        return self.grid.period_s

    @property
    def recorded_period_s(self) -> float:
        """Sampling period of the recording, before any decimation."""
        return self.sampling.period_s if self.sampling else self.grid.period_s

    @property
    def begin_s(self) -> float:
        """Time from the first sample of the recording to the first of the signals."""
        return self.sampling.begin_s if self.sampling else 0.0

    def times_s(self, samples: NDArray[np.intp]) -> Array:
        """Times of samples (n,), from the first sample of the recording."""
        return self.begin_s + self.period_s * samples.astype(np.float64)

    @property
    def jitter(self) -> float:
        """Largest deviation of a time stamp from an even grid, in sampling periods."""
        return self.sampling.jitter if self.sampling else self.grid.jitter


def condition(
    time_s: Array,
    position: Array,
    effort: Array,
    *,
    effort_shift_s: float = 0.0,
    sampling: Sampling | None = None,
) -> Signals:
    """Filter and differentiate one axis.

    Parameters
    ----------
    time_s, position : (N,) arrays
        Uneven sampling is brought to an even grid, see `edge_ident.signals.time_stamps`.
    effort : (N,) array, or (D, N) on an even grid
        Several efforts may share one motion.
    effort_shift_s : float
        Time from a row's stamp to the middle of the interval in which its effort acted.
    sampling : Sampling, optional
        Of samples that were decimated before.
    """
    grid = EvenGrid.of(time_s)
    period_s, motion = grid.period_s, None
    if sampling is not None:
        unknown, cutoff_hz = sampling.unknown, sampling.cutoff_hz
        clipped_share = float(np.mean(unknown))
        count, noise = sampling.count, sampling.position_noise
    else:
        unknown, clipped_share = _unknown_and_clipped(grid, effort)
        position, effort = grid.resampled(position), grid.resampled(effort)
        count, noise = count_and_noise(position)
        cutoff_hz, motion = _cutoff_and_motion(position, period_s, noise)
    motion = motion or differentiate(position, cutoff_hz, period_s, orders=(1, 2))
    rows = _filtered(
        motion, effort, cutoff_hz, period_s, delay_s=effort_shift_s, decimated=sampling is not None
    )
    still = standing(position, noise, cutoff_hz, period_s, rms(rows[1]))
    moving = ~still & ~near_unknown(unknown, cutoff_hz, period_s)
    of_noise = acceleration_noise(noise, cutoff_hz, sampling.period_s if sampling else period_s)
    bridged = bridge(rows, moving)
    return Signals(
        grid=grid,
        cutoff_hz=cutoff_hz,
        effort=bridged[4:].reshape(effort.shape),
        regressor=bridged[:4].T,
        moving=moving,
        acceleration_noise=of_noise / max(float(np.std(rows[0])), _TINY),
        unknown_share=float(np.count_nonzero(unknown) / len(unknown)),
        clipped_share=clipped_share,
        sampling=sampling,
        encoder_count=count,
        position_noise=noise,
    )


def _unknown_and_clipped(grid: EvenGrid, effort: Array) -> tuple[NDArray[np.bool_], float]:
    """Samples that say nothing, and the share of clipped ones; none of several efforts."""
    if effort.ndim > 1:
        return np.zeros(effort.shape[-1], np.bool_), 0.0
    return grid.unknown(effort), float(np.mean(clipped(effort)))


def with_effort(signals: Signals, effort: Array, effort_shift_s: float) -> Signals:
    """The same motion with another effort, or with the same one shifted otherwise.

    Parameters
    ----------
    signals : Signals
    effort : (N,) array
        As measured.
    effort_shift_s : float
        See `condition`.
    """
    resampled, period_s = signals.grid.resampled(effort), signals.period_s
    smooth = lowpass(resampled, signals.cutoff_hz, period_s, delay_s=effort_shift_s)
    return replace(signals, effort=bridge(smooth, signals.moving))


def filtered_regressor(position: Array, cutoff_hz: float, period_s: float) -> Array:
    """Regressor (N, 4) of a position (N,), all columns filtered alike, the velocity's sign too."""
    motion = differentiate(position, cutoff_hz, period_s, orders=(1, 2))
    columns = regressor(*motion)
    columns[:, 2] = lowpass(columns[:, 2], cutoff_hz, period_s)
    return columns


def _filtered(
    motion: tuple[Array, ...],
    effort: Array,
    cutoff_hz: float,
    period_s: float,
    *,
    delay_s: float,
    decimated: bool,
) -> Array:
    """Columns of the regressor, as rows, and efforts below them, (4 + D, N), filtered alike.

    Parameters
    ----------
    motion : tuple of (N,) arrays
        Velocity and acceleration, which are filtered.
    effort : (N,) or (D, N) array
    delay_s : float
        Of the efforts.
    decimated : bool
        Whether the position was low-passed and decimated to few samples per cut-off period.
    """
    velocity, acceleration = motion
    rows = np.concatenate([regressor_rows(velocity, acceleration), np.atleast_2d(effort)])
    if decimated:
        rows[2] = _mean_direction(velocity, acceleration, period_s)
    delays_s = [0.0] + [delay_s] * (len(rows) - 4)
    filtered = lowpass(rows[[2, *range(4, len(rows))]], cutoff_hz, period_s, delay_s=delays_s)
    rows[2], rows[4:] = filtered[0], filtered[1:]
    return rows


def _mean_direction(velocity: Array, acceleration: Array, period_s: float) -> Array:
    """Sign of the velocity, low-passed before it is sampled, as decimated signals are.

    The mean over a sampling period places a reversal between samples. What it takes off the higher
    frequencies, the second difference returns.
    """
    reached = np.maximum(0.5 * period_s * np.abs(acceleration), _TINY)
    mean = np.clip(velocity / reached, -1.0, 1.0)
    mean[1:-1] -= np.diff(mean, 2) / 24.0
    return mean


def choose_cutoff(position: Array, period_s: float, noise: float | None = None) -> float:
    """Widest cut-off at which encoder noise spoils the acceleration little.

    A narrow filter smears every reversal and standstill; a wide one passes noise. The cut-off is
    where the noise reaches 5 % of the rms acceleration. It is at most a twentieth of the sampling
    rate, and the record is at least ten cut-off periods long.

    Parameters
    ----------
    position : (N,) array
    period_s : float
    noise : float, optional
        `position_noise` of the position, where it is known already.

    Returns
    -------
    float
        In Hz.
    """
    return _cutoff_and_motion(position, period_s, noise)[0]


def _cutoff_and_motion(
    position: Array, period_s: float, noise: float | None
) -> tuple[float, tuple[Array, ...] | None]:
    """The widest cut-off; velocity and acceleration of a position that was looked at as a whole."""
    ceiling_hz = 1.0 / (SAMPLED_PER_PERIOD * period_s)
    floor_hz = FEWEST_CUTOFF_PERIODS / (period_s * len(position))
    noise = position_noise(position) if noise is None else noise
    cutoff_hz = ceiling_hz
    for _ in range(8):  # the rms acceleration itself depends, weakly, on the cut-off
        motions = [differentiate(x, cutoff_hz, period_s, orders=(1, 2)) for x in parts_of(position)]
        mean_square = np.mean([np.var(acceleration) for _, acceleration in motions])
        allowed = ACCELERATION_NOISE_SHARE * float(np.sqrt(mean_square))
        excess = acceleration_noise(noise, cutoff_hz, period_s) / max(allowed, _TINY)
        wanted_hz = cutoff_hz * float(max(excess, _TINY) ** -0.4)
        wanted_hz = max(floor_hz, min(ceiling_hz, wanted_hz))
        if abs(wanted_hz - cutoff_hz) < 0.01 * cutoff_hz:
            return cutoff_hz, motions[0] if len(motions) == 1 else None
        cutoff_hz = wanted_hz
    return cutoff_hz, None


def resolving_cutoff_hz(acceleration: float, position_noise: float, period_s: float) -> float:
    """Cut-off at which encoder noise reaches its share of an acceleration; it grows as f^2.5."""
    at_1_hz = acceleration_noise(position_noise, 1.0, period_s)
    return float((ACCELERATION_NOISE_SHARE * acceleration / max(at_1_hz, _TINY)) ** 0.4)


def acceleration_noise(position_noise: float, cutoff_hz: float, period_s: float) -> float:
    """Standard deviation that white position noise has in the filtered second derivative.

    Noise of deviation s, sampled at f_s, has density 2s²/f_s; differentiated twice and cut off
    at f_c its variance is (2π)⁴·f_c⁵/5 · 2s²/f_s.
    """
    variance = (2.0 * np.pi) ** 4 * cutoff_hz**5 / 5.0 * 2.0 * position_noise**2 * period_s
    return float(np.sqrt(variance))


_NEARLY_ALL: Final = 0.99


def highest_hz(signal: Array, period_s: float) -> float:
    """Frequency below which nearly all the energy of a signal (N,) lies."""
    seen = (signal - np.mean(signal)) * np.hanning(len(signal))  # no step between end and start
    power = np.abs(np.fft.rfft(seen)) ** 2
    below = np.cumsum(power)
    return float(np.searchsorted(below, _NEARLY_ALL * below[-1]) / (len(signal) * period_s))


def decimation(samples: int, cutoff_hz: float, period_s: float) -> int:
    """Samples from one to the next after decimation to what the filter passes."""
    fewest = int(1.0 / (SAMPLES_PER_CUTOFF_PERIOD * cutoff_hz * period_s))
    return max(1, fewest, -(-samples // _MOST_SAMPLES))


def decimated(samples: int, cutoff_hz: float, period_s: float) -> NDArray[np.intp]:
    """Samples that tell all that the filter passes.

    One filter's settling time is left out at both ends, where effort and position are
    continued differently.
    """
    margin = min(round(1.0 / (cutoff_hz * period_s)), samples // 20)
    return np.arange(margin, samples - margin, decimation(samples, cutoff_hz, period_s))


def unit_length(regressor: Array) -> tuple[Array, Array]:
    """Columns (N, P) of unit length, and the lengths (P,) that they had; one for empty ones."""
    length = np.linalg.norm(regressor, axis=0)
    length = np.where(length > 0, length, 1.0)
    return regressor / length, length


# Samples that tell nothing of a motion: standstills, and what a filter mixes with unknown ones.


_DECAY_PERIODS: Final = 1.5  # Cut-off periods after which 3 % of the filter's response are left
# Range of the position, in standard deviations of its noise, up to which the axis stands.
_STANDSTILL_NOISE: Final = 8.0
# Share of an axis's typical speed. A judgement: what friction does at low speed, it does at ten
# times that.
_CREEPING: Final = 0.005


def shortest_move_s(cutoff_hz: float) -> float:
    """Duration of a move between two rests of which hardly a sample is left."""
    return 2.0 * _DECAY_PERIODS / cutoff_hz


def standing(
    position: Array, noise: float, cutoff_hz: float, period_s: float, speed: float = 0.0
) -> Mask:
    """Samples in or near a standstill of at least one cut-off period.

    In a standstill the encoder shows nothing but its own noise, of the standard deviation `noise`,
    or the axis creeps, compared with its typical speed (`crept`). It spoils filtered signals to
    either side until the filter's response has decayed. A shorter reversal stays in: there the
    filtered sign of the velocity describes what the filter leaves of the friction.

    Returns
    -------
    (N,) array of bool
    """
    width = int(np.ceil(1.0 / (cutoff_hz * period_s)))
    margin = int(np.ceil(_DECAY_PERIODS * width))
    most = max(_STANDSTILL_NOISE * noise, crept(speed, width * period_s))
    return at_rest(position, most, width, margin)


def crept(speed: float, duration_s: float) -> float:
    """Distance up to which an axis of a typical speed creeps in a time, and does not slide.

    A controller that holds its place moves it so little, by what bearings, seals and belts give
    way. Friction then is whatever holds the axis, and not that of its direction.
    """
    return _CREEPING * speed * duration_s


def at_rest(position: Array, most: float, width: int, margin: int = 0) -> Mask:
    """Samples (N,) of windows in which a position (N,) hardly changes.

    Parameters
    ----------
    position : (N,) array
    most : float
        Range of the position in such a window.
    width : int
        Samples in a window.
    margin : int
        Samples to both sides of a window that count with it.
    """
    if width >= len(position):
        return np.zeros(len(position), dtype=np.bool_)
    still = _range_within(position, width) <= most
    # from the windows' first samples to all of their samples and the margins at both sides
    return _spread(still, width + 2 * margin)[margin : margin + len(position)]


def near_unknown(unknown: Mask, cutoff_hz: float, period_s: float) -> Mask:
    """Samples that the filter mixes with unknown ones."""
    if not np.any(unknown):
        return unknown
    margin = min(int(np.ceil(_DECAY_PERIODS / (cutoff_hz * period_s))), len(unknown) // 2 - 1)
    return widened(unknown, margin)


def widened(mask: Mask, by: int) -> Mask:
    """Extend a mask (N,) by a number of samples to either side."""
    return _spread(mask, 2 * by + 1)[by : by + len(mask)]


def bridge(signal: Array, moving: Mask) -> Array:
    """Replace (..., N) signals by straight lines where the axis does not move."""
    if moving.all() or not moving.any():
        return signal
    bridged, changes = signal.copy(), np.flatnonzero(np.diff(moving, prepend=True, append=True))
    for begin, end in changes.reshape(-1, 2):
        known = [at for at in (begin - 1, end) if 0 <= at < len(moving)]
        first, last = signal[..., known[0], None], signal[..., known[-1], None]
        slope = (last - first) / max(known[-1] - known[0], 1)
        bridged[..., begin:end] = first + slope * np.arange(begin - known[0], end - known[0])
    return bridged


def _spread(mask: Mask, width: int) -> Mask:
    """Samples (N + width - 1,) up to `width` - 1 after one of a mask (N,), by doubling."""
    spread = np.zeros(len(mask) + width - 1, dtype=np.bool_)
    spread[: len(mask)] = mask
    reached = 1
    while reached < width:
        step = min(reached, width - reached)
        spread[step:] |= spread[:-step].copy()
        reached += step
    return spread


def _range_within(signal: Array, width: int) -> Array:
    """Range of every `width` neighbours (N - width + 1,) in a signal (N,), by doubling."""
    largest = smallest = signal
    reached = 1
    while reached < width:
        step = min(reached, width - reached)
        largest = np.maximum(largest[:-step], largest[step:])
        smallest = np.minimum(smallest[:-step], smallest[step:])
        reached += step
    return np.asarray(largest - smallest)


# What a recorded position tells of its encoder: resolution and noise.

_ALWAYS: Final = 0.9  # share of samples in which an axis moves, from which rounding is white noise
# Noise by sixth differences over that by third ones, below which the third ones hold motion. Of
# white noise and of counts that follow each other slowly, it is 0.95 to 1.05.
_MOTION: Final = 0.75
_NO_ROUNDING: Final = 0.5  # noise over that of rounding, below which a position is not rounded


def position_noise(position: Array) -> float:
    """Standard deviation of white noise in a position, at least that of its quantization."""
    return count_and_noise(position)[1]


def encoder_count(position: Array) -> float:
    """Smallest step between values that a position takes, 0 where that is no count."""
    return count_and_noise(position)[0]


def count_and_noise(position: Array) -> tuple[float, float]:
    """`encoder_count` and `position_noise` of a position (N,), in less time than one by one."""
    white = _white_noise(position)
    count = _count(position, white)
    return count, max(white, count / float(np.sqrt(12.0)))


def _count(position: Array, white: float) -> float:
    """The smallest step, of a position with so much white noise.

    An axis that moves on all the time and never returns takes each value once. Its smallest step is
    that of the slowest sample. Rounding to counts of that size would show as noise.
    """
    parts, least = parts_of(position), 1e-9 * np.ptp(position)
    # a motion goes up and down for long: a merge sort takes an eighth of the time
    steps = np.concatenate([np.diff(np.sort(part, kind="stable")) for part in parts])
    count = float(np.min(np.where(steps > least, steps, np.inf)))
    if not np.isfinite(count):
        return 0.0
    changes = [np.count_nonzero(part[1:] != part[:-1]) / (len(part) - 1) for part in parts]
    moves = float(np.mean(changes)) > _ALWAYS
    rounding = count / np.sqrt(12.0)
    return 0.0 if moves and white < _NO_ROUNDING * rounding else count


def _white_noise(position: Array) -> float:
    """Third differences remove a slow motion and multiply white noise by √20.

    Sixth ones remove a faster motion, and multiply it by √924. Where they tell of decidedly less
    noise, the third hold motion.
    """
    third = [np.diff(part, 3) for part in parts_of(position)]
    noise = float(np.sqrt(np.mean([np.mean(part**2) for part in third]) / 20.0))
    sixth = [np.diff(part, 3) for part in third]
    without_motion = float(np.sqrt(np.mean([np.mean(part**2) for part in sixth]) / 924.0))
    return without_motion if without_motion < _MOTION * noise else noise
