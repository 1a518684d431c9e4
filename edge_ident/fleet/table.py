"""A survey as one table: a row for each axis of each recording."""

from collections.abc import Iterable, Iterator
from typing import Final

from edge_ident.fleet.result import Survey, SurveyedAxis, SurveyedRecording
from edge_ident.model.model import PARAMETERS
from edge_ident.support.rows import Cell, Table

_KINDS: Final = {"supported": "causes", "suspected": "suspected", "minor": "minor"}
"""Column of each kind of cause."""
COLUMNS: Final = {
    "unit": str,
    "recording": str,
    "axis": str,
    "trusted": bool,
    "verdict": str,
    "stands_out": str,
    **{
        f"{name}{ending}": kind
        for name in PARAMETERS
        for ending, kind in (("", float), ("_std", float), ("_unit", str))
    },
    "parameters_from": str,
    "relative_residual": float,
    **dict.fromkeys(_KINDS.values(), str),
    "warnings": str,
    "error_code": str,
    "error": str,
    "next_step": str,
    "duration_s": float,
    "sha256": str,
}
"""Every column with the type of its cells; a cell may be empty."""


def survey_table(survey: Survey) -> Table:
    """One row for each axis of each recording, and one for each recording that failed."""
    rows = [row for recording in survey.recordings for row in _rows(recording, survey)]
    return {name: [row.get(name) for row in rows] for name in COLUMNS}


def _rows(recording: SurveyedRecording, survey: Survey) -> Iterator[dict[str, Cell]]:
    common: dict[str, Cell] = {
        "unit": recording.unit,
        "recording": recording.file,
        "duration_s": recording.duration_s,
        "sha256": recording.sha256,
    }
    if recording.failed:
        failed = recording.failed
        error = {"error_code": failed.code, "error": failed.cause, "next_step": failed.next_step}
        yield {**common, **error}
    for name, axis in recording.axes.items():
        out = (
            one.comparison.quantity
            for one in survey.standing_out
            if (one.unit, one.comparison.axis) == (recording.unit, name)
        )
        yield {**common, "axis": name, "stands_out": _joined(out), **_axis_cells(axis)}


def _axis_cells(axis: SurveyedAxis) -> dict[str, Cell]:
    cells: dict[str, Cell] = {
        "trusted": axis.trusted,
        "verdict": axis.verdict,
        "parameters_from": axis.source,
        "relative_residual": axis.relative_residual,
        "warnings": _joined(axis.warnings),
    }
    for name, found in axis.parameters.items():
        cells |= {name: found.value, f"{name}_std": found.std, f"{name}_unit": found.unit}
    for kind, column in _KINDS.items():
        cells[column] = _joined(
            f"{cause.effect} {cause.share:.4g}" for cause in axis.causes if cause.kind == kind
        )
    return cells


def _joined(parts: Iterable[str]) -> str:
    return "; ".join(parts)
