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

from edge_ident.diagnosis.prepare.masks import TURN_NOISE, turning_points
from edge_ident.estimation.trust import Finding
from edge_ident.signals.conditioning import SAMPLES_PER_CUTOFF_PERIOD, choose_cutoff
from edge_ident.signals.encoder import encoder_count, position_noise
from edge_ident.signals.recording import AxisRecord, Recording
from edge_ident.signals.resampling import EvenGrid

_MOST_SAMPLES: Final = 1500
"""Independent samples in a recording; a wider band adds little information and much time."""
_PARTS: Final = 3
_PERIODS_PER_STROKE: Final = 1.5
"""Fewest periods of the cut-off from one reversal to the next, on average: the weight of the
direction fades over 0.4 at both of its ends."""
_IN_PARTS: Final = 2.0
"""The band of parts over the least that a whole recording may have. Together they are at most half
of it: to leave out less is not worth it."""


def most_hz(duration_s: float) -> float:
    """Cut-off of the comparison of a recording, at most."""
    return _MOST_SAMPLES / (SAMPLES_PER_CUTOFF_PERIOD * duration_s)


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
    strokes_hz = len(turning_points(position, TURN_NOISE * noise)) / duration_s
    wanted_hz = min(widest_hz, _IN_PARTS * _PERIODS_PER_STROKE * strokes_hz)
    if wanted_hz < _IN_PARTS * affordable_hz:
        return [recording]
    length_s = duration_s * affordable_hz / wanted_hz / _PARTS
    begins_s = recording.time_s[0] + np.linspace(0.0, duration_s - length_s, _PARTS)
    return [_part(recording, float(begin_s), length_s) for begin_s in begins_s]


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
