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
from edge_ident.signals.conditioning import SAMPLES_PER_CUTOFF_PERIOD, choose_cutoff, position_noise
from edge_ident.signals.recording import AxisRecord, Recording
from edge_ident.signals.time_stamps import EvenGrid, with_mended_stamps

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
