"""One axis as the diagnosis sees it: a bandwidth, smooth motions, the samples that are judged.

The bandwidth is where encoder noise in the inertia's torque reaches the noise of the effort: the
narrower the filter, the more of every reversal is smeared; the wider, the more of the residual is
noise that says nothing.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Final

import numpy as np
import scipy.linalg
import scipy.signal
import scipy.sparse
from numpy.typing import NDArray

from edge_ident.effect import Extent, Motion
from edge_ident.effects import named
from edge_ident.errors import DataError
from edge_ident.filters import differentiate, even_grid, interpolate, lowpass
from edge_ident.inverse import along_motion, inverse_effort, obeyed
from edge_ident.model import BASE, PARAMETERS, AxisModel, Term
from edge_ident.recording import Recording
from edge_ident.signals import (
    acceleration_noise,
    choose_cutoff,
    encoder_count,
    filtered_regressor,
    position_noise,
    standing,
)

Array = NDArray[np.float64]

_SAMPLES_PER_CUTOFF_PERIOD: Final = 2.5
"""Rate after decimation, in cut-offs: what the filter passes is kept, no more."""
_SMEAR_PERIODS: Final = 0.7
"""Cut-off periods to either side of a reversal in which the filter mixes both directions."""
_MOST_SAMPLES: Final = 1500
"""Independent samples beyond which more bandwidth tells little and costs much time."""
_NARROWEST: Final = 0.25
"""Of the bandwidth that identification uses."""
_FEWEST_SAMPLES: Final = 40
"""Twice the parameters of the base model and a few causes."""
_COLUMN_RATE: Final = 12.0
"""Samples per cut-off period at which columns are made."""
_MEDIAN_OF_NORMAL: Final = 0.6745
"""Of the absolute value, in standard deviations."""
_LAGS: Final = 12
"""Samples for which a controller remembers its encoder's rounding."""
_BLOCKS: Final = 40
_BLOCK_PERIODS: Final = 4.0
"""A block is at least so many cut-off periods long."""
_REACH_PERIODS: Final = 4.0
"""Cut-off periods after which the filter's response is below a ten-thousandth."""
_HARMONICS: Final = 2
"""Of the rounding error, which is a sawtooth."""
_SLOW_SWEEP: Final = 8.0
"""Cut-off periods over the time in which a beat crosses the band, at which it is still one."""
_SHAKE_SEED: Final = 1
_TINY: Final = float(np.finfo(float).tiny)


@dataclass(frozen=True)
class Stretch:
    """One axis of one recording, filtered.

    Attributes
    ----------
    motion : Motion
        Smooth, (N,), time from the first sample.
    others : mapping of axis name to Motion
    shaken : tuple of Motion and mapping
        The same with the noise of the encoders once more.
    raw_effort : (M,) array
        As recorded, every raw_period_s; its means lie shift_s later.
    effort : (N,) array
        Filtered, in step with the motion: every stride-th sample.
    picks : (n,) array
        Samples that are used: decimated, in motion, away from the ends.
    clear : (n,) array of bool
        Those away from reversals.
    far : (n,) array of bool
        Those of them where nothing is left of any reversal or standstill.
    position_noise, acceleration_noise, effort_noise : float
        Standard deviations of white noise in the position, and in the acceleration and effort
        when cut off sharply at the cut-off.
    standstills : (n, S) array
        What friction of unknown size during standstills, and its change at reversals of unknown
        moment, can leave at the picks beyond: the filter's answer to a constant and to a slope
        for as long as the axis stood, and to a pulse where it turned.
    """

    motion: Motion
    others: Mapping[str, Motion]
    shaken: tuple[Motion, Mapping[str, Motion]]
    raw_effort: Array
    raw_period_s: float
    shift_s: float
    stride: int
    effort: Array
    picks: NDArray[np.intp]
    clear: NDArray[np.bool_]
    far: NDArray[np.bool_]
    cutoff_hz: float
    period_s: float
    filter: scipy.sparse.csr_array
    position_noise: float
    acceleration_noise: float
    effort_noise: float
    standstills: Array
    kept: dict[object, Array] = field(default_factory=dict, compare=False)
    """Efforts along the motion that were integrated before."""

    def predicted(self, axis: AxisModel) -> Array:
        """Effort column that a model expects at the picks, (n,) or (D, n)."""
        effort = inverse_effort(obeyed(axis), self.motion, self.others, self.kept)
        picked = np.asarray((self.filter @ np.atleast_2d(effort).T).T)
        for term in axis.terms:
            effect = named(term.effect)
            if effect.overrides("withheld"):
                picked = picked + self._picked(effect.withheld(self.raw_effort, along_motion(term)))
        return picked if picked.shape[0] > 1 or effort.ndim > 1 else picked[0]

    def added_by(self, term: Term) -> Array:
        """What a term alone adds to the effort of an axis without inertia and friction, (N,)."""
        nothing = Term(BASE, dict.fromkeys(PARAMETERS, 0.0))
        return inverse_effort(AxisModel((nothing, term)), self.motion, self.others)

    def _picked(self, raw: Array) -> Array:
        """A raw effort (..., M) as the filtered effort has it, at the picks."""
        filtered = lowpass(raw, self.cutoff_hz, self.raw_period_s, delay_s=self.shift_s)
        return filtered[..., :: self.stride][..., self.picks]


@dataclass(frozen=True)
class View:
    """One axis over all its recordings; samples stand one recording after the other.

    Attributes
    ----------
    stretches : tuple of Stretch
    effort : (n,) array
        Measured, filtered.
    clear : (n,) array of bool
    block : (n,) array of int
        Number of the stretch of time, for holding out and for resampling.
    standstills : (n, S) array
        Of all stretches.
    """

    stretches: tuple[Stretch, ...]
    effort: Array
    clear: NDArray[np.bool_]
    block: NDArray[np.intp]
    standstills: Array
    kept: dict[object, Array] = field(default_factory=dict, compare=False)
    """Columns that were made before."""

    @property
    def reverses(self) -> bool:
        """Whether the axis turns in any recording."""
        return any(np.ptp(np.sign(s.motion.velocity)) > 0.0 for s in self.stretches)

    @property
    def far(self) -> NDArray[np.bool_]:
        """Clear samples (n,) where nothing is left of any reversal or standstill."""
        return np.concatenate([s.far for s in self.stretches])

    @property
    def shaken(self) -> "View":
        """The same samples with the noise of the encoders once more in the motion."""
        stretches = tuple(
            replace(s, motion=s.shaken[0], others=s.shaken[1], kept={}) for s in self.stretches
        )
        return replace(self, stretches=stretches, kept={})

    @property
    def samples(self) -> int:
        """At the rate of the columns, all recordings together."""
        return sum(len(s.effort) for s in self.stretches)

    @property
    def other_axes(self) -> tuple[str, ...]:
        """Axes whose motion every recording shows as well."""
        shared = set.intersection(*(set(s.others) for s in self.stretches))
        return tuple(sorted(name for name in shared if self._moves(name)))

    @property
    def since_reversal(self) -> Array:
        """Distance travelled since the last reversal, (n,)."""
        parts = []
        for s in self.stretches:
            travelled = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(s.motion.position)))])
            turns = np.flatnonzero(np.diff(np.sign(s.motion.velocity)) != 0) + 1
            starts = np.concatenate([[0], turns])
            last = starts[np.searchsorted(starts, s.picks, side="right") - 1]
            parts.append(travelled[s.picks] - travelled[last])
        return np.concatenate(parts)

    def extent(self, base: Array) -> Extent:
        """What the recordings reach, together; `base` are the base parameters (4,)."""
        position, velocity, acceleration = (
            np.concatenate([getattr(s.motion, name)[s.picks] for s in self.stretches])
            for name in ("position", "velocity", "acceleration")
        )
        return Extent(
            travel=float(np.ptp(position)),
            speed=float(np.max(np.abs(velocity))),
            typical_speed=float(np.sqrt(np.mean(velocity**2))),
            acceleration=float(np.sqrt(np.mean(acceleration**2))),
            effort=max(float(np.max(np.abs(s.raw_effort))) for s in self.stretches),
            resolution=max(s.position_noise for s in self.stretches) * np.sqrt(12.0),
            duration_s=max(float(s.motion.time_s[-1]) for s in self.stretches),
            cutoff_hz=max(s.cutoff_hz for s in self.stretches),
            base=base,
        )

    def _moves(self, other: str) -> bool:
        return any(np.ptp(s.others[other].position) > 0 for s in self.stretches)

    def predicted(self, axis: AxisModel) -> Array:
        """Effort that a model expects, (n,) or (D, n)."""
        return np.concatenate([s.predicted(axis) for s in self.stretches], axis=-1)


def view_of(recordings: Sequence[Recording], name: str) -> View:
    """Prepare one axis.

    Raises
    ------
    DataError
        Hardly any sample shows the axis in motion.
    """
    stretches = tuple(_stretch(recording, name) for recording in recordings)
    clear = np.concatenate([s.clear for s in stretches])
    if np.count_nonzero(clear) < _FEWEST_SAMPLES:
        raise DataError(
            f"axis {name}: only {np.count_nonzero(clear)} independent samples lie away from "
            "standstill and reversals",
            "record a longer motion, or one that turns less often",
        )
    return View(
        stretches=stretches,
        effort=np.concatenate([s.effort[s.picks] for s in stretches]),
        clear=clear,
        block=_blocks(stretches),
        standstills=scipy.linalg.block_diag(*(s.standstills for s in stretches)),
    )


def _stretch(recording: Recording, name: str) -> Stretch:
    axis = recording.axes[name]
    time_s, period_s = even_grid(recording.time_s)
    positions = {
        other: interpolate(time_s, recording.time_s, record.position)
        for other, record in recording.axes.items()
    }
    effort = interpolate(time_s, recording.time_s, axis.effort)
    widest_hz = choose_cutoff(positions[name], period_s)
    density = 2.0 * period_s * _white_noise(effort, positions[name], widest_hz, period_s) ** 2
    noise = position_noise(axis.position)
    cutoff_hz = _balanced_cutoff(positions[name], effort, noise, density, widest_hz, period_s)
    duration_s = period_s * len(time_s)
    cutoff_hz = min(cutoff_hz, _MOST_SAMPLES / (_SAMPLES_PER_CUTOFF_PERIOD * duration_s))
    # half a cut-off period: an axis that stops for a moment may not even seem to turn
    moving = ~standing(positions[name], 2.0 * cutoff_hz, period_s, 2.0 * _SMEAR_PERIODS)
    # columns are made at a rate that resolves what the filter leaves of their jumps
    stride = max(1, int(1.0 / (_COLUMN_RATE * cutoff_hz * period_s)))
    coarse_s = stride * period_s
    motions = {
        other: _smooth_motion(time_s, position, cutoff_hz, period_s, stride)
        for other, position in positions.items()
    }
    rng = np.random.default_rng(_SHAKE_SEED)
    shaken = {
        other: _smooth_motion(
            time_s,
            position + position_noise(position) * rng.standard_normal(len(position)),
            cutoff_hz,
            period_s,
            stride,
        )
        for other, position in positions.items()
    }
    shift_s = recording.effort_shift_s
    picks = _picks(moving[::stride], cutoff_hz, coarse_s)
    turns = np.flatnonzero(np.diff(np.sign(motions[name].velocity)) != 0)
    smear = int(np.ceil(_SMEAR_PERIODS / (cutoff_hz * coarse_s)))
    turning = np.zeros(len(motions[name].time_s), dtype=np.bool_)
    turning[turns] = True
    clear = ~_widened(turning, smear)[picks]
    far = ~_widened(turning | ~moving[::stride], 3 * smear)[picks]
    count = encoder_count(axis.position)
    clear &= ~_beating(motions[name], count, cutoff_hz, period_s, smear)[picks]
    return Stretch(
        motion=motions[name],
        others={other: motion for other, motion in motions.items() if other != name},
        shaken=(shaken.pop(name), shaken),
        raw_effort=effort,
        raw_period_s=period_s,
        shift_s=shift_s,
        stride=stride,
        effort=lowpass(effort, cutoff_hz, period_s, delay_s=shift_s)[::stride],
        picks=picks,
        clear=clear,
        far=far & clear,
        cutoff_hz=cutoff_hz,
        period_s=coarse_s,
        position_noise=noise,
        acceleration_noise=acceleration_noise(noise, cutoff_hz, period_s),
        effort_noise=float(np.sqrt(density * cutoff_hz)),
        filter=_filter_at(picks, len(motions[name].time_s), cutoff_hz, coarse_s),
        standstills=_standstills(moving[::stride], turns, cutoff_hz, coarse_s)[picks],
    )


def _beating(
    motion: Motion, count: float, cutoff_hz: float, period_s: float, smear: int
) -> NDArray[np.bool_]:
    """Samples (N,) near which the encoder's counts beat slowly with the sampling.

    At a speed of a whole number of counts per sample the rounding error, a tone otherwise far
    above the filter, is folded into its band; where the speed stays there for a while it looks
    like motion, and the controller answers it.
    """
    beats = np.zeros(len(motion.velocity))
    if count > 0.0:
        for harmonic in range(1, _HARMONICS + 1):
            per_sample = harmonic * np.abs(motion.velocity) * period_s / count
            folded_hz = np.abs(per_sample - np.round(per_sample)) / period_s
            sweep = harmonic * np.abs(motion.acceleration) / count
            beats += (
                (per_sample > 0.5) & (folded_hz < cutoff_hz) & (sweep < cutoff_hz**2 * _SLOW_SWEEP)
            )
    return _widened(beats > 0.5, smear)


def _widened(mask: NDArray[np.bool_], by: int) -> NDArray[np.bool_]:
    """A mask (N,) and so many samples to either side of it."""
    return np.asarray(np.convolve(mask, np.ones(2 * by + 1), "same") > 0.5)


def _filter_at(
    picks: NDArray[np.intp], samples: int, cutoff_hz: float, period_s: float
) -> scipy.sparse.csr_array:
    """What `lowpass` does, at a few samples: (n, N) sparse, with its reflection at the ends."""
    reach = min(int(_REACH_PERIODS / (cutoff_hz * period_s)), samples - 1)
    impulse = np.zeros(2 * reach + 1)
    impulse[reach] = 1.0
    kernel = lowpass(impulse, cutoff_hz, period_s)
    at = np.abs(picks[:, None] + np.arange(-reach, reach + 1))
    at = samples - 1 - np.abs(samples - 1 - at)
    rows = np.repeat(np.arange(len(picks)), len(kernel))
    entries = (np.tile(kernel, len(picks)), (rows, at.ravel()))
    return scipy.sparse.csr_array(entries, shape=(len(picks), samples))


def _standstills(
    moving: NDArray[np.bool_], turns: NDArray[np.intp], cutoff_hz: float, period_s: float
) -> Array:
    """Filtered box and ramp (N, 2 S) over each of S standstills; a pulse at each other reversal."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], ~moving, [False]]).astype(int)))
    rows = []
    for first, last in zip(edges[::2], edges[1::2], strict=True):
        margin = min(int(_SMEAR_PERIODS / (cutoff_hz * period_s)), (last - first - 1) // 2)
        inside = np.arange(first + margin, last - margin)
        for shape in (np.ones(len(inside)), np.linspace(-1.0, 1.0, len(inside))):
            row = np.zeros(len(moving))
            row[inside] = shape
            rows.append(row)
    for turn in turns[moving[turns]]:
        row = np.zeros(len(moving))
        row[turn : turn + 2] = 0.5
        rows.append(row)
    filtered = lowpass(np.array(rows).reshape(len(rows), len(moving)), cutoff_hz, period_s)
    return filtered.T


def _smooth_motion(
    time_s: Array, position: Array, cutoff_hz: float, period_s: float, stride: int
) -> Motion:
    smooth = differentiate(position, cutoff_hz, period_s)
    position, velocity, acceleration = (signal[::stride] for signal in smooth)
    return Motion.known(time_s[::stride] - time_s[0], position, velocity, acceleration)


def _balanced_cutoff(
    position: Array,
    effort: Array,
    noise: float,
    density: float,
    widest_hz: float,
    period_s: float,
) -> float:
    """Where the encoder's noise, which grows as f^2.5, is twice that of the effort, as f^0.5.

    Narrower, and of the shorter stretches between reversals nothing would be left.
    """
    columns = filtered_regressor(position, widest_hz, period_s)
    smooth = lowpass(effort, widest_hz, period_s)
    inertia = abs(float(np.linalg.lstsq(columns, smooth, rcond=None)[0][0]))
    encoder = inertia * acceleration_noise(noise, widest_hz, period_s)
    ratio = 2.0 * np.sqrt(density * widest_hz) / max(encoder, _TINY)
    return float(widest_hz * np.clip(np.sqrt(ratio), _NARROWEST, 1.0))


def _white_noise(effort: Array, position: Array, cutoff_hz: float, period_s: float) -> float:
    """Standard deviation of white noise in the effort, from what its highest frequencies leave.

    A controller answers the rounding of its encoder, and that answer is no noise: it really
    drives the axis. The recorded position holds the same rounding, so what follows from it by a
    short linear filter is taken off first.
    """
    above_hz = min(max(3.0 * cutoff_hz, 0.05 / period_s), 0.25 / period_s)
    high = [x - lowpass(x, above_hz, period_s) for x in (effort, position)]
    lags = np.arange(-_LAGS // 4, _LAGS)
    inside = slice(_LAGS, -_LAGS)
    answers = np.stack([np.roll(high[1], lag)[inside] for lag in lags], axis=1)
    scale = max(float(np.max(np.abs(answers))), _TINY)
    answer = answers @ np.linalg.lstsq(answers / scale, high[0][inside], rcond=1e-8)[0] / scale
    left = high[0][inside] - answer
    # jumps of friction reach up here as well, but only now and then
    deviation = float(np.median(np.abs(left))) / _MEDIAN_OF_NORMAL
    return deviation / np.sqrt(1.0 - 2.0 * above_hz * period_s)


def _picks(moving: NDArray[np.bool_], cutoff_hz: float, period_s: float) -> NDArray[np.intp]:
    samples = len(moving)
    step = max(1, int(1.0 / (_SAMPLES_PER_CUTOFF_PERIOD * cutoff_hz * period_s)))
    margin = min(int(1.0 / (cutoff_hz * period_s)), samples // 20)
    picks = np.arange(margin, samples - margin, step)
    return np.asarray(picks[moving[picks]])


def _blocks(stretches: tuple[Stretch, ...]) -> NDArray[np.intp]:
    """Consecutive blocks, at most forty in a recording, longer than the filter's memory."""
    numbers: list[NDArray[np.intp]] = []
    first = 0
    for s in stretches:
        time_s = s.picks * s.period_s
        span = max((time_s[-1] - time_s[0]) / _BLOCKS, _BLOCK_PERIODS / s.cutoff_hz)
        number = ((time_s - time_s[0]) / span).astype(np.intp) + first
        numbers.append(number)
        first = int(number[-1]) + 1
    return np.concatenate(numbers)
