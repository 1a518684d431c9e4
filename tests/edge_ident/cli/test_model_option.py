"""--model FILE on the command line: identify, gains and run with effects that are known."""

import json
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from edge_ident.cli import app
from edge_ident.model.model import BASE, PARAMETERS, AxisModel, Model, SourceFile, Term
from edge_ident.model.model_files import load_model, save_model
from edge_ident.signals.recording import AxisRecord, Recording
from edge_ident.signals.recording_files import save_recording
from edge_ident.simulation.simulate import reduced_model

TRUTH = np.array([0.43, 0.9, 1.4, 0.1])
BASE_TERM = Term(BASE, dict(zip(PARAMETERS, TRUTH.tolist(), strict=True)))
PERIOD_RAD = 2 * np.pi / 5
RIPPLE = Term("torque_ripple", {"cosine": 0.0, "sine": 0.4, "period": PERIOD_RAD})
DRIFT = Term("offset_drift", {"rate": 0.0, "curvature": 0.0})


def answer(*arguments: str | Path, exit_code: int = 0) -> dict:
    result = CliRunner().invoke(app, [*map(str, arguments), "--json"])
    assert result.exit_code == exit_code, result.stderr
    return json.loads(result.stdout)


@pytest.fixture
def file(tmp_path: Path) -> Path:
    """A drive with ripple, by its formula."""
    time = 0.0025 * np.arange(8000)
    position = 2.0 * np.sin(1.1 * time) + 0.7 * np.sin(2.9 * time + 1.0)
    velocity = 2.2 * np.cos(1.1 * time) + 2.03 * np.cos(2.9 * time + 1.0)
    acceleration = -2.42 * np.sin(1.1 * time) - 5.887 * np.sin(2.9 * time + 1.0)
    effort = 0.43 * acceleration + 0.9 * velocity + 1.4 * np.sign(velocity) + 0.1
    effort += 0.4 * np.sin(2 * np.pi / PERIOD_RAD * position)
    counts = 2 * np.pi / 8400
    record = AxisRecord(counts * np.round(position / counts), effort, "rad", "N*m")
    save_recording(Recording(time, {"x": record}, "test"), tmp_path / "capture.npz")
    return tmp_path / "capture.npz"


@pytest.fixture
def model_file(tmp_path: Path) -> Path:
    path = tmp_path / "known.json"
    sources = (SourceFile("yesterday.csv", "ab" * 32),)
    save_model(Model({"x": AxisModel((BASE_TERM, RIPPLE, DRIFT))}, sources), path)
    return path


def test_identify_says_what_it_assumed_and_hands_it_on(
    file: Path, model_file: Path, tmp_path: Path
) -> None:
    plain = answer("identify", file, "--no-diagnose")["axes"]["x"]
    found = answer("identify", file, "--model", model_file, "--output", tmp_path / "out")
    axis = found["axes"]["x"]
    assert plain["assumed_effects"] == []
    assert axis["assumed_effects"] == ["torque_ripple", "offset_drift"]
    assert axis["metric"]["relative_residual"] < 0.5 * plain["metric"]["relative_residual"]
    values = [axis["physical"][name]["value"] for name in PARAMETERS]
    np.testing.assert_allclose(values, TRUTH, rtol=0.01)
    left = load_model(tmp_path / "out" / "model.json")
    assert [term.effect for term in left.axes["x"].terms] == [BASE, RIPPLE.effect, DRIFT.effect]
    assert left.axes["x"].terms[1].values == RIPPLE.values
    np.testing.assert_allclose(left.axes["x"].parameters, values)
    assert [source.file for source in left.recordings] == ["capture.npz", "yesterday.csv"]
    again = answer("identify", file, "--model", tmp_path / "out" / "model.json")["axes"]["x"]
    assert [again["physical"][name]["value"] for name in PARAMETERS] == pytest.approx(values)


def test_gains_feed_the_ripple_forward_and_say_what_became_of_the_drift(
    file: Path, model_file: Path
) -> None:
    assert "ripple_sine" not in str(answer("gains", file, "--no-diagnose")["axes"]["x"]["used"])
    found = answer("gains", file, "--model", model_file)["axes"]["x"]
    assert [used["effect"] for used in found["used"]] == ["torque_ripple", "offset_drift"]
    assert found["not_used"] == []
    assert found["gains"]["ripple_sine"] == [0.4, 0.0, 0.0, 0.0]
    assert found["gains"]["ripple_period_rad"][0] == pytest.approx(PERIOD_RAD)
    shown = CliRunner().invoke(app, ["gains", str(file), "--model", str(model_file), "--details"])
    assert "compensated effects: torque_ripple, offset_drift" in shown.stdout
    assert "ripple 1" in shown.stdout
    assert "offset drift: the gains fit the machine as it was at the end" in shown.stdout


def test_what_nobody_knew_is_found_reported_and_fed_forward(file: Path) -> None:
    found = answer("gains", file)
    axis = found["identification"]["axes"]["x"]
    assert axis["trusted"]
    assert axis["parameters_from"] == "extended_model"
    assert [cause["effect"] for cause in axis["diagnosis"]["causes"]] == ["torque_ripple"]
    off = {
        source: np.array([values[name]["value"] for name in PARAMETERS]) - TRUTH
        for source, values in (("answer", axis["parameters"]), ("base", axis["base"]["parameters"]))
    }
    assert np.all(np.abs(off["answer"]) < 0.01 * np.abs(TRUTH))
    assert np.max(np.abs(off["base"] / TRUTH)) > 0.02
    assert found["axes"]["x"]["gains"]["ripple_sine"][0] == pytest.approx(0.4, rel=0.05)
    shown = CliRunner().invoke(app, ["identify", str(file), "--details"]).stdout
    assert "extended model used" in shown
    assert "the base model lacks torque ripple" in shown


def test_a_run_writes_what_it_was_told_of_effects_to_the_board(tmp_path: Path) -> None:
    stribeck = Term("stribeck_friction", {"level": 0.0625, "speed": 0.03125})
    known = reduced_model()
    axes = {name: replace(axis, terms=(*axis.terms, stribeck)) for name, axis in known.axes.items()}
    save_model(Model(axes), tmp_path / "known.json")
    arguments = ("--device", "virtual", "--output", tmp_path / "run")
    found = answer("run", *arguments, "--model", tmp_path / "known.json")
    assert found["confirmed"]
    assert found["identification"]["axes"]["z"]["assumed_effects"] == ["stribeck_friction"]
    assert found["designs"]["x"]["gains"]["stribeck_feedforward"] == 0.0625
    left = load_model(tmp_path / "run" / "model.json")
    assert left.axes["x"].terms[1].values == stribeck.values


def test_compensation_loads_no_heavy_package_and_nothing_of_other_commands(
    file: Path, model_file: Path
) -> None:
    source = f"""
import sys
from edge_ident.cli import app
try:
    app(["identify", {str(file)!r}, "--model", {str(model_file)!r}, "--json"])
except SystemExit as end:
    assert end.code == 0, end.code
heavy = {{"torch", "onnx", "scipy", "matplotlib", "rich", "numpy.random"}}
print(sorted(set(sys.modules) & (heavy | {{"edge_ident.control.gain_design"}})), file=sys.stderr)
"""
    done = subprocess.run(
        [sys.executable, "-c", source], capture_output=True, text=True, check=True
    )
    assert done.stderr.splitlines()[-1] == "[]"
