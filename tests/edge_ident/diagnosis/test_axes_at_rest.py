"""An axis that rests in one of two recordings: each axis is diagnosed where it moves."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from edge_ident.diagnosis.diagnose import diagnose
from edge_ident.errors import DataError
from edge_ident.report.diagnosis import diagnosis_document
from edge_ident.signals.read_columns import ReadOptions
from edge_ident.signals.recording import AxisRecord, Recording
from edge_ident.signals.recording_files import load_recording, save_recording

Array = NDArray[np.float64]

TIME_S = np.arange(0.0, 16.0, 5e-3)
PUSH = 0.1
"""Effort on each axis per acceleration of the other."""
COUNT = 2.4e-5
INERTIA = {"x": 0.4, "y": 0.2}


def motion(seed: int) -> Array:
    """Position, velocity and acceleration (3, N)."""
    rng = np.random.default_rng(seed)
    w = 2.0 * np.pi * np.array([0.2, 0.5, 0.9, 1.4])
    angle = w * TIME_S[:, None] + rng.uniform(0.0, 2.0 * np.pi, 4)
    sizes = np.array([0.6, 0.3, 0.2, 0.1])
    signals = [np.sin(angle) @ sizes, np.cos(angle) @ (sizes * w), -np.sin(angle) @ (sizes * w**2)]
    return np.array(signals)


def recorded(folder: Path, seed: int, *resting: str) -> Recording:
    """Two axes that push each other, from a file."""
    rng = np.random.default_rng(seed)
    moved = {name: motion(10 * seed + k) for k, name in enumerate("xy")}
    moved |= {name: np.full_like(moved[name], [[0.7], [0.0], [0.0]]) for name in resting}
    axes = {}
    for name, other in ("xy", "yx"):
        q, v, a = moved[name]
        effort = INERTIA[name] * a + 1.5 * v + 2.0 * np.sign(v) + PUSH * moved[other][2]
        effort += 0.02 * rng.standard_normal(len(TIME_S))
        axes[name] = AxisRecord(COUNT * np.round(q / COUNT), effort, "rad", "N*m")
    path = folder / f"{seed}.csv"
    save_recording(Recording(TIME_S, axes, path.name), path)
    return load_recording(path)


def test_each_axis_is_diagnosed_where_it_moves(tmp_path: Path) -> None:
    both, alone = recorded(tmp_path, 1), recorded(tmp_path, 2, "y")
    found = diagnose([alone, both])
    for name, axis in found.axes.items():
        (cause,) = axis.causes
        assert cause.term.effect == "cross_axis_coupling"
        assert float(cause.term.values["inertia"]) == pytest.approx(PUSH, rel=0.01)
        assert axis.model.parameters[0] == pytest.approx(INERTIA[name], rel=0.01)
    assert set(found.axes["x"].traces.recording) == {0, 1}
    assert set(found.axes["y"].traces.recording) == {1}
    assert found.axes["x"].base.motion_error is not None, "of the recording in which both move"
    assert set(diagnosis_document(found, None)["axes"]) == {"x", "y"}


def test_joints_that_leave_much_are_told_in_which_order_they_were_taken(tmp_path: Path) -> None:
    both = recorded(tmp_path, 1)
    x, y = (both.axes[name] for name in "xy")
    pushed = y.effort + np.sin(3.0 * x.position) * np.cos(4.0 * y.position)
    odd = replace(both, axes={"x": x, "y": replace(y, effort=pushed)})
    (said,) = [f for f in diagnose([odd]).axes["y"].findings if f.code == "order_of_joints"]
    assert said.message.endswith("carry those behind it in the recording: x, y")
    assert "--axis y --axis x" in said.next_step
    slides = {n: replace(a, position_unit="m", effort_unit="N") for n, a in odd.axes.items()}
    straight = diagnose([replace(odd, axes=slides)]).axes["y"]
    assert "order_of_joints" not in {f.code for f in straight.findings}
    other = load_recording(tmp_path / "1.csv", options=ReadOptions(axes=("y", "x")))
    assert list(other.axes) == ["y", "x"]


def test_axes_that_move_one_at_a_time(tmp_path: Path) -> None:
    one, other = recorded(tmp_path, 3, "y"), recorded(tmp_path, 4, "x")
    found = diagnose([one, other])
    assert {name: axis.causes for name, axis in found.axes.items()} == {"x": (), "y": ()}
    assert "other_axes_not_recorded" not in {f.code for f in found.axes["x"].findings}
    with pytest.raises(DataError, match="no drive moves axis x in it"):
        diagnose([one], validate=other)


def test_an_axis_that_rests_in_the_recording_for_validation_is_not_validated(
    tmp_path: Path,
) -> None:
    found = diagnose([recorded(tmp_path, 5)], validate=recorded(tmp_path, 6, "y"))
    assert set(found.validation) == {"x"}
    assert found.validation["x"].causes[0].carries_over
