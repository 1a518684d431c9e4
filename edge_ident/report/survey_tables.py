"""A survey as JSON document, as files of one table, and as tables for the terminal."""

import csv
import math
from collections.abc import Iterable, Iterator
from dataclasses import asdict
from functools import partial
from importlib.util import find_spec
from pathlib import Path
from typing import Any, Final

from edge_ident.files.opening import needed
from edge_ident.fleet.between_units import FALSE_ALARM, FEWEST_UNITS
from edge_ident.fleet.result import Survey, SurveyedAxis, SurveyedRecording
from edge_ident.model.model import PARAMETERS
from edge_ident.report.numbers import to_its_std
from edge_ident.report.survey_wording import (
    by_interest,
    causes_words,
    conclusion,
    difference_words,
    quantity_words,
    ratio_to_others,
    verdict_words,
)
from edge_ident.report.view import Grid, Line, Part, ResultView, Row
from edge_ident.support.documents import atomic_write
from edge_ident.support.next_step import Done, whole_step
from edge_ident.support.rows import Cell, Table
from edge_ident.support.words import on_a_line, with_deviation

CSV_FILE: Final = "survey.csv"
PARQUET_FILE: Final = "survey.parquet"
_LEAST_STD: Final = 1e-6  # smaller deviations would need too many decimals
_FORMULA: Final = tuple("=+-@＝＋－＠")  # signs with which a formula begins, in any width
_ARROW_TYPES: Final = {str: "string", float: "float64", bool: "bool_"}


def survey_document(survey: Survey) -> dict[str, Any]:
    """Schema edge-ident/survey/1."""
    return {
        "schema": "edge-ident/survey/1",
        "trusted": survey.trusted,
        "conclusion": conclusion(survey),
        "standing_out": [
            {
                "unit": one.unit,
                "axis": one.comparison.axis,
                "quantity": one.comparison.quantity,
                "of_effect": one.comparison.of_effect,
                **asdict(one.found),
                "deviations": one.deviations,
                "ratio": ratio_to_others(one),
                "centre": one.comparison.centre,
                "between": one.comparison.between,
                "parameter_unit": one.comparison.unit,
            }
            for one in survey.standing_out
        ],
        "judged": {"fewest_units": FEWEST_UNITS, "false_alarm": FALSE_ALARM},
        "recordings": [_recording(recording) for recording in survey.recordings],
        "comparisons": [asdict(comparison) for comparison in survey.comparisons],
        "left_out": list(survey.left_out),
    }


def _recording(recording: SurveyedRecording) -> dict[str, Any]:
    done = Done((recording.file,))
    axes = {name: _axis(axis, done) for name, axis in recording.axes.items()}
    return {**asdict(recording), "axes": axes}


def _axis(axis: SurveyedAxis, done: Done) -> dict[str, Any]:
    document = asdict(axis)
    warnings = [
        {"code": code, "message": message, "next_step": whole_step(next_step, done)}
        for code, (message, next_step) in axis.warnings.items()
    ]
    return {"parameters_from": document.pop("source"), **document, "warnings": warnings}


def write_survey_tables(survey: Survey, folder: Path) -> list[Path]:
    """Write the table as CSV, and as Parquet where pyarrow is installed, each whole or not at all.

    Returns
    -------
    list of Path
        What was written.
    """
    columns = survey.table()
    with (
        atomic_write(folder / CSV_FILE) as partial,
        partial.open("w", newline="", encoding="utf-8") as file,
    ):
        writer = csv.writer(file)
        writer.writerow(columns)
        writer.writerows(map(_defused, row) for row in zip(*columns.values(), strict=True))
    if find_spec("pyarrow") is None:
        return [folder / CSV_FILE]
    pyarrow = needed("pyarrow", "parquet", PARQUET_FILE)
    parquet = needed("pyarrow.parquet", "parquet", PARQUET_FILE)
    table = pyarrow.table(
        {
            name: pyarrow.array(columns[name], getattr(pyarrow, _ARROW_TYPES[kind])())
            for name, kind in COLUMNS.items()
        }
    )
    with atomic_write(folder / PARQUET_FILE) as partial:
        parquet.write_table(table, partial)
    return [folder / CSV_FILE, folder / PARQUET_FILE]


def _defused(cell: Cell) -> Cell:
    """A cell that a spreadsheet shows and does not compute; numbers stay.

    Source: OWASP, CSV Injection.
    """
    if not isinstance(cell, str):
        return cell
    text = on_a_line(cell)
    return f"'{text}" if text.lstrip().startswith(_FORMULA) else text


def survey_view(survey: Survey) -> ResultView:
    """What stands out, one table, and the recordings without a result."""
    return ResultView(partial(survey_table, survey), partial(_parts, survey))


def survey_lines(survey: Survey, most: int) -> list[str]:
    """The same where nobody scrolls: what stands out, what is not trusted, what failed.

    Parameters
    ----------
    survey : Survey
    most : int
        Lines.
    """
    said = [f"  {one.unit}: {difference_words(one)}" for one in survey.standing_out]
    said += [
        f"  {recording.unit}, axis {name}: not trusted; verdict: {verdict_words(axis)}"
        for recording, name, axis in by_interest(survey)
        if not axis.trusted
    ]
    said += [
        f"  {of.file}: no result: {of.failed.cause}; next: {of.failed.next_step}"
        for of in survey.failed
        if of.failed
    ]
    said += [
        f"  {recording.unit}, axis {name}: {causes_words(axis, 'supported') or verdict_words(axis)}"
        for recording, name, axis in by_interest(survey)
        if axis.trusted
    ]
    shown = said if len(said) <= most - 2 else said[: most - 3]
    if more := len(said) - len(shown):
        shown.append(f"  and {more} more")
    return [conclusion(survey), *shown, f"every value is in {CSV_FILE}"]


def _parts(survey: Survey) -> Iterator[Part]:
    yield Line(conclusion(survey), tone="strong")
    for one in survey.standing_out:
        yield Line(f"  {one.unit}: {difference_words(one)}")
    if survey.units:
        yield _overview(survey)
    for recording in survey.failed:
        if recording.failed:
            yield Line("no result", recording.file, "bad")
            yield Line(f"  {recording.failed.cause}")
            yield Line(f"  next: {recording.failed.next_step}")


def _overview(survey: Survey) -> Grid:
    headings = "unit", "axis", "inertia", "viscous", "Coulomb", "offset", "causes", "remark"
    rows: list[Row] = [
        (
            recording.unit,
            name,
            *(with_std(of.value, of.std) for of in axis.parameters.values()),
            causes_words(axis, "supported") or verdict_words(axis),
            _remark(survey, recording.unit, name, trusted=axis.trusted),
        )
        for recording, name, axis in by_interest(survey)
    ]
    return Grid("", headings, rows)


def with_std(value: float, std: float | None) -> str:
    """A value and its deviation, both to two digits of the deviation."""
    if not std or not _LEAST_STD < std < math.inf:
        return f"{value:.4g}" if not std else with_deviation(value, std)
    return " ± ".join(to_its_std(value, std))


def _remark(survey: Survey, unit: str, axis: str, *, trusted: bool) -> Line:
    """What a reader should look at, in a row of the table."""
    if not trusted:
        return Line("not trusted", tone="bad")
    quantities = [
        quantity_words(one.comparison)
        for one in survey.standing_out
        if (one.unit, one.comparison.axis) == (unit, axis)
    ]
    return Line(f"stands out: {', '.join(quantities)}" if quantities else "", tone="strong")


# A survey: a row for each axis of each recording.

# Column of each kind of cause.
_KINDS: Final = {"supported": "causes", "suspected": "suspected", "minor": "minor"}
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
    rows = [row for recording in survey.recordings for row in _survey_rows(recording, survey)]
    return {name: [row.get(name) for row in rows] for name in COLUMNS}


def _survey_rows(recording: SurveyedRecording, survey: Survey) -> Iterator[dict[str, Cell]]:
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
