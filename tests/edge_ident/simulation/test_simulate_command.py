"""`edge-ident simulate`, end to end: what is simulated is identified again."""

import hashlib
import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from typer.testing import CliRunner

import edge_ident
from edge_ident.cli import app
from edge_ident.identification.identify import identify
from edge_ident.model.model import BASE, PARAMETERS, AxisModel, Model, Term
from edge_ident.model.model_files import load_model, save_model
from edge_ident.signals.recording_files import load_recording
from firmware_interface.plant.feed_drive import FEED_DRIVE


def run(*arguments: str | Path) -> dict:
    done = CliRunner().invoke(app, [*map(str, arguments), "--json"])
    assert done.exit_code == 0, done.stderr
    return json.loads(done.stdout)


def refused(*arguments: str | Path) -> tuple[int, str]:
    done = CliRunner().invoke(app, [*map(str, arguments)])
    return done.exit_code, done.stderr


def linear_axis(*effects: Term) -> Model:
    """An axis in m and N, of the size of a machine tool's."""
    base = Term(BASE, dict(zip(PARAMETERS, (95.0, 203.0, 20.0, -3.0), strict=True)))
    return Model({"q": AxisModel((base, *effects), "m", "N")})


def lap(path: Path, seconds: float = 3.0) -> Path:
    """A motion to follow, sampled at 500 Hz."""
    time = 0.002 * np.arange(round(seconds / 0.002))
    position = 0.1 * np.sin(3.0 * time) + 0.01 * np.sin(11.0 * time + 1.0)
    rows = np.column_stack([time, position, 0 * time])
    np.savetxt(path, rows, delimiter=",", header="time_s,q_position_m,q_force_n", comments="")
    return path


@pytest.mark.parametrize("model", ["full", "reduced"])
def test_the_built_in_drive_on_the_papers_motion_is_identified_again(
    model: str, tmp_path: Path
) -> None:
    file = tmp_path / "rec.npz"
    document = run("simulate", "--model", model, "--noise", "0.01", "-o", file)
    assert document["schema"] == "edge-ident/simulation/1"
    assert document["samples"] == 8742
    assert document["sha256"] == hashlib.sha256(file.read_bytes()).hexdigest()
    found = identify(load_recording(file), None)
    for name, axis in found.axes.items():
        truth = FEED_DRIVE[name]
        estimate = axis.estimate
        assert estimate.parameters[0] == pytest.approx(truth.inertia, rel=0.03)
        assert estimate.parameters[1] == pytest.approx(truth.viscous_friction, rel=0.01)
        assert estimate.parameters[2] == pytest.approx(truth.coulomb_friction, rel=0.01)
        assert estimate.parameters[3] == pytest.approx(truth.offset, abs=0.01)


def test_a_model_file_in_metres_on_a_recorded_motion_closes_the_circle(tmp_path: Path) -> None:
    """simulate, identify --output, and simulate again from the model that it left."""
    save_model(linear_axis(), tmp_path / "truth.json")
    motion, file = lap(tmp_path / "lap.csv", 6.0), tmp_path / "rec.csv"
    run("simulate", "--model", tmp_path / "truth.json", "--motion", motion,
        "--encoder-counts", "2e7", "--noise", "0.01", "--stiff", "-o", file)  # fmt: skip
    recording = load_recording(file)
    assert recording.axes["q"].reference is not None
    assert np.median(np.diff(recording.time_s)) == pytest.approx(0.002)
    run("identify", file, "--output", tmp_path / "found")
    left = load_model(tmp_path / "found" / "model.json")
    np.testing.assert_allclose(left.axes["q"].parameters, (95.0, 203.0, 20.0, -3.0), rtol=0.05)
    assert left.recordings[0].file == "rec.csv"
    again = run("simulate", "--model", tmp_path / "found" / "model.json", "--motion", file,
                "-o", tmp_path / "again.npz")  # fmt: skip
    assert again["axes"]["q"]["effort_unit"] == "N"


def test_an_effect_of_the_model_file_is_in_the_record(tmp_path: Path) -> None:
    """A ripple of 6 N at a known period is what the base model leaves unexplained."""
    ripple = Term("torque_ripple", {"cosine": 0.0, "sine": 6.0, "period": 0.02})
    save_model(linear_axis(ripple), tmp_path / "model.json")
    run("simulate", "--model", tmp_path / "model.json", "--motion", lap(tmp_path / "lap.csv"),
        "--encoder-counts", "0", "--stiff", "-o", tmp_path / "rec.npz")  # fmt: skip
    axis = load_recording(tmp_path / "rec.npz").axes["q"]
    wave = np.sin(2 * np.pi * axis.position / 0.02)
    time = 0.002 * np.arange(len(wave))
    speed = np.gradient(axis.position, time)
    columns = np.column_stack(
        [np.gradient(speed, time), speed, np.sign(speed), np.ones_like(speed), wave]
    )
    steady = np.abs(speed) > 0.02
    found = np.linalg.lstsq(columns[steady], axis.effort[steady], rcond=None)[0]
    assert found[4] == pytest.approx(6.0, rel=0.05)


def test_a_seed_gives_the_same_bytes(tmp_path: Path) -> None:
    save_model(linear_axis(), tmp_path / "model.json")
    motion = lap(tmp_path / "lap.csv", 1.0)
    bytes_of = []
    for seed in ("1", "1", "2"):
        run("simulate", "--model", tmp_path / "model.json", "--motion", motion,
            "--noise", "0.02", "--seed", seed, "-o", tmp_path / "rec.csv")  # fmt: skip
        bytes_of.append((tmp_path / "rec.csv").read_bytes())
    assert bytes_of[0] == bytes_of[1] != bytes_of[2]


def test_wrong_usage_and_bad_models_say_what_to_do(tmp_path: Path) -> None:
    code, message = refused("simulate", "-o", tmp_path / "rec.txt")
    assert code == 2
    assert ".npz" in message
    code, message = refused("simulate", "--motion", "staircase", "--cycles", "2", "-o", "rec.csv")
    assert code == 2
    assert "no periods" in message
    code, message = refused("simulate", "--model", tmp_path / "none.json", "-o", tmp_path / "r.csv")
    assert code == 5
    assert "next:" in message
    save_model(linear_axis(), tmp_path / "model.json")
    (tmp_path / "other.csv").write_text(lap(tmp_path / "lap.csv").read_text().replace("_m", "_rad"))
    code, message = refused(
        "simulate", "--model", tmp_path / "model.json", "--motion", tmp_path / "other.csv",
        "-o", tmp_path / "r.csv",
    )  # fmt: skip
    assert code == 5
    assert "axis q (m)" in message
    assert not (tmp_path / "r.csv").exists()


def test_help_has_an_example() -> None:
    done = CliRunner().invoke(app, ["simulate", "--help"])
    assert done.exit_code == 0
    assert "Example:" in done.stdout


def test_a_drive_that_runs_away_is_an_error_not_a_recording(tmp_path: Path) -> None:
    """On top of a hill much steeper than soft gains can hold."""
    hill = {"stiffness": -1e6, "curvature": 0.0, "cosine": 0.0, "sine": 0.0, "period": 1.0}
    save_model(linear_axis(Term("position_dependent_load", hill)), tmp_path / "model.json")
    code, message = refused(
        "simulate", "--model", tmp_path / "model.json",
        "--motion", lap(tmp_path / "lap.csv", 1.0), "-o", tmp_path / "rec.csv",
    )  # fmt: skip
    assert code == 5
    assert "does not follow" in message
    assert not (tmp_path / "rec.csv").exists()


@pytest.mark.parametrize(
    "asked",
    [{"noise": np.nan}, {"noise": -1.0}, {"encoder_counts": -1.0}, {"motion": "spiral"}],
)
def test_what_cannot_be_simulated_is_refused(asked: dict[str, Any]) -> None:
    with pytest.raises(edge_ident.EdgeIdentError):
        edge_ident.simulate(**asked)
