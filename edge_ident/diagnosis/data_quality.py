"""Defects of the data: gaps, uneven sampling, clipped efforts, doubtful units."""

from collections.abc import Iterable, Sequence
from dataclasses import replace

import numpy as np

from edge_ident.diagnosis.result import DataFinding
from edge_ident.signals.recording import AxisRecord, Recording
from edge_ident.signals.scale_checks import check_scale
from edge_ident.signals.time_stamps import (
    GAP,
    EvenGrid,
    clipped,
    even_rows_sentence,
    lost_rows_sentence,
)


def data_findings(recordings: Sequence[Recording], axes: Iterable[str]) -> tuple[DataFinding, ...]:
    """Find the defects of the data, each once.

    Parameters
    ----------
    recordings : sequence of Recording
        Of several, the findings say which.
    axes : iterable of str
        Names of the axes to check.
    """
    found = [
        replace(finding, message=f"{recording.source}: {finding.message}")
        if len(recordings) > 1
        else finding
        for recording in recordings
        for name in axes
        if name in recording.axes
        for finding in _of_axis(recording, name)
    ]
    return tuple(dict.fromkeys(found))


def _of_axis(recording: Recording, name: str) -> list[DataFinding]:
    return [
        *_timing(recording, name),
        *_clipping(recording.axes[name], name),
        *_units(recording, name),
    ]


def _timing(recording: Recording, name: str) -> list[DataFinding]:
    found = []
    if recording.stamp_jitter:
        message = even_rows_sentence(recording.stamp_jitter)
        found.append(DataFinding("jittering_stamps", name, message))
    if recording.lost_rows:
        message = lost_rows_sentence(recording.lost_rows)
        found.append(DataFinding("lost_rows", name, message))
    if found:
        return [*found, *_gaps(recording, name)]
    return _gaps(recording, name) or _uneven(recording, name)


def _gaps(recording: Recording, name: str) -> list[DataFinding]:
    steps = np.diff(recording.time_s)
    gaps = int(np.count_nonzero(steps > GAP * np.median(steps)))
    if gaps:
        longest = float(np.max(steps))
        what = "a gap of" if gaps == 1 else f"{gaps} gaps of up to"
        were = "was" if gaps == 1 else "were"
        message = f"{what} {longest:.3g} s in the time stamps {were} bridged"
        return [DataFinding("gaps", name, message)]
    return []


def _uneven(recording: Recording, name: str) -> list[DataFinding]:
    grid = EvenGrid.of(recording.time_s)
    if grid.uneven:
        message = (
            f"time stamps are up to {grid.jitter:.2g} periods off an even grid; samples "
            "were interpolated"
        )
        return [DataFinding("uneven_sampling", name, message)]
    return []


def _clipping(axis: AxisRecord, name: str) -> list[DataFinding]:
    share = float(np.mean(clipped(axis.effort)))
    if not share:
        return []
    low, high = float(np.min(axis.effort)), float(np.max(axis.effort))
    message = (
        f"{share:.1%} of the samples have exactly the highest or lowest effort ({low:.4g} to "
        f"{high:.4g} {axis.effort_unit}): the effort is clipped there, and these samples are left "
        "out; record with a larger range, or a gentler motion"
    )
    return [DataFinding("clipped", name, message)]


def _units(recording: Recording, name: str) -> list[DataFinding]:
    """Questions that a recording raises and cannot answer."""
    return [
        DataFinding(question.code, name, f"{question.message} {_sentence(question.next_step)}")
        for question in check_scale(recording, name)
    ]


def _sentence(text: str) -> str:
    return text[0].upper() + text[1:]
