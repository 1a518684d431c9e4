"""Terminal, table, JSON and page of a survey say the same, and its rows what `diagnose` says."""

import csv
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Final

import pytest
from rich.console import Console

import edge_ident
from edge_ident.diagnosis.result import Diagnosis
from edge_ident.estimation.trust import Finding
from edge_ident.fleet import analysis
from edge_ident.fleet.analysis import Options, analyse_recording
from edge_ident.fleet.between_units import compare_units
from edge_ident.fleet.result import Survey, SurveyedAxis, SurveyedCause
from edge_ident.report.diagnosis import diagnosis_document
from edge_ident.report.documents import identification_document
from edge_ident.report.page.survey_page import write_survey_page
from edge_ident.report.survey import survey_document, survey_lines, with_std, write_survey_tables
from edge_ident.signals.read_columns import ReadOptions
from edge_ident.support.words import spoken
from tests.edge_ident.report.page.pages import Element, read
from tests.edge_ident.report.page.test_survey_page import survey
from tests.edge_ident.report.test_one_truth_of_diagnoses import FOUND

SIGN: Final = {"effort_sign": ("the effort has the wrong sign", "multiply it by -1")}
WEAK: Final = {"weak_inertia": ("inertia is known to 80 %", "accelerate more")}
PLAY: Final = SurveyedCause("backlash", "suspected", 0.02, 0.01, {}, (), "a step at reversals")
Change = Callable[[SurveyedAxis], SurveyedAxis]


def with_first(found: Survey, change: Change) -> Survey:
    """The survey in which the first recording says something else."""
    first, *others = found.recordings
    first = replace(first, axes={name: change(axis) for name, axis in first.axes.items()})
    recordings = (first, *others)
    return Survey(recordings, compare_units(recordings), found.left_out)


SURVEYS: Final[dict[str, Survey]] = {
    "alike": survey(8),
    "friction": survey(8, 1.3),
    "less friction": survey(8, 0.8),
    "an effect": survey(8, ripple=True),
    "friction and an effect": survey(8, 1.3, ripple=True),
    "one without a result": survey(8, 1.3, bad=True),
    "too few": survey(5, 2.0),
    "none": survey(0, bad=True),
    "a wrong sign": with_first(
        survey(8, 1.3, ripple=True),
        lambda axis: replace(axis, trusted=False, verdict=None, warnings=SIGN),
    ),
    "little is known": with_first(
        survey(8), lambda axis: replace(axis, trusted=False, warnings=WEAK)
    ),
    "not diagnosed": with_first(survey(8), lambda axis: replace(axis, verdict=None)),
    "suspected only": with_first(
        survey(8), lambda axis: replace(axis, verdict="unexplained", causes=(PLAY,))
    ),
}


@pytest.mark.parametrize("name", SURVEYS)
def test_all_say_the_same(name: str, tmp_path: Path) -> None:
    found = SURVEYS[name]
    in_json = survey_document(found)
    page = read(write_survey_page(found, in_json, tmp_path))
    short, long = flat("\n".join(survey_lines(found, 1000))), terminal(found)
    everywhere = (short, long, flat(page.text("script")))

    assert in_json["trusted"] is found.trusted
    for said in everywhere:
        assert in_json["conclusion"] in said
        assert said.count(" deviations away") == len(in_json["standing_out"])
        for one in in_json["standing_out"]:
            scale, digits = (100.0, ".1f") if one["of_effect"] else (1.0, ".4g")
            for number in (one["value"], one["centre"]):
                assert f"{scale * number:{digits}}" in said
            assert f"{one['deviations']:.1f} deviations away" in said
            assert one["unit"] in said
        for failed in found.failed:
            assert failed.failed is not None
            for part in (failed.file, failed.failed.cause, failed.failed.next_step):
                assert part in said

    rows = [one for one in in_json["recordings"] for _ in one["axes"]]
    assert len(table_rows(page)) == len(rows)
    assert long.count("│ unit-") == len(rows)
    assert short.count(", axis x: ") == len(rows)


@pytest.mark.parametrize("name", SURVEYS)
def test_every_row_says_the_same(name: str, tmp_path: Path) -> None:
    found = SURVEYS[name]
    in_json = survey_document(found)
    page = read(write_survey_page(found, in_json, tmp_path))
    with write_survey_tables(found, tmp_path)[0].open(newline="", encoding="utf-8") as file:
        in_csv = {row["recording"]: row for row in csv.DictReader(file)}
    on_page = {row[0]: row for row in table_rows(page)}
    printed = {
        cells[1].strip(): cells
        for line in terminal(found, keep_lines=True).splitlines()
        if (cells := line.split("│"))[1:2] and cells[1].strip().startswith("unit-")
    }
    lines = survey_lines(found, 1000)
    standing = {one["unit"] for one in in_json["standing_out"]}
    for recording in in_json["recordings"]:
        file, unit = recording["file"], recording["unit"]
        for axis in recording["axes"].values():
            _, _, verdict, trusted, left, *causes = on_page[file]
            said = " ".join(line for line in lines if line.startswith(f"  {unit}"))
            assert (trusted == "yes") is axis["trusted"]
            assert (in_csv[file]["trusted"] == "True") is axis["trusted"]
            assert ("not trusted" in printed[unit][-2]) is not axis["trusted"]
            assert ("not trusted" in said) is not axis["trusted"]
            assert in_csv[file]["verdict"] == (axis["verdict"] or "")
            assert left == f"{axis['relative_residual']:.1%}"
            supported = [cause for cause in axis["causes"] if cause["kind"] == "supported"]
            named = supported if axis["trusted"] else []
            assert ("stands out" in printed[unit][-2]) is (unit in standing)
            for cause in named:
                words = f"{spoken(cause['effect'])} {100 * cause['share']:.2g} %"
                assert words in causes[0]
                assert words in printed[unit][-3]
                assert words in said
            if not named:
                assert causes[0] == ""
                assert verdict == printed[unit][-3].strip()
                assert verdict in said
                assert verdict.startswith(axis["verdict"] or ("none: ", "not diagnosed"))
            for parameter, value in axis["parameters"].items():
                assert float(in_csv[file][parameter]) == value["value"]
                shown = with_std(value["value"], value["std"])
                assert any(cell.strip() == shown for cell in printed[unit])
                assert not axis["trusted"] or shown in page.text()


@pytest.fixture(scope="module")
def recording() -> edge_ident.Recording:
    return edge_ident.simulate()


@pytest.fixture(scope="module")
def found(recording: edge_ident.Recording) -> edge_ident.Identification:
    return edge_ident.identify(recording, diagnose=False)


@pytest.mark.parametrize("name", FOUND)
def test_a_row_says_what_identify_and_diagnose_say(
    name: str,
    recording: edge_ident.Recording,
    found: edge_ident.Identification,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    of_axis = FOUND[name]
    contradicts = tuple(replace(finding, contradicts=True) for finding in of_axis.findings)
    axis = replace(
        found.axes["x"],
        diagnosis=of_axis,
        adequacy=replace(found.axes["x"].adequacy, noise_ratio=100.0, relative_residual=0.1),
        line=of_axis.extended.estimate,
        findings=(*found.axes["x"].findings, *contradicts),
    )
    given = replace(found, axes={"x": axis})
    monkeypatch.setattr(analysis, "identify", lambda *_, **__: given)
    row = analyse_recording(recording, Options(ReadOptions(), None, diagnose=True))["x"]
    identified = identification_document(given)["axes"]["x"]
    diagnosed = diagnosis_document(Diagnosis({"x": of_axis}, (), {}), None)["axes"]["x"]

    assert row.trusted is identified["trusted"]
    assert row.verdict == (diagnosed["verdict"] if identified["consistent"] else None)
    for kind, key in (("supported", "causes"), ("suspected", "suspected"), ("minor", "minor")):
        mine = [(cause.effect, cause.share) for cause in row.causes if cause.kind == kind]
        assert mine == [(cause["effect"], cause["share"]) for cause in diagnosed[key]]
        assert mine == [(cause["effect"], cause["share"]) for cause in identified["diagnosis"][key]]
    assert row.not_testable == tuple(one["effect"] for one in diagnosed["not_testable"])
    assert row.relative_residual == identified["metric"]["relative_residual"]
    for parameter in ("viscous_friction", "coulomb_friction", "offset"):
        effective = identified["effective"][parameter]
        assert vars(row.parameters[parameter]) == {
            k: effective[k] for k in ("value", "std", "unit")
        }


def test_a_contradiction_leaves_no_verdict_in_a_row(
    recording: edge_ident.Recording,
    found: edge_ident.Identification,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    sign = Finding("effort_sign", "negative", "check the sign", blocks=True, contradicts=True)
    axes = {
        name: replace(axis, findings=(*axis.findings, sign)) for name, axis in found.axes.items()
    }
    monkeypatch.setattr(analysis, "identify", lambda *_, **__: replace(found, axes=axes))
    rows = analyse_recording(recording, Options(ReadOptions(), None, diagnose=True))
    assert {(row.verdict, row.trusted) for row in rows.values()} == {(None, False)}


def table_rows(page: Element) -> list[list[str]]:
    """Rows of what each recording says."""
    section = next(
        one for one in page.all("section") if one.attributes.get("aria-labelledby") == "recordings"
    )
    return [row for row in section.rows() if row and row[0].startswith("unit-")]


def terminal(found: Survey, *, keep_lines: bool = False) -> str:
    console = Console(width=400, highlight=False)
    with console.capture() as captured:
        console.print(found, soft_wrap=True)
    return captured.get() if keep_lines else flat(captured.get())


def flat(text: str) -> str:
    """On one line, with plain spaces and signs."""
    return " ".join(text.split()).replace("−", "-")
