"""What a recording holds, as one table: a row for each axis."""

import numpy as np

from edge_ident.signals.recording import Recording
from edge_ident.support.rows import Cell, Table, table_of

NAMES = (
    "axis", "lowest_position", "highest_position", "position_unit", "rms_effort", "peak_effort",
    "effort_unit", "also",
)  # fmt: skip
_ALSO = ("reference", "velocity", "temperature_c")


def recording_table(recording: Recording) -> Table:
    """Columns of `NAMES`; an axis without a drive has no effort."""
    rows: list[tuple[Cell, ...]] = []
    for name, axis in recording.axes.items():
        also = ", ".join(what for what in _ALSO if getattr(axis, what) is not None)
        effort = np.asarray(axis.effort, dtype=np.float64)
        rms, peak = float(np.sqrt(np.mean(effort**2))), float(np.max(np.abs(effort)))
        rows.append(
            (name, *_ends(axis.position), axis.position_unit, rms, peak, axis.effort_unit, also)
        )
    for name, passive in recording.passive.items():
        ends = _ends(passive.position)
        rows.append((name, *ends, passive.position_unit, None, None, None, "no drive"))
    return table_of(NAMES, rows)


def length_in_words(recording: Recording) -> str:
    """Source, samples, duration and rate, in one line."""
    time_s = recording.time_s
    duration_s = float(time_s[-1] - time_s[0]) if len(time_s) > 1 else 0.0
    said = f"{recording.source}: {len(time_s)} samples, {duration_s:.4g} s"
    return said + (f", {(len(time_s) - 1) / duration_s:.4g} Hz" if duration_s > 0.0 else "")


def _ends(position: np.ndarray) -> tuple[float, float]:
    return float(np.min(position)), float(np.max(position))
