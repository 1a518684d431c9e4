"""The HTML page of a survey: who stands out, by how much, and what has no result."""

import csv
import io
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from edge_ident.fleet.between_units import compare_units
from edge_ident.fleet.result import (
    Failed,
    Survey,
    SurveyedAxis,
    SurveyedCause,
    SurveyedRecording,
    Value,
)
from edge_ident.report.page.survey_page import write_survey_page
from edge_ident.report.survey import survey_document, survey_lines, write_survey_tables
from edge_ident.support.words import visible
from tests.edge_ident.report.page.pages import check_numbers, check_structure, read

UNITS = ("N*m", "N*m*s/rad", "N*m", "N*m")


def survey(count: int, friction: float = 1.0, *, ripple: bool = False, bad: bool = False) -> Survey:
    """Units that differ by a hundredth; the first has another friction, ripple, or both."""
    rng = np.random.default_rng(4)
    recordings = [
        _unit(n, rng, friction if n == 0 else 1.0, ripple and n == 0) for n in range(count)
    ]
    if bad:
        failed = Failed("data", "x <b>is</b> missing", "name it with --column")
        recordings.append(SurveyedRecording("bad.csv", "bad", "", {}, failed, 0.1))
    return Survey(tuple(recordings), compare_units(recordings), ("notes.md",))


def _unit(
    number: int, rng: np.random.Generator, friction: float, ripple: bool
) -> SurveyedRecording:
    values = np.array([0.4, 0.9, 1.4 * friction, 0.03]) * (1.0 + 0.01 * rng.standard_normal(4))
    names = ("inertia", "viscous_friction", "coulomb_friction", "offset")
    cause = SurveyedCause("torque_ripple", "supported", 0.06, 0.002, {}, (), "a line at order 12")
    axis = SurveyedAxis(
        {
            name: Value(float(value), abs(0.003 * float(value)), unit)
            for name, value, unit in zip(names, values, UNITS, strict=True)
        },
        "least_squares",
        True,
        "explained" if ripple else "adequate",
        0.02,
        (cause,) if ripple else (),
        (),
        {},
    )
    return SurveyedRecording(
        f"unit-{number}.csv", f"unit-{number}", "0" * 64, {"x": axis}, None, 1.0
    )


@pytest.mark.parametrize(
    "name", ["=1+1", "+1", "-2+3|x", "@SUM(A1)", "\t=1", "\r=1", " =1", "＝1", "a\x1b]0;b\x07"]
)
def test_no_name_is_a_formula_or_acts_where_the_table_is_shown(name: str, tmp_path: Path) -> None:
    one = survey(1).recordings[0]
    axis = replace(one.axes["x"], relative_residual=-0.5)
    named = replace(one, unit=name, file=name, axes={name: axis})
    write_survey_tables(Survey((named,), (), ()), tmp_path)
    text = (tmp_path / "survey.csv").read_text("utf-8")
    assert visible(text) == text
    head, cells = csv.reader(io.StringIO(text, newline=""))
    row = dict(zip(head, cells, strict=True))
    for column in ("unit", "recording", "axis"):
        assert row[column].lstrip()[0] not in "=+-@＝"
    assert float(row["relative_residual"]) == -0.5


def written(found: Survey, folder: Path) -> Path:
    return write_survey_page(found, survey_document(found), folder)


def test_the_first_screen_names_the_unit_the_quantity_and_the_part(tmp_path: Path) -> None:
    page = written(survey(8, friction=1.3), tmp_path)
    tree = check_structure(page)
    assert check_numbers(tree)
    first = " ".join(tree.by_id("first-screen").text().split())
    assert "One of 8 units stands out: unit-0." in first
    assert "Coulomb friction on axis x is 1.33 times that of the others: " in first
    assert "Guides, covers, and the preload of nut and bearings." in first
    assert "edge-ident diagnose unit-0.csv" in first
    marked = [row for row in tree.all("li") if ".out" in row.kinds]
    assert {"unit-0" in row.text() for row in marked} == {True}


def test_an_effect_of_one_unit_is_named_with_its_share(tmp_path: Path) -> None:
    first = read(written(survey(8, ripple=True), tmp_path)).by_id("first-screen").text()
    first = " ".join(first.split())  # no-break spaces, too
    assert "torque ripple on axis x takes 6.0 % of its effort, 0.0 % in the others" in first


def test_units_that_are_alike_are_said_to_be(tmp_path: Path) -> None:
    page = written(survey(8), tmp_path)
    assert "None of 8 units stands out." in read(page).by_id("first-screen").text()


def test_too_few_units_are_shown_and_not_judged(tmp_path: Path) -> None:
    page = written(survey(5, friction=2.0), tmp_path)
    tree = check_structure(page)
    assert "5 units are too few to say" in tree.by_id("first-screen").text()
    assert not [row for row in tree.all("li") if ".out" in row.kinds]
    assert "unit-4" in tree.text("script")


def test_a_recording_without_a_result_says_why_as_text(tmp_path: Path) -> None:
    page = written(survey(7, bad=True), tmp_path)
    first = read(page).by_id("first-screen").text()
    assert "x <b>is</b> missing. Next: name it with --column" in first


def test_a_survey_of_nothing_has_a_page(tmp_path: Path) -> None:
    assert "0 units are too few" in read(written(survey(0, bad=True), tmp_path)).text("script")


def test_a_sound_verdict_and_a_sign_error_are_never_one_row(tmp_path: Path) -> None:
    found = survey(8)
    first, *others = found.recordings
    wrong = {"effort_sign": ("the effort has the wrong sign", "multiply it by -1")}
    axes = {
        name: replace(axis, trusted=False, verdict=None, warnings=wrong)
        for name, axis in first.axes.items()
    }
    doubtful = replace(found, recordings=(replace(first, axes=axes), *others))
    tree = read(written(doubtful, tmp_path))
    rows = [row for row in tree.rows() if any("effort_sign" in cell for cell in row)]
    assert len(rows) == len(axes)
    assert not any("adequate" in row for row in rows)
    assert survey_lines(doubtful, 20)[1 : 1 + len(axes)] == [
        f"  {first.unit}, axis {name}: not trusted; verdict: none: effort_sign" for name in axes
    ]


def test_no_more_lines_than_a_screen_has() -> None:
    found = survey(8)
    wrong = {"effort_sign": ("the effort has the wrong sign", "multiply it by -1")}
    one = found.recordings[0]
    axes = {n: replace(a, trusted=False, warnings=wrong) for n, a in one.axes.items()}
    bad = replace(found, recordings=(replace(one, axes=axes),) * 40)
    lines = survey_lines(bad, 20)
    assert len(lines) == 20
    assert lines[-2] == f"  and {40 * len(axes) - 17} more"
