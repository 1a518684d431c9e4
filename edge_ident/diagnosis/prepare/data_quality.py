"""Defects of the data: gaps, uneven sampling, clipped efforts."""

from collections.abc import Iterable, Sequence
from typing import Final

import numpy as np

from edge_ident.diagnosis.result import DataFinding
from edge_ident.signals.recording import AxisRecord, Recording
from edge_ident.signals.resampling import EvenGrid

_GAP: Final = 3.0
"""Sampling periods between two samples, from which samples are missing."""
_AT_PEAK: Final = 0.005
"""Share of a record at exactly its highest or lowest effort, from which it is clipped."""


def data_findings(recordings: Sequence[Recording], axes: Iterable[str]) -> tuple[DataFinding, ...]:
    """Find the defects of the data, each once.

    Parameters
    ----------
    recordings : sequence of Recording
    axes : iterable of str
        Names of the axes to check.
    """
    found = []
    for recording in recordings:
        for name in axes:
            found += _timing(recording, name)
            found += _clipping(recording.axes[name], name)
    return tuple(dict.fromkeys(found))


def _timing(recording: Recording, name: str) -> list[DataFinding]:
    steps = np.diff(recording.time_s)
    gaps = int(np.count_nonzero(steps > _GAP * np.median(steps)))
    if gaps:
        longest = float(np.max(steps))
        message = f"{gaps} gaps of up to {longest:.3g} s in the time stamps were bridged"
        return [DataFinding("gaps", name, message)]
    grid = EvenGrid.of(recording.time_s)
    if grid.uneven:
        message = (
            f"time stamps are up to {grid.jitter:.2g} periods off an even grid; samples "
            "were interpolated"
        )
        return [DataFinding("uneven_sampling", name, message)]
    return []


def _clipping(axis: AxisRecord, name: str) -> list[DataFinding]:
    effort = axis.effort
    findings = []
    for word, peak in (("highest", np.max(effort)), ("lowest", np.min(effort))):
        share = float(np.mean(effort == peak))
        if share > _AT_PEAK:
            message = (
                f"{share:.1%} of the samples have exactly the {word} effort, {peak:.4g}: the "
                "drive asked for more than it could give"
            )
            findings.append(DataFinding("clipped", name, message))
    return findings
