"""The HTML page of a diagnosis: one file, true numbers, everyday words, safe text."""

import hashlib
import re
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from edge_ident.diagnosis.measures import Verdict
from edge_ident.diagnosis.result import Diagnosis
from edge_ident.estimation.trust import Finding
from edge_ident.model.effects import catalogue
from edge_ident.model.model import Term
from edge_ident.report.diagnosis import diagnosis_document
from edge_ident.report.numbers import digits, sentence
from edge_ident.report.page.diagnosis_charts import _to_and_fro, broken
from edge_ident.report.page.diagnosis_page import diagnosis_card, write_page
from edge_ident.report.page.rendering import Provenance
from tests.edge_ident.diagnosis import hand_made
from tests.edge_ident.report.page.pages import check_numbers, check_structure, document, read

SHA = "0123456789abcdef" * 4
HOSTILE = "<script>alert('x')</script>"


def written(found: Diagnosis, folder: Path, name: str = "monday.csv") -> Path:
    return write_page(
        found, Provenance(((name, SHA),), f"edge-ident diagnose {name}", "1.0"), folder
    )


@pytest.fixture(scope="module")
def page(tmp_path_factory: pytest.TempPathFactory) -> Path:
    found = hand_made.diagnosis(doubtful=True, unexplained=True)
    return written(found, tmp_path_factory.mktemp("page"))


def test_the_page_is_one_file_that_asks_nothing_from_outside(page: Path) -> None:
    tree = check_structure(page)
    (policy,) = [
        meta.attributes["content"]
        for meta in tree.all("meta")
        if meta.attributes.get("http-equiv") == "Content-Security-Policy"
    ]
    assert policy.startswith("default-src 'none'")
    assert "unsafe" not in policy
    assert [file.name for file in page.parent.iterdir()] == ["report.html"]


def test_every_number_of_the_first_screen_is_one_of_the_document(page: Path) -> None:
    tree = read(page)
    assert len(check_numbers(tree)) >= 12
    found = hand_made.diagnosis(doubtful=True, unexplained=True)
    assert document(tree) == diagnosis_document(found, None)


def test_the_first_screen_says_what_where_and_what_to_do(page: Path) -> None:
    first = " ".join(read(page).by_id("first-screen").text().split())
    ripple = catalogue()["torque_ripple"].advice
    assert "Stamps stray by 0.3 sampling periods." in first
    assert ripple.in_words in first
    assert ripple.part[1:] in first
    assert ripple.action in first
    assert "Nothing is wrong that this recording can show." in first
    assert "of what the simple model gets wrong; the rest is open." in first


def test_the_details_say_what_the_terminal_says(page: Path) -> None:
    tree = read(page)
    said = " ".join(tree.text("script", "style").split())
    assert "On kept-back parts it takes away 31 % of the error (95 % interval: 27 to 35 %)." in said
    assert "this motion does not distinguish it from nonlinear viscous" in said.lower()
    assert "without it the criterion is 412 units worse" in said
    assert "period 0.9 ± 0.0005 rad (6.981 per turn)" in said
    assert ["load dependent friction", "the load is constant", "two payloads"] in tree.rows()
    assert ["error on another recording", "12.0 %", "4.00 %"] in tree.rows()
    assert SHA in said
    assert "edge-ident diagnose monday.csv" in said


def test_an_inseparable_cause_is_told_with_the_motion_that_decides(tmp_path: Path) -> None:
    axis = hand_made.axis(Verdict.EXPLAINED, hand_made.friction_by_direction())
    first = " ".join(read(written(Diagnosis({"x": axis}, (), {}), tmp_path)).text("script").split())
    assert "Not sure which cause it is." in first
    assert "This motion cannot tell it from nonlinear viscous." in first
    assert "To be sure, record a faster multisine." in first


def test_suspicions_stand_apart_from_causes(tmp_path: Path) -> None:
    doubt = replace(hand_made.friction_by_direction(), decision="its share is below what is left")
    axis = replace(hand_made.axis(Verdict.UNEXPLAINED), suspected=(doubt,))
    tree = read(written(Diagnosis({"x": axis}, (), {}), tmp_path))
    advice = catalogue()["asymmetric_friction"]
    first = " ".join(tree.by_id("first-screen").text().split())
    assert f"Suspected only: {advice.advice.in_words}." in first
    assert "Suspected: its share is below what is left." in tree.text()
    assert [li.attributes["class"] for li in tree.all("li") if "class" in li.attributes] == [
        "suspected",
        "rest",
    ]


def test_what_forbids_a_cause_comes_before_advice_on_the_machine(tmp_path: Path) -> None:
    late = Finding("effort_late", "the effort is 60 ms late", "record both at once", blocks=True)
    found = hand_made.diagnosis(doubtful=True)
    axis = replace(hand_made.axis(Verdict.UNEXPLAINED), findings=(late,))
    said = read(written(replace(found, axes={"x": axis}, validation={}), tmp_path)).text()
    assert "No cause is named: The effort is 60 ms late." in said
    assert "Record both at once." in said


def test_what_only_another_recording_lacks_sends_nobody_to_the_machine(tmp_path: Path) -> None:
    found = hand_made.diagnosis()
    axis = hand_made.axis(Verdict.UNEXPLAINED)
    quiet = replace(axis, extended=replace(axis.extended, fitted=axis.noise_floor), lines=())
    said = read(written(replace(found, axes={"x": quiet}), tmp_path)).text()
    assert "Inertia and friction explain this recording, and not the other one" in said
    assert "edge-ident diagnose monday.csv" in said


def test_names_from_files_reach_the_page_as_text_only(tmp_path: Path) -> None:
    found = hand_made.diagnosis(doubtful=True)
    found = Diagnosis({HOSTILE: found.axes["x"]}, found.data_quality, {})
    page = written(found, tmp_path, name=f"{HOSTILE}.csv")
    tree = check_structure(page)
    assert HOSTILE not in page.read_text(encoding="utf-8")
    assert HOSTILE in tree.by_id("first-screen").text()
    assert len(tree.all("script")) == 2
    assert list(document(tree)["axes"]) == [HOSTILE]
    assert len(check_numbers(tree)) >= 4


def test_a_long_recording_makes_a_small_page_and_keeps_its_peaks(tmp_path: Path) -> None:
    """44 s at 1 kHz, two axes, with one sample that sticks out."""
    long = hand_made.axis(
        Verdict.EXPLAINED, hand_made.ripple(), hand_made.friction_by_direction(), samples=44_000
    )
    effort = long.traces.effort.copy()
    effort[20_001] = 3.0 * np.max(np.abs(effort))
    long = replace(long, traces=replace(long.traces, effort=effort))
    page = written(Diagnosis({"x": long, "z": long}, (), {}), tmp_path)
    assert page.stat().st_size < 1_500_000
    tree = check_structure(page)
    peak = digits(float(np.max(effort)), 3)
    assert any(f"to {peak} N·m" in told.text() for told in tree.all("desc"))


def test_an_axis_that_hardly_moves_has_a_page(tmp_path: Path) -> None:
    still = hand_made.axis(Verdict.ADEQUATE, samples=400)
    still = replace(still, traces=replace(still.traces, valid=np.zeros(400, dtype=np.bool_)))
    check_structure(written(Diagnosis({"x": still}, (), {}), tmp_path))


def test_the_page_names_recordings_and_the_one_that_judged_with_their_hashes(
    tmp_path: Path,
) -> None:
    files = [tmp_path / name for name in ("monday.csv", "tuesday.csv", "friday.csv")]
    for file in files:
        file.write_text(file.name)
    source = Provenance.of(files[:2], files[2])
    page = write_page(hand_made.diagnosis(), source, tmp_path, tmp_path / "model.json")
    tree = read(page)
    assert tree.all("h1")[0].text() == "What monday.csv and tuesday.csv say about the machine"
    rows = dict(row for row in tree.rows() if len(row) == 2)
    for file, label in zip(
        files, ("monday.csv", "tuesday.csv", "judged on friday.csv"), strict=True
    ):
        assert rows[label] == f"sha256 {hashlib.sha256(file.read_bytes()).hexdigest()}"


def test_the_headline_says_how_large_the_fault_is() -> None:
    """In the unit of its parameter where the effect names one, else as a share of the effort."""
    play = Term(
        "backlash", {"gap": 0.082, "load_inertia": 0.2, "deceleration": 1.0, "damping_rate": 1.0}
    )
    cause = replace(hand_made.friction_by_direction(), term=play, alternatives=())
    axis = hand_made.axis(Verdict.EXPLAINED, cause)
    headline = diagnosis_card("c0", "x", Diagnosis({"x": axis}, (), {})).verdict.striptags()
    assert headline.startswith("Play of 0.082 rad at the encoder. ")
    axis = hand_made.axis(Verdict.EXPLAINED, hand_made.friction_by_direction())
    headline = diagnosis_card("c0", "x", Diagnosis({"x": axis}, (), {})).verdict.striptags()
    assert re.match(r"Asymmetric friction, [\d.]+ % of the \w+\. ", headline)


def test_the_head_has_machine_date_and_recordings(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("SOURCE_DATE_EPOCH", "1769817600")
    recording = tmp_path / "monday.csv"
    recording.touch()
    source = Provenance.of([recording], machine="press 7")
    first = read(write_page(hand_made.diagnosis(), source, tmp_path)).by_id("first-screen").text()
    assert "machine press 7 · 2026-01-31 · recording monday.csv" in " ".join(first.split())


def test_play_is_drawn_as_a_loop_over_one_stroke_to_and_fro() -> None:
    """Of a sine, from one reversal to the next but one; there is none in a single stroke."""
    time_s = np.linspace(0.0, 4.0, 400)
    of_sine = SimpleNamespace(
        velocity=np.cos(np.pi * time_s),
        position=np.sin(np.pi * time_s),
        file=np.zeros(400, dtype=int),
    )
    way = _to_and_fro(of_sine, np.ones(400))
    assert way is not None
    assert time_s[way.stop - 1] - time_s[way.start] == pytest.approx(2.0, abs=0.03)
    assert abs(of_sine.position[way.start]) == pytest.approx(1.0, abs=0.01)
    of_sine.velocity = np.ones(400)
    assert _to_and_fro(of_sine, np.ones(400)) is None


def test_a_line_breaks_where_samples_are_missing() -> None:
    time_s = np.append(np.arange(50), np.arange(60, 100)) * 0.05
    traces = SimpleNamespace(time_s=time_s, file=np.zeros(90, dtype=int))
    assert np.flatnonzero(np.isnan(broken(traces, np.ones(90)))).tolist() == [50]


def test_units_of_a_sentence_are_symbols() -> None:
    assert sentence("adds 0.2 N*m*s/rad and 3 kg*m^2") == "Adds 0.2 N·m·s/rad and 3 kg·m²."
