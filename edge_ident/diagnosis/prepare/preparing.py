"""From recordings to what the diagnosis sees of one axis."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Final

import numpy as np
import scipy.sparse
import scipy.special
from numpy.typing import NDArray

from edge_ident.diagnosis.prepare.bandwidth import Band, judged_band, white_noise
from edge_ident.diagnosis.prepare.masks import (
    SMEAR_PERIODS,
    beating,
    reversals,
    tapered,
    undecided,
    widened,
)
from edge_ident.diagnosis.prepare.view import Stretch, View, judged
from edge_ident.errors import DataError
from edge_ident.model.effect import Motion
from edge_ident.signals.conditioning import (
    SAMPLES_PER_CUTOFF_PERIOD,
    acceleration_noise,
    choose_cutoff,
    decimated,
    encoder_count,
    position_noise,
)
from edge_ident.signals.filters import differentiate, lowpass
from edge_ident.signals.recording import Recording
from edge_ident.signals.resampling import EvenGrid

Array = NDArray[np.float64]

_MOST_SAMPLES: Final = 1500
"""Independent samples beyond which more bandwidth tells little and costs much time."""
_FEWEST_SAMPLES: Final = 40
"""Twice the parameters of the base model and a few causes."""
_MOTION_BAND: Final = 2.0
"""Bandwidth of the motion over that of what is judged. One as narrow would turn and stop at other
moments than the axis; a wider one brings noise that tapering folds into the band."""
_TAPER_PERIODS: Final = 0.4
"""Cut-off periods in which effort and columns fade out before what is unknown, and in again."""
_WIDEST: Final = 0.2
"""Of the sampling rate."""
_COLUMN_RATE: Final = 6.0
"""Samples per period of the motion's cut-off at which columns are made."""
_RUN_IN: Final = 0.1
"""Of the travel; what builds up over a longer way is not looked for."""
_LEAST_SLIDING: Final = 0.5
"""Share of what the filter passes at a sample that must be of sliding."""
_BEAT: Final = 2.0 / np.pi
"""Of a count: twice the first harmonic of a rounding error, as the controller answers it, too."""
_BLOCKS: Final = 40
_BLOCK_PERIODS: Final = 4.0
"""A block is at least so many cut-off periods long."""
_REACH_PERIODS: Final = 4.0
"""Cut-off periods after which the filter's response is below a ten-thousandth."""
_WHITENING_REACH: Final = 2.0
"""The same in periods of the knee, of the whitening."""
_SHAKE_SEED: Final = 1
_TINY: Final = float(np.finfo(float).tiny)


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
    )


def _stretch(recording: Recording, name: str) -> Stretch:
    axis = recording.axes[name]
    grid = EvenGrid.of(recording.time_s)
    time_s, period_s = grid.time_s, grid.period_s
    positions = {other: grid.resampled(record.position) for other, record in recording.axes.items()}
    effort = grid.resampled(axis.effort)
    widest_hz = choose_cutoff(positions[name], period_s)
    density = 2.0 * period_s * white_noise(effort, positions[name], widest_hz, period_s) ** 2
    noise = position_noise(axis.position)
    band = judged_band(positions[name], effort, noise, density, widest_hz, period_s)
    most_hz = _MOST_SAMPLES / (SAMPLES_PER_CUTOFF_PERIOD * period_s * len(time_s))
    band = replace(band, cutoff_hz=min(band.cutoff_hz, most_hz))
    cutoff_hz = band.cutoff_hz
    motion_hz = min(_MOTION_BAND * cutoff_hz, _WIDEST / period_s)
    stride = max(1, int(1.0 / (_COLUMN_RATE * motion_hz * period_s)))
    coarse_s = stride * period_s
    motions = {
        other: _smooth_motion(time_s, position, motion_hz, period_s, stride)
        for other, position in positions.items()
    }
    rng = np.random.default_rng(_SHAKE_SEED)
    shaken = {
        other: _smooth_motion(
            time_s,
            position + position_noise(position) * rng.standard_normal(len(position)),
            motion_hz,
            period_s,
            stride,
        )
        for other, position in positions.items()
    }
    noise_of_speed = {
        other: float(np.std(shaken[other].velocity - motions[other].velocity)) for other in motions
    }
    shift_s = recording.effort_shift_s
    unknown = undecided(positions[name], noise, cutoff_hz, period_s)
    known = 1.0 - tapered(unknown, _TAPER_PERIODS / (cutoff_hz * period_s))[::stride]
    columns = np.arange(len(known)) * stride
    sliding = np.interp(np.arange(len(time_s)), columns, known)
    picks = decimated(len(known), cutoff_hz, coarse_s)
    picks = picks[lowpass(sliding, cutoff_hz, period_s)[columns][picks] > _LEAST_SLIDING]
    picks = picks[picks >= _run_in(motions[name].position)]
    judged_motion = _smooth_motion(time_s, positions[name], cutoff_hz, period_s, stride)
    turns = reversals(judged_motion)
    turning = known < 0.5
    turning[turns] = True
    smear = int(np.ceil(SMEAR_PERIODS / (cutoff_hz * coarse_s)))
    count = encoder_count(axis.position)
    clear = ~beating(judged_motion, count, cutoff_hz, period_s, smear)[picks]
    far = ~widened(turning, 3 * smear)[picks]
    return Stretch(
        motion=motions[name],
        others=_others(motions, noise_of_speed, name),
        shaken=(shaken[name], _others(shaken, noise_of_speed, name)),
        raw_effort=effort,
        raw_period_s=period_s,
        shift_s=shift_s,
        stride=stride,
        turns=turns,
        sliding=sliding,
        effort=judged(effort, sliding, band, period_s, shift_s)[::stride],
        picks=picks,
        clear=clear,
        far=far & clear,
        band=band,
        period_s=coarse_s,
        beat=_BEAT * count * band.swing,
        position_noise=noise,
        acceleration_noise=acceleration_noise(noise, cutoff_hz, period_s),
        effort_noise=float(np.sqrt(density * cutoff_hz)),
        filter=_filter_at(picks, known, band, coarse_s),
    )


def _run_in(position: Array) -> int:
    """First sample at which an axis is far from where it began: what its friction and its play
    remember of the time before the record is over then."""
    return int(np.argmax(np.abs(position - position[0]) > _RUN_IN * np.ptp(position)))


def _filter_at(
    picks: NDArray[np.intp], known: Array, band: Band, period_s: float
) -> scipy.sparse.csr_array:
    """What a band passes of what is known, at a few samples: (n, N) sparse, ends reflected."""
    samples = len(known)
    reach_s = max(_REACH_PERIODS / band.cutoff_hz, _WHITENING_REACH / band.knee_hz)
    reach = min(int(reach_s / period_s), samples - 1)
    impulse = np.zeros(2 * reach + 1)
    impulse[reach] = 1.0
    kernel = band.lowpass(impulse, period_s)
    at = np.abs(picks[:, None] + np.arange(-reach, reach + 1))
    at = samples - 1 - np.abs(samples - 1 - at)
    rows = np.repeat(np.arange(len(picks)), len(kernel))
    entries = (np.tile(kernel, len(picks)) * known[at.ravel()], (rows, at.ravel()))
    return scipy.sparse.csr_array(entries, shape=(len(picks), samples))


def _smooth_motion(
    time_s: Array, position: Array, cutoff_hz: float, period_s: float, stride: int
) -> Motion:
    smooth = differentiate(position, cutoff_hz, period_s)
    position, velocity, acceleration = (signal[::stride] for signal in smooth)
    return Motion.known(time_s[::stride] - time_s[0], position, velocity, acceleration)


def _others(
    motions: Mapping[str, Motion], noise_of_speed: Mapping[str, float], name: str
) -> dict[str, Motion]:
    """The other axes' motions, with the direction to be expected of a velocity with noise: a
    source that turns or sticks slides in neither."""
    expected = {}
    for other, motion in motions.items():
        if other != name:
            sure = motion.velocity / max(np.sqrt(2.0) * noise_of_speed[other], _TINY)
            expected[other] = replace(motion, direction=scipy.special.erf(sure))
    return expected


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
