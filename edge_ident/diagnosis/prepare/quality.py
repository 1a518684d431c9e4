"""What about the data itself is doubtful, before any physics is."""

from collections.abc import Mapping, Sequence
from typing import Final

import numpy as np

from edge_ident.diagnosis.result import AxisDiagnosis, DataFinding
from edge_ident.signals.recording import AxisRecord, Recording
from edge_ident.signals.resampling import EvenGrid

_GAP: Final = 3.0
"""Sampling periods that count as lost samples."""
_AT_PEAK: Final = 0.005
"""Share of a record at exactly its highest or lowest effort that counts as clipped."""


def data_findings(
    recordings: Sequence[Recording], axes: Mapping[str, AxisDiagnosis]
) -> tuple[DataFinding, ...]:
    """Gaps, uneven sampling, clipped efforts."""
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
        return [
            DataFinding(
                "gaps",
                name,
                f"{gaps} gaps of up to {longest:.3g} s in the time stamps were bridged",
            )
        ]
    grid = EvenGrid.of(recording.time_s)
    if grid.interpolated:
        return [
            DataFinding(
                "uneven_sampling",
                name,
                f"time stamps are up to {grid.jitter:.2g} periods off an even grid; samples "
                "were interpolated",
            )
        ]
    return []


def _clipping(axis: AxisRecord, name: str) -> list[DataFinding]:
    effort = axis.effort
    findings = []
    for word, peak in (("highest", np.max(effort)), ("lowest", np.min(effort))):
        share = float(np.mean(effort == peak))
        if share > _AT_PEAK:
            findings.append(
                DataFinding(
                    "clipped",
                    name,
                    f"{share:.1%} of the samples have exactly the {word} effort, {peak:.4g}: the "
                    "drive asked for more than it could give",
                )
            )
    return findings
