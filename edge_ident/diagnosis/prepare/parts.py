"""Long recordings in parts: a whole one would leave too narrow a band.

The number of samples that are compared is limited, so the band narrows with the length of a
recording. Below a few periods between two reversals hardly a sample is left whose direction is
known, and what friction does at a reversal lies above the band, where it looks like an order. So of
a recording that is too long for its motion, parts are taken from the beginning, the middle and the
end. They have one clock, and what changes in the course of time shows in them.
"""

from collections.abc import Sequence
from dataclasses import replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from edge_ident.diagnosis.prepare.masks import TURN_NOISE, turning_points
from edge_ident.estimation.trust import Finding
from edge_ident.signals.conditioning import SAMPLES_PER_CUTOFF_PERIOD, choose_cutoff
from edge_ident.signals.encoder import encoder_count, position_noise
from edge_ident.signals.filters import differentiate
from edge_ident.signals.recording import AxisRecord, Recording
from edge_ident.signals.resampling import EvenGrid

Array = NDArray[np.float64]

MOST_SAMPLES: Final = 1500
"""Independent samples in a recording; a wider band adds little information and much time."""
_PARTS: Final = 3
_PERIODS_PER_STROKE: Final = 1.5
"""Fewest periods of the cut-off from one reversal to the next, on average: the weight of the
direction fades over 0.4 at both of its ends."""
_IN_PARTS: Final = 2.0
"""The band of parts over the least that a whole recording may have."""
_MOVED: Final = 0.99
"""Share of the power of the velocity that is in the motion's band."""
_BEYOND_MOTION: Final = 2.0
"""Least cut-off over the highest frequency of the motion."""


def most_hz(duration_s: float) -> float:
    """Cut-off of the comparison of a recording, at most."""
    return MOST_SAMPLES / (SAMPLES_PER_CUTOFF_PERIOD * duration_s)


def in_parts(recordings: Sequence[Recording], name: str) -> list[Recording]:
    """Recordings, those that are too long for the motion of an axis in parts."""
    return [part for recording in recordings for part in _parts(recording, name)]


def part_findings(recordings: Sequence[Recording], parts: Sequence[Recording]) -> list[Finding]:
    """That parts of recordings were taken, in words."""
    if len(parts) == len(recordings):
        return []
    looked_s, whole_s = (
        sum(float(np.ptp(each.time_s)) for each in every) for every in (parts, recordings)
    )
    return [
        Finding(
            "in_parts",
            f"{looked_s:.3g} s of {whole_s:.3g} s were looked at, in {len(parts)} parts: a longer "
            "record of a motion that reverses so often leaves too narrow a band",
            "give the part that matters as a recording of its own to look at another one",
            blocks=False,
        )
    ]


def _parts(recording: Recording, name: str) -> list[Recording]:
    grid, duration_s = EvenGrid.of(recording.time_s), float(np.ptp(recording.time_s))
    position = grid.resampled(recording.axes[name].position)
    noise = position_noise(position, encoder_count(position))
    widest_hz = choose_cutoff(position, grid.period_s, noise)
    affordable_hz = most_hz(duration_s)
    if affordable_hz >= widest_hz:
        return [recording]
    least_hz = _least_hz(position, noise, widest_hz, grid.period_s)
    if affordable_hz >= least_hz:
        return [recording]
    length_s = MOST_SAMPLES / (SAMPLES_PER_CUTOFF_PERIOD * min(widest_hz, _IN_PARTS * least_hz))
    length_s /= _PARTS
    begins_s = recording.time_s[0] + np.linspace(0.0, duration_s - length_s, _PARTS)
    return [_part(recording, float(begin_s), length_s) for begin_s in begins_s]


def _least_hz(position: Array, noise: float, widest_hz: float, period_s: float) -> float:
    """Cut-off that a motion needs."""
    _, velocity = differentiate(position, widest_hz, period_s, orders=(0, 1))
    power = np.cumsum(np.abs(np.fft.rfft(velocity - np.mean(velocity))) ** 2)
    moved_hz = np.searchsorted(power, _MOVED * power[-1]) / (period_s * len(velocity))
    turns = turning_points(position, TURN_NOISE * noise)
    strokes_hz = len(turns) / (period_s * len(velocity))
    return float(max(_BEYOND_MOTION * moved_hz, _PERIODS_PER_STROKE * strokes_hz))


def _part(recording: Recording, begin_s: float, length_s: float) -> Recording:
    first, last = np.searchsorted(recording.time_s, [begin_s, begin_s + length_s])
    rows = slice(int(first), int(last))
    start_s = begin_s - float(recording.time_s[0])
    return replace(
        recording,
        time_s=recording.time_s[rows],
        axes={name: _rows(axis, rows) for name, axis in recording.axes.items()},
        source=f"{recording.source}, {start_s:.4g} to {start_s + length_s:.4g} s",
        begin_s=recording.begin_s + float(recording.time_s[rows.start] - recording.time_s[0]),
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
