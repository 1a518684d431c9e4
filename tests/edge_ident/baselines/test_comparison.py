"""The comparison as a whole: one row a method, failures with reasons, the real ball screw."""

import json
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from edge_ident.baselines import comparison
from edge_ident.baselines.comparison import compare
from edge_ident.baselines.methods import METHODS
from edge_ident.baselines.problem import Problem
from edge_ident.cli import app
from edge_ident.model.model import Estimate
from edge_ident.report.comparison import comparison_document
from edge_ident.signals.recording import AxisRecord, Recording
from edge_ident.signals.recording_files import load_recording, save_recording
from tests.edge_ident.baselines.drives import PERIOD_S, TRUTH, record
from tests.measured import MeasuredData


def test_emps_by_every_method(measured_data: MeasuredData) -> None:
    """Published values of the EMPS benchmark (Janot, Gautier, Brunot 2019)."""
    published = np.array([95.1089, 203.5034, 20.3935, -3.1648])
    axis = compare(load_recording(measured_data / "emps_train.csv"), None).axes["q"]
    rows = {row.method: row for row in axis.rows}
    assert list(rows) == list(METHODS)
    tolerance = {name: 0.05 for name in rows} | {
        "least_squares": 0.01,
        "ordinary_least_squares": 0.01,
    }
    for name in set(rows) - {"network", "random_search"}:
        row = rows[name]
        assert row.estimate is not None, row.reason
        np.testing.assert_allclose(row.estimate.parameters, published, rtol=tolerance[name])
        assert row.metric is not None
        assert row.metric.relative_residual == pytest.approx(0.0408, abs=0.001)
    assert rows["network"].estimate is None
    searched = rows["random_search"].metric
    assert searched is not None
    assert searched.relative_residual > 0.2


def test_ordinary_least_squares_has_the_smallest_residual_of_all() -> None:
    """All rows are scored on the same samples, so none can be below the minimum."""
    rng = np.random.default_rng(4)
    axis = compare(record(effort_noise=0.3 * rng.normal(size=8742)), None).axes["x"]
    misses = {row.method: row.metric.relative_residual for row in axis.rows if row.metric}
    assert len(misses) == len(axis.rows) - 1
    assert min(misses.values()) >= misses["ordinary_least_squares"] * (1 - 1e-6)


def test_one_methods_failure_costs_no_others_answer(monkeypatch: pytest.MonkeyPatch) -> None:
    def broken(problem: Problem) -> Estimate:
        raise np.linalg.LinAlgError("SVD did not converge")

    def endless(problem: Problem) -> Estimate:
        return Estimate(np.full(4, np.nan), np.ones(4))

    methods = {"broken": broken, "endless": endless, "sound": METHODS["least_squares"]}
    monkeypatch.setattr(comparison, "all_methods", lambda: methods)
    first, second, third = compare(record(), None).axes["x"].rows
    assert (first.estimate, first.reason) == (
        None,
        "the computation failed: SVD did not converge",
    )
    assert second.estimate is None
    assert "not finite" in second.reason
    assert third.estimate is not None


def test_what_cannot_be_told_apart_gets_no_numbers() -> None:
    """At one speed in one direction, Coulomb friction is an offset."""
    time = PERIOD_S * np.arange(4000)
    position = 3.0 * time + 0.5 * np.sin(2.0 * time)
    noise = 0.01 * np.random.default_rng(1).normal(size=4000)
    axis = AxisRecord(position, 1.0 + np.cos(2.0 * time) + noise, "rad", "N*m")
    found = compare(Recording(time, {"x": axis}, "test"), None).axes["x"]
    assert all(row.estimate is None for row in found.rows)
    assert "cannot be distinguished" in found.rows[2].reason


def test_short_records_and_uneven_sampling() -> None:
    """A quarter of the motion, its clock jittering by a tenth of a period."""
    whole = record(samples=2200)
    time = whole.time_s + 0.1 * PERIOD_S * np.random.default_rng(3).uniform(-1, 1, 2200)
    axis = whole.axes["x"]
    moved = np.interp(time, whole.time_s, axis.position), np.interp(time, whole.time_s, axis.effort)
    uneven = Recording(time, {"x": AxisRecord(*moved, "rad", "N*m")}, "test")
    for row in compare(uneven, None).axes["x"].rows:
        if row.method not in ("network", "random_search"):
            assert row.estimate is not None, row.reason
            np.testing.assert_allclose(row.estimate.parameters, TRUTH, rtol=0.03)


def test_document_and_picture_by_the_command(tmp_path: Path) -> None:
    path = tmp_path / "recording.npz"
    save_recording(record(), path)
    arguments = ["compare", str(path), "--json", "--output", str(tmp_path / "out")]
    some = ["--method", "least_squares", "--method", "network"]
    result = CliRunner().invoke(app, [*arguments, *some])
    assert result.exit_code == 0, result.stderr
    document = json.loads(result.stdout)
    assert document == json.loads((tmp_path / "out" / "comparison.json").read_text())
    assert document["schema"] == "edge-ident/comparison/1"
    methods = document["axes"]["x"]["methods"]
    assert list(methods) == ["least_squares", "network"]
    inertia = methods["least_squares"]["parameters"]["inertia"]
    assert inertia["value"] == pytest.approx(TRUTH[0], rel=0.01)
    assert inertia["unit"] == "kg*m^2"
    assert methods["network"]["parameters"] is None
    assert (
        "the axis moved otherwise than the network was trained for" in methods["network"]["reason"]
    )
    assert (tmp_path / "out" / "comparison.png").stat().st_size > 10_000


def test_table_and_usage(tmp_path: Path) -> None:
    path = tmp_path / "recording.npz"
    save_recording(record(), path)
    result = CliRunner().invoke(app, ["compare", str(path), "--method", "least_squares"])
    assert result.exit_code == 0
    assert "kg*m^2" in result.stdout
    assert "least" in result.stdout
    wrong = CliRunner().invoke(app, ["compare", str(path), "--method", "divination"])
    assert wrong.exit_code == 2
    assert "weighted_least_squares" in wrong.stderr


def test_the_document_has_numbers_that_any_parser_takes() -> None:
    text = json.dumps(comparison_document(compare(record(), None)), allow_nan=False)
    assert json.loads(text)["axes"]["x"]["methods"]["random_search"]["warnings"]
