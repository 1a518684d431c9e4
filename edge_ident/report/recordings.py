"""What a file holds, column by column, and a recording: a row for each axis, a small picture."""

from collections.abc import Iterator, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any, Final

import numpy as np

from edge_ident.report.view import Grid, ResultView, grid_of
from edge_ident.signals import contract_columns, recording_files, scale_checks
from edge_ident.signals.recording import Array, Recording
from edge_ident.signals.time_stamps import EvenGrid
from edge_ident.support.rows import Cell, Table, table_of

_BLOCKS: Final = "▁▂▃▄▅▆▇█"
_WIDTH: Final = 60


def import_document(
    found: recording_files.Inspection, recording: Recording | None, output: Path | None
) -> dict[str, Any]:
    """Schema edge-ident/import/1; `recording` is None where the columns are a proposal."""
    warnings = [] if recording is None else scale_checks.check_scales(recording)
    return {
        "schema": "edge-ident/import/1",
        "file": found.source,
        "how": found.how,
        "rows": found.rows,
        "columns": [
            {
                "heading": use.heading,
                "unit": use.unit_text,
                "contract_name": use.target,
                "factor": use.unit.factor if use.target else None,
                "reason": use.reason,
            }
            for use in found.columns
        ],
        "period_s": EvenGrid.of(recording.time_s).period_s if recording else found.period_s,
        "left_out": list(found.left_out),
        "done": list(found.done),
        "certain": not found.questions,
        "questions": list(found.questions),
        "options": list(found.options),
        "axes": {} if recording is None else _axes(recording),
        "warnings": list(map(asdict, warnings)),
        "output": None if output is None else str(output),
    }


def inspection_lines(found: recording_files.Inspection) -> Iterator[str]:
    """Columns of a file in a table of text, under one line about the file."""
    yield ", ".join(filter(None, (f"{found.source}: {found.rows} rows", found.how)))
    rows = [("column", "unit", "taken for", "because")]
    rows += [
        (use.heading, use.unit_text or "", use.target or "", use.reason) for use in found.columns
    ]
    widths = [max(len(row[c]) for row in rows) for c in range(3)]
    for row in rows:
        cells = [cell.ljust(width) for cell, width in zip(row, widths, strict=False)]
        yield "  ".join(["", *cells, row[3]]).rstrip()
    if found.period_s is not None:
        yield f"  sampling period {found.period_s:g} s: {found.period_reason}"
    yield from (f"  {line}" for line in found.done)
    if found.left_out:
        yield f"  left out: {', '.join(found.left_out)}"


def recording_lines(recording: Recording) -> Iterator[str]:
    """Sampling of a recording, and its positions and efforts as small pictures."""
    grid = EvenGrid.of(recording.time_s)
    span_s = float(np.ptp(recording.time_s))
    yield (
        f"{len(recording.time_s)} samples in {span_s:.4g} s, one every {1e3 * grid.period_s:.4g} ms"
        f"{', unevenly' if grid.uneven else ''}"
    )
    for name, axis in recording.axes.items():
        for what, values, unit in (
            ("position", axis.position, axis.position_unit),
            ("effort", axis.effort, axis.effort_unit),
        ):
            ends = f"{np.min(values):.4g} to {np.max(values):.4g} {unit}"
            yield f"{name} {what:8}  {sparkline(values)}  {ends}"


def resting_lines(found: recording_files.Inspection, recording: Recording) -> Iterator[str]:
    """The axes of a file that rest in its recording, although they have an effort."""
    parsed = filter(None, (contract_columns.parse_name(use.target or "") for use in found.columns))
    for name in (axis for axis, quantity, _ in parsed if quantity in contract_columns.EFFORTS):
        if name in recording.passive:
            yield (
                f"{recording.source}: axis {name} rests, and is not identified from this file; if "
                "it should have moved, check its encoder and that its drive was enabled"
            )


def scale_lines(recording: Recording) -> Iterator[str]:
    """Questions about the scale of a recording, each with its next step."""
    for question in scale_checks.check_scales(recording):
        yield f"warning: axis {question.axis}: {question.message}"
        yield f"next:    {question.next_step}"


def sparkline(values: Array) -> str:
    """The course of values (N,) in one line: the mean of each part, between lowest and highest."""
    starts = np.linspace(0, len(values), min(_WIDTH, len(values)), endpoint=False).astype(np.intp)
    means = np.add.reduceat(values, starts) / np.diff(np.append(starts, len(values)))
    span = float(np.ptp(means)) or 1.0
    level = np.rint((means - np.min(means)) / span * (len(_BLOCKS) - 1)).astype(np.intp)
    return "".join(_BLOCKS[i] for i in level)


def _axes(recording: Recording) -> dict[str, Any]:
    return {
        name: {
            "position_unit": axis.position_unit,
            "effort_unit": axis.effort_unit,
            "position_range": _range(axis.position),
            "effort_range": _range(axis.effort),
        }
        for name, axis in recording.axes.items()
    }


def _range(values: Array) -> Sequence[float]:
    return [float(np.min(values)), float(np.max(values))]


# A recording: a row for each axis.

_OF_RECORDINGS = (
    "axis", "lowest_position", "highest_position", "position_unit", "rms_effort", "peak_effort",
    "effort_unit", "also",
)  # fmt: skip
_ALSO = ("reference", "velocity", "temperature_c")


def recording_table(recording: Recording) -> Table:
    """Columns of `_OF_RECORDINGS`; an axis without a drive has no effort."""
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
    return table_of(_OF_RECORDINGS, rows)


def length_in_words(recording: Recording) -> str:
    """Source, samples, duration and rate, in one line."""
    time_s = recording.time_s
    duration_s = float(time_s[-1] - time_s[0]) if len(time_s) > 1 else 0.0
    said = f"{recording.source}: {len(time_s)} samples, {duration_s:.4g} s"
    return said + (f", {(len(time_s) - 1) / duration_s:.4g} Hz" if duration_s > 0.0 else "")


def _ends(position: np.ndarray) -> tuple[float, float]:
    return float(np.min(position)), float(np.max(position))


def _parts(recording: Recording) -> list[Grid]:
    return [grid_of(recording_table(recording), length_in_words(recording))]


VIEW: Final = ResultView(recording_table, _parts)
