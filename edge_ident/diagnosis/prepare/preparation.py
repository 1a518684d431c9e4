"""From recordings to the prepared data of one axis."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import pairwise, takewhile
from typing import Final

import numpy as np
import scipy.special
from numpy.typing import NDArray

from edge_ident.diagnosis.prepare.axis_data import AxisData, Segment, filter_at, filtered_effort
from edge_ident.diagnosis.prepare.bandwidth import (
    LEAST_WEIGHT,
    SMEAR_PERIODS,
    TURN_NOISE,
    Band,
    Mask,
    aliasing_mask,
    comparison_band,
    direction_weight,
    fast_effort,
    longer_or_faster,
    reversals,
    run_in,
    tone_count,
    turning_points,
    unknown_directions,
    white_noise,
)
from edge_ident.diagnosis.prepare.sampled import Sampled
from edge_ident.diagnosis.prepare.timing import in_time
from edge_ident.errors import DataError
from edge_ident.estimation.trust import Finding
from edge_ident.model.motion import Motion
from edge_ident.signals.conditioning import (
    SAMPLES_PER_CUTOFF_PERIOD,
    acceleration_noise,
    choose_cutoff,
    decimated,
    encoder_count,
    position_noise,
    widened,
)
from edge_ident.signals.filters import differentiate, lowpass
from edge_ident.signals.metrics import rms
from edge_ident.signals.recording import AxisRecord, Recording
from edge_ident.signals.time_stamps import EvenGrid, with_mended_stamps

Array = NDArray[np.float64]


FEWEST_SAMPLES: Final = 40
"""Twice the parameters of the base model and a few causes."""
_REGRESSOR_RATE: Final = 6.0
"""Samples per period of the motion's cut-off at which regressors are computed."""
_MOVED: Final = 0.99
"""Share of the power of the velocity up to the highest frequency of the motion."""
_BEYOND_MOTION: Final = 4.0
"""Bandwidth of the motion over the highest frequency in it, which is then attenuated by 1e-5. Twice
that frequency would take 0.4 % off, which the inertia makes up for."""
_ALIASED: Final = 2.0 / np.pi
"""Amplitude, in encoder counts, that aliasing can reach: twice the first harmonic of the rounding
error, because the controller answers it."""
_ANSWERED: Final = 2.0
"""Amplitude that aliasing can reach, of the effort above the band: at other speeds the controller's
answer to the rounding is there, and is no larger."""
_BLOCKS: Final = 40
"""Blocks of time in a recording."""
_BLOCK_PERIODS: Final = 4.0
"""Shortest block, in cut-off periods: longer than the filter's memory."""
_TINY: Final = float(np.finfo(float).tiny)


class TooShortError(DataError):
    """Some of several recordings show nothing of an axis, the others do.

    Attributes
    ----------
    places : tuple of int
        Of those recordings.
    """

    def __init__(self, message: str, next_step: str, places: tuple[int, ...]) -> None:
        super().__init__(message, next_step)
        self.places = places


def prepare_axis(recordings: Sequence[Recording], name: str, *, timed: bool = True) -> AxisData:
    """Prepare one axis.

    Its effort is brought in step with its motion, unless it is too late for that.

    Parameters
    ----------
    timed : bool
        False leaves the effort where it is: a delay in a known model accounts for its timing.

    Raises
    ------
    DataError
        Hardly any sample shows the axis in motion; `TooShortError` where some recordings
        show it in none.
    """
    clocked = zip(recordings, _clocks(recordings), strict=True)
    recorded = [_segment(each, name, clock) for each, clock in clocked]
    _check_enough(name, recorded)
    segments, late_s = in_time(recorded, move=timed)
    _check_enough(name, segments)
    return AxisData(
        segments=segments,
        effort=np.concatenate([s.effort[s.sample_index] for s in segments]),
        valid=np.concatenate([s.valid for s in segments]),
        block=_blocks(segments),
        late_s=late_s,
        turning=frozenset.intersection(*(r.turning for r in recordings)),
    )


def _check_enough(name: str, segments: Sequence[Segment]) -> None:
    valid = sum(np.count_nonzero(s.valid) for s in segments)
    empty = tuple(k for k, s in enumerate(segments) if not len(s.sample_index))
    if valid >= FEWEST_SAMPLES and not empty:
        return
    message = (
        f"axis {name}: only {valid} independent samples lie away from standstill and reversals, in "
        f"a band up to {segments[0].cutoff_hz:.2g} Hz"
    )
    next_step = longer_or_faster(1.0 / segments[0].raw_period_s)
    if valid >= FEWEST_SAMPLES:
        raise TooShortError(message, next_step, empty)
    raise DataError(message, next_step)


def _clocks(recordings: Sequence[Recording]) -> list[int]:
    """Numbers of the clocks of recordings: one that begins before the last ended has another."""
    clocks = [0]
    for last, following in pairwise(recordings):
        ended_s = last.begin_s + float(last.time_s[-1] - last.time_s[0])
        clocks.append(clocks[-1] + (following.begin_s < ended_s))
    return clocks


def _segment(recording: Recording, name: str, clock: int) -> Segment:
    raw, late_s = Sampled.of(recording, name, clock), recording.effort_shift_s
    count, noise = _noise(raw, recording, name)
    widest_hz = choose_cutoff(raw.position, raw.period_s, raw.noises[name])
    band, motion_hz, density = _band(raw, noise, widest_hz)
    stride = max(1, int(1.0 / (_REGRESSOR_RATE * motion_hz * raw.period_s)))
    period_s = stride * raw.period_s
    motions, replicas = raw.motions(motion_hz, stride)
    reversing, known, weight = _direction(raw, motions[name], noise, band, stride)
    start_index, sample_index = _compared(known, weight, band, motions[name], raw, stride)
    narrow = raw.motion(raw.position, max(band.cutoff_hz, 0.5 * motion_hz), stride)
    turns, valid, far = _masks(narrow, known, count, band, (period_s, raw.period_s), sample_index)
    return Segment(
        motion=motions[name],
        others=_others(motions, motions, replicas, name),
        listed=_listed(recording, name),
        noise_replica=(replicas[name], _others(replicas, motions, replicas, name)),
        motion_hz=motion_hz,
        raw_effort=raw.effort,
        raw_period_s=raw.period_s,
        shift_s=late_s,
        timing_hz=widest_hz,
        stride=stride,
        turns=turns,
        direction_weight=weight,
        reversing=reversing,
        effort=filtered_effort(raw.effort, weight, band, raw.period_s, late_s)[::stride],
        start_index=start_index,
        sample_index=sample_index,
        valid=valid,
        far=far,
        band=band,
        period_s=period_s,
        aliased_acceleration=_ALIASED * count * band.acceleration_gain,
        aliased_effort=_ANSWERED * fast_effort(raw.effort, band.cutoff_hz, raw.period_s),
        position_noise=noise,
        acceleration_noise=acceleration_noise(noise, band.cutoff_hz, raw.period_s),
        effort_noise=float(np.sqrt(density * band.cutoff_hz)),
        filter=filter_at(sample_index, known, band, period_s),
    )


def _listed(recording: Recording, name: str) -> tuple[frozenset[str], frozenset[str]]:
    """Axes with a drive that a recording lists before and after this one."""
    earlier = frozenset(takewhile(lambda axis: axis != name, recording.axes))
    return earlier, frozenset(recording.axes) - earlier - {name}


def _band(raw: Sampled, noise: float, widest_hz: float) -> tuple[Band, float, float]:
    """The band of the comparison, the bandwidth of the motion, and the power density of the effort
    noise per Hz."""
    deviation = white_noise(raw.effort, raw.position, widest_hz, raw.period_s)
    density = 2.0 * raw.period_s * deviation**2
    seen = comparison_band(raw.position, raw.effort, noise, density, widest_hz, raw.period_s)
    affordable_hz = most_hz(raw.period_s * len(raw.time_s))
    band = replace(seen, cutoff_hz=min(seen.cutoff_hz, affordable_hz))
    return band, _motion_hz(raw, seen, band), density


def _motion_hz(raw: Sampled, seen: Band, band: Band) -> float:
    """Bandwidth of the motion behind the regressors.

    A band that is narrow because the record is long does not narrow the motion: what moves faster
    is in the effort, and the direction of motion depends on it.
    """
    narrow_hz, widest_hz = band.motion_hz(raw.period_s), seen.motion_hz(raw.period_s)
    if narrow_hz >= widest_hz:
        return widest_hz
    _, velocity, _ = differentiate(raw.position, seen.cutoff_hz, raw.period_s)
    power = np.cumsum(np.abs(np.fft.rfft(velocity)) ** 2)
    moved_hz = int(np.searchsorted(power, _MOVED * power[-1])) / (raw.period_s * len(velocity))
    return min(max(narrow_hz, _BEYOND_MOTION * moved_hz), widest_hz)


def _noise(raw: Sampled, recording: Recording, name: str) -> tuple[float, float]:
    """The encoder's count, 0 without a tone, and the standard deviation of its noise."""
    count = encoder_count(recording.axes[name].position)
    noise = max(raw.noises[name], count / np.sqrt(12.0))
    return tone_count(count, noise), noise


def _direction(
    raw: Sampled, motion: Motion, noise: float, band: Band, stride: int
) -> tuple[Mask, Array, Array]:
    """Samples whose direction is unknown, short rests aside. Then weights from 0, where it is
    unknown with them, to 1: every stride-th sample, and all.

    Both are the same smooth curve. A coarser one on the effort than on its regressor is a
    difference that changes with the speed, as a shift does.
    """
    turns = stride * reversals(motion)
    speed = rms(motion.velocity)
    reversing, rests = unknown_directions(
        raw.position, turns, noise, speed, band.cutoff_hz, raw.period_s
    )
    reversing |= raw.unknown
    weight = direction_weight(reversing | rests, band.cutoff_hz, raw.period_s)
    return reversing, weight[::stride], weight


def _compared(
    known: Array, weight: Array, band: Band, motion: Motion, raw: Sampled, stride: int
) -> list[NDArray[np.intp]]:
    """Samples, decimated, of known direction: those at the start, and those that are compared."""
    at = np.arange(len(known)) * stride
    index = decimated(len(known), band.cutoff_hz, stride * raw.period_s)
    passed = lowpass(weight, band.cutoff_hz, raw.period_s)[at]
    index = index[passed[index] > LEAST_WEIGHT]
    return np.split(index, [np.searchsorted(index, run_in(motion.position))])


def _masks(
    motion: Motion,
    known: Array,
    count: float,
    band: Band,
    periods_s: tuple[float, float],
    sample_index: NDArray[np.intp],
) -> tuple[NDArray[np.intp], NDArray[np.bool_], NDArray[np.bool_]]:
    """Reversals; the valid samples; and of those the ones far from reversal and standstill.

    Rounding aliases at the sampling rate of the recording; the motion may have fewer samples.
    """
    period_s, recorded_s = periods_s
    turns = reversals(motion)
    turning = known < 0.5
    turning[turns] = True
    smear = int(np.ceil(SMEAR_PERIODS / (band.cutoff_hz * period_s)))
    aliased = aliasing_mask(motion, count, band.cutoff_hz, recorded_s, smear)
    valid = ~aliased[sample_index]
    far = ~widened(turning, 3 * smear)[sample_index]
    return turns, valid, far & valid


def _others(
    seen: Mapping[str, Motion],
    motions: Mapping[str, Motion],
    replicas: Mapping[str, Motion],
    name: str,
) -> dict[str, Motion]:
    """Motions of the other axes, with the expected direction of a noisy velocity.

    An axis that reverses or rests moves in neither direction. The replicas tell the noise.
    """
    expected = {}
    for other, motion in seen.items():
        if other != name:
            noise = float(np.std(replicas[other].velocity - motions[other].velocity))
            sure = motion.velocity / max(np.sqrt(2.0) * noise, _TINY)
            expected[other] = replace(motion, direction=scipy.special.erf(sure))
    return expected


def _blocks(segments: tuple[Segment, ...]) -> NDArray[np.intp]:
    """Numbers of consecutive blocks of time, (n,)."""
    numbers: list[NDArray[np.intp]] = []
    first = 0
    for s in segments:
        time_s = s.sample_index * s.period_s
        span = max((time_s[-1] - time_s[0]) / _BLOCKS, _BLOCK_PERIODS / s.cutoff_hz)
        number = ((time_s - time_s[0]) / span).astype(np.intp) + first
        numbers.append(number)
        first = int(number[-1]) + 1
    return np.concatenate(numbers)


# Long recordings in parts: a whole one would leave too narrow a band.
#
# The number of samples that are compared is limited, so the band narrows with the length of a
# recording. Below a few periods between two reversals hardly a sample is left whose direction is
# known, and what friction does at a reversal lies above the band, where it looks like an order. So
# of a recording that is too long for its motion, parts are taken from the beginning, the middle and
# the end. They have one clock, and what changes in the course of time shows in them.

_MOST_SAMPLES: Final = 1500
"""Independent samples in a recording, or in a part of one; a wider band adds little information and
much time."""
_PARTS: Final = 3
_PERIODS_PER_STROKE: Final = 1.5
"""Fewest periods of the cut-off from one reversal to the next, on average: the weight of the
direction fades over 0.4 at both of its ends."""
_TOGETHER: Final = 2.0
"""Least that the band may narrow for a recording to be taken in parts: together they are at most
half of it, because to leave out less is not worth it."""


def most_hz(duration_s: float) -> float:
    """Cut-off of the comparison of a recording, at most."""
    return _MOST_SAMPLES / (SAMPLES_PER_CUTOFF_PERIOD * duration_s)


def as_diagnosed(recordings: Sequence[Recording], name: str) -> list[Recording]:
    """Recordings as a diagnosis of an axis takes them: with mended stamps, and long ones in
    parts."""
    return in_parts([with_mended_stamps(each) for each in recordings], name)[0]


def in_parts(
    recordings: Sequence[Recording], name: str
) -> tuple[list[Recording], list[int], list[Finding]]:
    """Recordings in which an axis is driven, in parts where one is too long for its motion; the
    place of each among all recordings; and which are in parts."""
    parts, places, findings = [], [], []
    for place, recording in enumerate(recordings):
        if name in recording.axes:
            taken = _parts(recording, name)
            parts += taken
            places += [place] * len(taken)
            findings += _findings(recording, taken)
    return parts, places, findings


def _parts(recording: Recording, name: str) -> list[Recording]:
    """Parts of a recording that is too long for the motion of an axis; otherwise itself.

    The parts have the same number of reversals, so none of them lies in a rest or in a gap.
    """
    grid, duration_s = EvenGrid.of(recording.time_s), float(np.ptp(recording.time_s))
    position = grid.resampled(recording.axes[name].position)
    noise = position_noise(position)
    widest_hz = choose_cutoff(position, grid.period_s, noise)
    affordable_hz = most_hz(duration_s)
    if affordable_hz >= widest_hz:
        return [recording]
    turns = turning_points(position, TURN_NOISE * noise)
    wanted_hz = min(widest_hz, _TOGETHER * _PERIODS_PER_STROKE * len(turns) / duration_s)
    if wanted_hz < _TOGETHER * affordable_hz:
        return [recording]
    strokes = int(len(turns) * affordable_hz / wanted_hz / _PARTS)
    firsts = np.linspace(0, len(turns) - 1 - strokes, _PARTS).astype(np.intp)
    ends_s = [(grid.time_s[turns[first]], grid.time_s[turns[first + strokes]]) for first in firsts]
    return [_part(recording, float(begin_s), float(end_s)) for begin_s, end_s in ends_s]


def _findings(recording: Recording, parts: Sequence[Recording]) -> list[Finding]:
    """That parts of a recording were taken, in words."""
    if len(parts) < _PARTS:
        return []
    looked_s = sum(float(np.ptp(part.time_s)) for part in parts)
    return [
        Finding(
            "in_parts",
            f"{recording.source}: {looked_s:.3g} s of {np.ptp(recording.time_s):.3g} s were looked "
            f"at, in {_PARTS} parts, because a longer record of a motion that reverses so often "
            "leaves too narrow a band",
            "to look at another part, give it as a recording of its own",
            blocks=False,
        )
    ]


def _part(recording: Recording, begin_s: float, end_s: float) -> Recording:
    first, last = np.searchsorted(recording.time_s, [begin_s, end_s])
    rows, start_s = slice(int(first), int(last)), float(recording.time_s[0])
    return replace(
        recording,
        time_s=recording.time_s[rows],
        axes={name: _rows(axis, rows) for name, axis in recording.axes.items()},
        passive={
            name: replace(axis, position=axis.position[rows])
            for name, axis in recording.passive.items()
        },
        source=f"{recording.source}, {begin_s - start_s:.4g} to {end_s - start_s:.4g} s",
        begin_s=recording.begin_s + float(recording.time_s[first]) - start_s,
    )


def _rows(axis: AxisRecord, rows: slice) -> AxisRecord:
    reference, velocity, temperature_c = (
        None if column is None else column[rows]
        for column in (axis.reference, axis.velocity, axis.temperature_c)
    )
    return replace(
        axis,
        position=axis.position[rows],
        effort=axis.effort[rows],
        reference=reference,
        velocity=velocity,
        temperature_c=temperature_c,
    )
