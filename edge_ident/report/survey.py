"""What is shown of a survey: sentences, tables, a document, and files of one table."""

import csv
import math
from collections.abc import Callable, Iterable, Iterator
from dataclasses import asdict
from importlib.util import find_spec
from pathlib import Path
from typing import Any, Final

from edge_ident.diagnosis.measures import TOLERANCE
from edge_ident.files.opening import needed
from edge_ident.fleet.between_units import FALSE_ALARM, FEWEST_UNITS, LARGEST_SHARE
from edge_ident.fleet.result import Comparison, StandsOut, Survey, SurveyedAxis, SurveyedRecording
from edge_ident.model.model import PARAMETERS
from edge_ident.report.numbers import to_its_std, unit_text
from edge_ident.report.view import Grid, Line, Part, ResultView, Row
from edge_ident.support.documents import atomic_write
from edge_ident.support.next_step import Done, whole_step
from edge_ident.support.rows import Cell, Table
from edge_ident.support.words import on_a_line, spoken, with_deviation

JUDGED: Final = (
    "Each quantity of a unit has a value and a 95 % interval. The true values of sound units "
    "scatter, too: by the between-unit spread, which is estimated from the other units with their "
    "intervals (random-effects model). A unit stands out where its distance from the others is "
    "more than spread and intervals explain.",
    "All quantities and units of a survey share one probability of a false alarm: at most in "
    f"{100 * FALSE_ALARM:.0f} % of surveys of equal units, one is named by chance. So the more is "
    "compared, the farther away a unit has to be.",
    f"At most {100 * LARGEST_SHARE:.0f} % of the units can stand out: the others are what units "
    f"are like. With fewer than {FEWEST_UNITS} units nothing is said.",
    "An effect is compared by its share of the rms effort. Where it was not found, its share is "
    f"zero within {100 * TOLERANCE:.0f} %. Effects that a recording does not separate are compared "
    "together. Where an effect is only suspected, or the motion could not show it, the unit is "
    "left out.",
    "An axis that is not trusted is not compared. Units that all have the same fault do not stand "
    "out.",
)


def quantity_words(comparison: Comparison) -> str:
    """What is compared, in words."""
    words = comparison.quantity.replace("_", " ").replace("/", " or ")
    return words.replace("coulomb", "Coulomb")


def plain(value: float, text: str, key: str) -> str:
    """A number as it is shown where nothing else is known of it."""
    return text


def difference_words(
    one: StandsOut, shown: Callable[[float, str, str], str] = plain, kind: type[str] = str
) -> str:
    """How a unit differs from the others, as a part of a sentence.

    Parameters
    ----------
    one : StandsOut
    shown : callable
        Gets each number, its text, and its name in the document of what stands out.
    kind : type
        str or Markup.
    """
    comparison, value = one.comparison, one.found.value
    centre = comparison.centre or 0.0
    what = f"{quantity_words(comparison)} on axis {comparison.axis}"
    ratio = ratio_to_others(one)
    how: list[str] = [kind("{}").format(what)]
    if comparison.of_effect:
        mine, others = (
            shown(share, f"{100 * share:.1f}\u00a0%", key)
            for share, key in ((value, "value"), (centre, "centre"))
        )
        how.append(kind(" takes {} of its effort, {} in the others").format(mine, others))
    else:
        if ratio is not None:
            times = shown(ratio, f"{ratio:.2f}", "ratio")
            how.append(kind(" is {} times that of the others").format(times))
        mine, others = (
            shown(number, f"{number:.4g}".replace("-", "−"), key)
            for number, key in ((value, "value"), (centre, "centre"))
        )
        how.append(kind(": {} against {} {}").format(mine, others, unit_text(comparison.unit)))
    deviations = shown(one.deviations, f"{one.deviations:.1f}", "deviations")
    how.append(kind("; {} deviations away").format(deviations))
    return kind("").join(how)


def ratio_to_others(one: StandsOut) -> float | None:
    """Value over that of the others; None where that says little, because they are around zero."""
    comparison, centre = one.comparison, one.comparison.centre or 0.0
    if comparison.of_effect or abs(centre) < 3.0 * (comparison.between or 0.0) or not centre:
        return None
    ratio = one.found.value / centre
    return ratio if ratio > 0.0 else None


def conclusion(survey: Survey) -> str:
    """Whether a unit stands out, in one sentence."""
    names = list(dict.fromkeys(one.unit for one in survey.standing_out))
    count = len(survey.units)
    if len(names) > 1:
        return f"{len(names)} of {count} units stand out: {', '.join(names)}."
    if names:
        return f"One of {count} units stands out: {names[0]}."
    if not any(comparison.centre is not None for comparison in survey.comparisons):
        return (
            f"{count} {'unit is' if count == 1 else 'units are'} too few to say which stands out; "
            f"{FEWEST_UNITS} with trusted results are needed."
        )
    return f"None of {count} units stands out."


def causes_words(axis: SurveyedAxis, kind: str) -> str:
    """Causes of a kind with their shares; nothing of an axis that is not trusted."""
    if not axis.trusted:
        return ""
    return ", ".join(
        f"{cause.effect.replace('_', ' ')} {100 * cause.share:.2g} %"
        for cause in axis.causes
        if cause.kind == kind
    )


def verdict_words(axis: SurveyedAxis) -> str:
    """The verdict on an axis, or why there is none."""
    why = "not diagnosed" if axis.trusted else f"none: {next(iter(axis.warnings), 'not trusted')}"
    return spoken(axis.verdict) if axis.verdict else why


def by_interest(survey: Survey) -> list[tuple[SurveyedRecording, str, SurveyedAxis]]:
    """Every axis of every recording: what stands out first, then what is not trusted."""
    out = {(one.unit, one.comparison.axis) for one in survey.standing_out}

    def place(row: tuple[SurveyedRecording, str, SurveyedAxis]) -> int:
        recording, name, axis = row
        return 0 if (recording.unit, name) in out else 2 if axis.trusted else 1

    rows = [
        (recording, name, axis)
        for recording in survey.recordings
        for name, axis in recording.axes.items()
    ]
    return sorted(rows, key=place)


# A survey as JSON document, as files of one table, and as tables for the terminal.


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
    """What stands out, one table, and the recordings without a result."""
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


VIEW: Final = ResultView(survey_table, _parts)
