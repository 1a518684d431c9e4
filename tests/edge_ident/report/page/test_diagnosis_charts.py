"""Charts of a diagnosis: each quantity, one scale for both models, and contributions that fit."""

from dataclasses import replace

import numpy as np
import pytest

from edge_ident.diagnosis.measures import Verdict
from edge_ident.diagnosis.result import Diagnosis
from edge_ident.report.page.diagnosis_charts import (
    cause_chart,
    effort_chart,
    followed,
    residual_chart,
    residual_charts,
    running_time,
)
from tests.edge_ident.diagnosis import hand_made


def test_every_quantity_has_a_map_and_its_unit() -> None:
    found = hand_made.diagnosis()
    linear = replace(found.axes["x"], model=replace(found.axes["x"].model, position_unit="m"))
    pairs = residual_charts("k", "x", {"x": linear, "z": found.axes["z"]})
    assert [pair[0].across for pair in pairs] == [
        ("position", "m"),
        ("velocity", "m/s"),
        ("distance since the axis turned back", "m"),
        ("time", "s"),
        ("acceleration of axis z", "rad/s²"),
    ]


def test_both_models_have_the_same_scale() -> None:
    found = hand_made.diagnosis()
    residual = found.axes["x"].traces.effort - found.axes["x"].traces.base_effort
    for before, after in residual_charts("k", "x", found.axes):
        assert before.y == after.y
        assert before.y.high > np.quantile(np.abs(residual), 0.95)


def test_a_contribution_lies_on_what_is_left_without_it() -> None:
    axes = hand_made.diagnosis().axes
    chart = cause_chart("k", "x", axes, axes["x"].causes[0])
    left, *means = chart.layers
    amplitude = np.hypot(*(hand_made.RIPPLE.values[part] for part in ("cosine", "sine")))
    assert max(layer.y.max() for layer in means) == pytest.approx(amplitude, rel=0.03)
    assert np.std(left.y) == pytest.approx(amplitude / np.sqrt(2.0), rel=0.1)


def test_what_repeats_is_drawn_over_one_repetition() -> None:
    axes = hand_made.diagnosis().axes
    chart = cause_chart("k", "x", axes, axes["x"].causes[0])
    assert chart.across[0] == "position within one repetition"
    assert chart.x.high <= hand_made.RIPPLE.values["period"]
    speed = cause_chart("k", "x", axes, axes["x"].causes[1])
    assert speed.across[0] == "velocity"


def test_noise_follows_nothing() -> None:
    axes = hand_made.diagnosis().axes
    traces = axes["z"].traces
    assert followed("z", axes, traces.effort - traces.extended_effort) is None
    assert followed("z", axes, np.sin(traces.position)) == "position"


def two_files(found: Diagnosis) -> Diagnosis:
    """The same samples as two recordings, the second of which starts its clock anew."""
    traces = found.axes["x"].traces
    half = len(traces.time_s) // 2
    second = np.arange(len(traces.time_s)) >= half
    time = np.where(second, traces.time_s - traces.time_s[half], traces.time_s)
    split = replace(traces, file=second.astype(np.intp), time_s=time)
    return replace(found, axes={"x": replace(found.axes["x"], traces=split)})


def test_several_recordings_are_drawn_one_after_the_other_with_a_gap() -> None:
    axis = two_files(hand_made.diagnosis()).axes["x"]
    assert np.allclose(np.diff(running_time(axis.traces)), hand_made.PERIOD_S)
    measured = effort_chart("k", axis).layers[0]
    assert np.isnan(measured.y).sum() == 1


def test_samples_that_do_not_count_are_gaps_of_the_residual() -> None:
    axis = hand_made.axis(Verdict.ADEQUATE)
    (missed,) = [layer for layer in residual_chart("k", axis).layers if layer.kind == "line"]
    assert np.array_equal(np.isnan(missed.y), ~axis.traces.valid)


def test_a_description_tells_the_numbers() -> None:
    axis = hand_made.axis(Verdict.ADEQUATE)
    said = effort_chart("k", axis).description
    assert "From 0 s to 10.0 s the measured torque goes from −" in said
    assert said.endswith("of it (rms).")
