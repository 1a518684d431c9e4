"""`edge-ident diagnose` from end to end: once for real, else with a diagnosis made by hand."""

import hashlib
import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner, Result

from edge_ident.cli import app
from edge_ident.diagnosis import diagnose as engine
from edge_ident.diagnosis.result import Diagnosis
from edge_ident.estimation.trust import Finding
from edge_ident.model.model import Model
from edge_ident.model.model_files import load_model, save_model, sourced_model
from edge_ident.signals.recording import AxisRecord, Recording
from edge_ident.signals.recording_files import save_recording
from tests.edge_ident.diagnosis import hand_made
from tests.edge_ident.diagnosis.select.test_search_parts import recorded, rigid, swing


class Engine:
    """Answers with a diagnosis that it was given, and remembers what it was asked."""

    def __init__(self, answer: Diagnosis) -> None:
        self.answer = answer
        self.asked: dict = {}

    def __call__(
        self,
        recordings: list[Recording],
        *,
        model: Model | None,
        validate: Recording | None,
        on_progress: Callable[[str, int, int], None],
        **rules: float,
    ) -> Diagnosis:
        self.asked = {"recordings": recordings, "model": model, "validate": validate, **rules}
        on_progress("timing", 1, 2)
        on_progress("causes", 2, 2)
        return self.answer


@pytest.fixture
def answered(monkeypatch: pytest.MonkeyPatch) -> Callable[[Diagnosis], Engine]:
    def answer(diagnosis: Diagnosis) -> Engine:
        stand_in = Engine(diagnosis)
        monkeypatch.setattr(engine, "diagnose", stand_in)
        return stand_in

    return answer


@pytest.fixture
def file(tmp_path: Path) -> Path:
    time = hand_made.PERIOD_S * np.arange(400)
    axis = AxisRecord(np.sin(3.0 * time), np.cos(3.0 * time), "rad", "N*m")
    path = tmp_path / "recording.csv"
    save_recording(Recording(time, {"x": axis, "y": axis, "z": axis}, "test"), path)
    return path


def diagnose(*arguments: str | Path) -> Result:
    return CliRunner().invoke(app, ["diagnose", *map(str, arguments)])


def test_the_real_diagnosis_names_the_cause_in_a_short_recording(tmp_path) -> None:
    """Friction by direction on ten seconds of five sines; nothing stands in for anything."""
    t, x, v, a = swing(seconds=10.0)
    save_recording(recorded(t, x, rigid(v, a) + 0.25 * abs(v), noise=0.05), tmp_path / "short.csv")
    done = diagnose(tmp_path / "short.csv", "--json", "--output", tmp_path / "out")
    assert done.exit_code == 0, done.stderr
    axis = json.loads(done.stdout)["axes"]["x"]
    assert axis["verdict"] == "explained"
    (cause,) = axis["causes"]
    assert cause["effect"] == "asymmetric_friction"
    difference = cause["parameters"]["difference"]
    assert difference["value"] == pytest.approx(0.25, abs=4.0 * difference["std"])
    assert cause["decision"].startswith("without it the criterion is ")
    assert "more than 25 to enter, and more than 0 to stay" in cause["decision"]
    assert axis["extended"]["relative_residual"]["fitted"] < 2.0 * axis["noise_floor"]
    model = load_model(tmp_path / "out" / "model.json").axes["x"]
    assert model.parameters == pytest.approx([0.5, 0.8, 1.1, 0.2], abs=0.03)
    text = (tmp_path / "out" / "report.html").read_text(encoding="utf-8")
    assert "Friction differs between the two directions." in text
    assert hashlib.sha256((tmp_path / "short.csv").read_bytes()).hexdigest() in text


def test_an_understood_machine_ends_with_0_and_json_alone_on_stdout(answered, file) -> None:
    answered(hand_made.diagnosis())
    done = diagnose(file, "--json", "--verbose")
    assert done.exit_code == 0, done.stderr
    document = json.loads(done.stdout)
    assert document["schema"] == "edge-ident/diagnosis/2"
    assert document["model"] is None
    assert "timing" in done.stderr


def test_an_unexplained_rest_alone_ends_with_0(answered, file) -> None:
    answered(hand_made.diagnosis(unexplained=True))
    assert diagnose(file).exit_code == 0


def test_data_that_let_no_cause_be_named_end_with_1(answered, file) -> None:
    found = hand_made.diagnosis(unexplained=True)
    late = Finding("effort_late", "recorded by other clocks", "record both at once", blocks=True)
    y = replace(found.axes["y"], findings=(late,))
    answered(replace(found, axes={**found.axes, "y": y}))
    assert diagnose(file).exit_code == 1


def test_a_remark_on_the_data_alone_does_not_stop_a_script(answered, file) -> None:
    answered(hand_made.diagnosis(doubtful=True))
    assert diagnose(file).exit_code == 0


def test_bad_input_ends_with_5(answered, file, tmp_path) -> None:
    answered(hand_made.diagnosis())
    assert diagnose(tmp_path / "missing.csv").exit_code == 5
    assert diagnose(file, "--model", tmp_path / "missing.json").exit_code == 5
    assert diagnose(file, "--validate", tmp_path / "missing.csv").exit_code == 5


def test_several_recordings_a_model_and_a_validation_reach_the_search(
    answered, file, tmp_path
) -> None:
    stand_in = answered(hand_made.diagnosis())
    model = Model({"x": hand_made.diagnosis().axes["x"].model})
    save_model(model, tmp_path / "known.json")
    done = diagnose(file, file, "--validate", file, "--model", tmp_path / "known.json")
    assert done.exit_code == 0, done.stderr
    assert len(stand_in.asked["recordings"]) == 2
    assert stand_in.asked["validate"].axes["x"].position_unit == "rad"
    assert stand_in.asked["model"] == model


def test_columns_are_renamed(answered, file, tmp_path) -> None:
    stand_in = answered(hand_made.diagnosis())
    text = file.read_text().replace("y_position_rad", "angle")
    (tmp_path / "renamed.csv").write_text(text)
    assert diagnose(tmp_path / "renamed.csv").exit_code == 5
    done = diagnose(tmp_path / "renamed.csv", "--column", "angle=y_position_rad")
    assert done.exit_code == 0, done.stderr
    assert list(stand_in.asked["recordings"][0].axes) == ["x", "y", "z"]


def test_the_written_model_has_the_sources_of_the_known_one(
    answered: Callable[[Diagnosis], Engine], file: Path, tmp_path: Path
) -> None:
    found = hand_made.diagnosis()
    answered(found)
    earlier = tmp_path / "earlier.csv"
    earlier.write_text(file.read_text())
    save_model(sourced_model(found.model, [earlier], None), tmp_path / "known.json")
    diagnose(file, "--model", tmp_path / "known.json", "--output", tmp_path / "out")
    recordings = load_model(tmp_path / "out" / "model.json").recordings
    assert [source.file for source in recordings] == ["recording.csv", "earlier.csv"]


def test_the_folder_holds_document_model_with_its_recordings_and_page(
    answered, file, tmp_path
) -> None:
    answered(hand_made.diagnosis())
    folder = tmp_path / "diagnosis"
    done = diagnose(file, "--output", folder, "--json")
    assert done.exit_code == 0, done.stderr
    assert json.loads((folder / "diagnosis.json").read_text()) == json.loads(done.stdout)
    assert json.loads(done.stdout)["model"] == str(folder / "model.json")
    model = load_model(folder / "model.json")
    assert [term.effect for term in model.axes["x"].terms[1:]] == [
        "torque_ripple",
        "asymmetric_friction",
    ]
    assert model.recordings[0].sha256 == hashlib.sha256(file.read_bytes()).hexdigest()
    assert {path.name for path in folder.iterdir()} == {
        "diagnosis.json",
        "model.json",
        "report.html",
    }


def test_markdown_is_an_export(answered, file, tmp_path) -> None:
    answered(hand_made.diagnosis())
    done = diagnose(file, "--output", tmp_path, "--format", "markdown")
    assert done.exit_code == 0, done.stderr
    assert (tmp_path / "report.md").is_file()
    assert not (tmp_path / "report.html").exists()


def test_tables_say_verdict_causes_alternatives_and_what_is_not_testable(answered, file) -> None:
    answered(hand_made.diagnosis(unexplained=True))
    text = " ".join(diagnose(file, "--details").stdout.split())
    assert "axis x explained by torque ripple and asymmetric friction" in text
    assert "31 % 12.0 %" in text
    assert "27 to 35 %" in text
    assert "period 0.9 ± 0.0005 rad" in text
    assert "this motion does not distinguish it from nonlinear viscous" in text
    assert "0.97 alike [so far]" in text
    assert "record a faster multisine" in text
    assert "axis z the base model is adequate" in text
    assert "axis y partly explained, " in text
    assert "of what the base model misses, by torque ripple the residual falls from" in text
    assert "not testable: backlash, presliding hysteresis" in text


def test_help_has_an_example() -> None:
    text = " ".join(diagnose("--help").stdout.split())
    assert "Example: edge-ident diagnose" in text


def test_the_tolerance_is_an_option(file: Path, answered: Callable[[Diagnosis], Engine]) -> None:
    stand_in = answered(hand_made.diagnosis())
    assert diagnose(file).exit_code == 0
    assert stand_in.asked["tolerance"] == 0.01
    diagnose(file, "--tolerance", "0.03")
    assert stand_in.asked["tolerance"] == 0.03
