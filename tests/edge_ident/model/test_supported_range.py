"""The range of each term: kept in the file, and said where it is left."""

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from typer.testing import CliRunner

from edge_ident.cli import app
from edge_ident.diagnosis.prepare.preparation import prepare_axis
from edge_ident.errors import ModelError
from edge_ident.estimation.trust import outside_support
from edge_ident.model.model import Model, SupportedRange, Term
from edge_ident.model.model_files import load_model, model_document, model_of, save_model
from edge_ident.signals.recording import AxisRecord, Recording
from edge_ident.signals.recording_files import save_recording
from edge_ident.simulation.simulate import reduced_model, simulate
from tests.repetitions import a_few

WIDE = SupportedRange((-10.0, 10.0), (-20.0, 20.0), (-50.0, 50.0), (-30.0, 30.0))
SLOW = replace(WIDE, speed=(-0.5, 0.5))
STRIBECK = {"level": 0.1, "speed": 0.05}


def model(supported: SupportedRange | None) -> Model:
    axes = {
        name: replace(
            axis, terms=(*axis.terms, Term("stribeck_friction", STRIBECK, supported=supported))
        )
        for name, axis in reduced_model().axes.items()
    }
    return Model(axes)


def test_only_what_leaves_by_more_than_an_eighth_is_reported() -> None:
    assert WIDE.left_by(replace(WIDE, speed=(-24.9, 20.0))) == ()
    [departure] = WIDE.left_by(replace(WIDE, speed=(-25.1, 20.0)))
    assert departure.quantity == "speed"
    assert departure.sentence("rad/s") == "speed -25.1 to 20 rad/s (supported -20 to 20)"
    assert [d.quantity for d in WIDE.left_by(replace(WIDE, effort=(0.0, 38.0)))] == ["effort"]


def test_the_range_survives_the_file(tmp_path: Path) -> None:
    save_model(model(SLOW), tmp_path / "model.json")
    left = load_model(tmp_path / "model.json").axes["x"].terms
    assert [term.supported for term in left] == [None, SLOW]


@pytest.mark.parametrize("ends", [[1.0], [2.0, 1.0], [0.0, float("nan")], "0 to 1", None])
def test_a_range_that_is_none_is_refused_with_its_place(ends: Any) -> None:
    document = json.loads(json.dumps(model_document(model(SLOW))))
    document["axes"]["x"]["terms"][1]["supported"]["speed"] = ends
    with pytest.raises(ModelError, match=r"stribeck_friction.*supported.*speed"):
        model_of(document, "a test")


def test_no_recording_leaves_the_range_that_it_supports() -> None:
    """What an effort does above the band of the diagnosis is in its range, too."""
    quiet = simulate()
    time_s, axis = quiet.time_s, quiet.axes["x"]
    effort = axis.effort + 9.0 * np.hanning(len(time_s)) * np.sin(2.0 * np.pi * 7.0 * time_s)
    recording = replace(quiet, axes={"x": replace(axis, effort=effort)})
    supported = prepare_axis([recording], "x").supported
    assert outside_support(model(supported), recording) == {"x": []}


@pytest.fixture
def file(tmp_path: Path) -> Path:
    """Two axes at up to 2.2 rad/s."""
    time_s = 0.0025 * np.arange(3000)
    phase = 1.1 * time_s
    position, velocity, acceleration = (
        2.0 * np.sin(phase),
        2.2 * np.cos(phase),
        -2.42 * np.sin(phase),
    )
    effort = 0.43 * acceleration + 0.9 * velocity + 1.4 * np.sign(velocity) + 0.1
    record = AxisRecord(position, effort, "rad", "N*m")
    save_recording(Recording(time_s, {"x": record, "z": record}, "test"), tmp_path / "laps.npz")
    return tmp_path / "laps.npz"


@pytest.mark.parametrize(
    ("supported", "warned"), a_few([(SLOW, True), (WIDE, False), (None, False)], [(SLOW, True)])
)
def test_identify_and_simulate_say_where_the_motion_leaves_the_range(
    file: Path, tmp_path: Path, supported: SupportedRange | None, warned: bool
) -> None:
    known = tmp_path / "known.json"
    save_model(model(supported), known)
    arguments = ["identify", file, "--model", known, "--no-diagnose", "--json"]
    done = CliRunner().invoke(app, [*map(str, arguments)])
    for axis in json.loads(done.stdout)["axes"].values():
        found = [w for w in axis["warnings"] if w["code"] == "outside_support"]
        assert bool(found) is warned
        assert all("speed -2.2 to 2.2 rad/s (supported -0.5 to 0.5)" in w["message"] for w in found)
        assert not any(w["blocks"] for w in found)
    arguments = ["simulate", "--model", known, "--motion", file, "-o", tmp_path / "made.npz"]
    done = CliRunner().invoke(app, [*map(str, arguments), "--json"])
    assert done.exit_code == 0, done.stderr
    said = [line for line in done.stderr.splitlines() if "warning: axis" in line]
    assert len(said) == (2 if warned else 0)
    axes = json.loads(done.stdout)["axes"].values()
    assert all(bool(axis["warnings"]) is warned for axis in axes)


def test_an_identified_base_term_says_where_it_holds(file: Path, tmp_path: Path) -> None:
    CliRunner().invoke(app, ["identify", str(file), "--output", str(tmp_path / "out")])
    base = load_model(tmp_path / "out" / "model.json").axes["x"].terms[0]
    assert base.supported is not None
    assert base.supported.speed == pytest.approx((-2.2, 2.2), rel=0.02)
    assert base.supported.position == pytest.approx((-2.0, 2.0), rel=0.02)
