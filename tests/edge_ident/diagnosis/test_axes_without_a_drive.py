"""An axis without a drive acts on one that has one: its position is enough to tell how."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from edge_ident.control.gain_design import design_gains
from edge_ident.diagnosis.diagnose import diagnose
from edge_ident.diagnosis.measures import Verdict
from edge_ident.diagnosis.result import Diagnosis
from edge_ident.errors import DataError, GainError, ModelError
from edge_ident.identification.identify import identify
from edge_ident.model.model_files import load_model, save_model
from edge_ident.signals.recording import AxisRecord, PassiveAxis, Recording
from edge_ident.signals.recording_files import inspect_recording, load_recording, save_recording

Array = NDArray[np.float64]

MASS, HUNG = 1.5, 0.08
"""Of carriage and pendulum together in kg; mass times length of the pendulum in kg·m."""


def sines(t: Array, rates: Array, sizes: Array, rng: np.random.Generator) -> tuple[Array, ...]:
    """Position, velocity and acceleration of a sum of sines of random phase."""
    angle = rates * t[:, None] + rng.uniform(0.0, 2.0 * np.pi, len(rates))
    position, velocity = np.sin(angle) @ sizes, np.cos(angle) @ (sizes * rates)
    return position, velocity, -np.sin(angle) @ (sizes * rates**2)


def carriage(seed: int, unit: str = "m") -> Recording:
    """A carriage under a force, and a pendulum that swings on it as it likes."""
    rng = np.random.default_rng(seed)
    t = np.arange(0.0, 20.0, 5e-3)
    x, v, a = sines(t, 2.0 * np.pi * np.array([0.2, 0.5, 0.9]), np.array([0.12, 0.05, 0.02]), rng)
    q, w, b = sines(t, 2.0 * np.pi * np.array([0.3, 0.85]), np.array([0.6, 0.5]), rng)
    force = MASS * a + 4.0 * v + 1.5 * np.sign(v) + HUNG * (np.cos(q) * b - np.sin(q) * w**2)
    force += 0.02 * np.std(force) * rng.standard_normal(len(t))
    axis = AxisRecord(np.round(x / 2e-5) * 2e-5, force, unit, "N" if unit == "m" else "N*m")
    hung = PassiveAxis(np.round(q / 1.5e-3) * 1.5e-3, "rad")
    return Recording(t, {"cart": axis}, f"{seed}.csv", passive={"pole": hung})


@pytest.fixture(scope="module")
def found() -> Diagnosis:
    return diagnose([carriage(0)])


def test_what_hangs_on_a_carriage_is_told_from_its_own_angle(found: Diagnosis) -> None:
    axis = found.axes["cart"]
    assert axis.verdict is Verdict.EXPLAINED
    (cause,) = axis.causes
    assert (cause.term.effect, cause.term.source_axis) == ("cross_axis_coupling", "pole")
    assert float(cause.term.values["carried_cosine"]) == pytest.approx(HUNG, rel=0.01)
    assert axis.model.parameters[:3] == pytest.approx([MASS, 4.0, 1.5], rel=0.02)


def test_the_written_model_serves_where_the_other_axis_is_recorded(
    found: Diagnosis, tmp_path: Path
) -> None:
    save_model(found.model, tmp_path / "model.json")
    model = load_model(tmp_path / "model.json")
    assert model.passive == ["pole"]
    other = carriage(1)
    known = identify(other, model=model, diagnose=False)
    assert known.axes["cart"].trusted
    assert known.axes["cart"].adequacy.adequate
    with pytest.raises(ModelError, match="needs the motion of axis pole"):
        identify(replace(other, passive={}), model=model, diagnose=False)


def test_no_gains_are_designed_for_what_swings_without_a_drive(found: Diagnosis) -> None:
    with pytest.raises(GainError, match="pole, which no drive moves"):
        design_gains(found.model)


def test_a_file_keeps_it_and_says_so(tmp_path: Path) -> None:
    path = tmp_path / "carriage.csv"
    save_recording(carriage(0), path)
    (said,) = inspect_recording(path).assumptions
    assert said.startswith("pole has no effort: it is not identified")
    read = load_recording(path)
    assert list(read.axes) == ["cart"]
    assert read.passive["pole"].position_unit == "rad"


def test_a_position_alone_is_no_recording(tmp_path: Path) -> None:
    t = np.arange(0.0, 4.0, 5e-3)
    rows = np.column_stack([t, np.sin(t)])
    path = tmp_path / "alone.csv"
    np.savetxt(path, rows, delimiter=",", header="time_s,x_position_rad", comments="")
    with pytest.raises(DataError, match="axis x has no effort column"):
        load_recording(path)


def hanging_arm(seed: int) -> Recording:
    """A driven link that hangs, and a free one on it: weight is nearly all of the torque."""
    rng = np.random.default_rng(seed)
    t = np.arange(0.0, 20.0, 5e-3)
    x, v, a = sines(t, 2.0 * np.pi * np.array([0.2, 0.5, 0.9]), np.array([1.2, 0.5, 0.2]), rng)
    q, w, b = sines(t, 2.0 * np.pi * np.array([0.3, 1.1]), np.array([0.3, 0.2]), rng)
    torque = (0.024 + 0.016 * np.cos(q)) * a + (0.004 + 0.008 * np.cos(q)) * b
    torque -= 0.008 * np.sin(q) * (2.0 * v + w) * w
    torque += 0.6 * np.sin(x) + 0.25 * np.sin(x + q) + 0.03 * v + 0.02 * np.sign(v)
    torque += 0.02 * np.std(torque) * rng.standard_normal(len(t))
    arm = AxisRecord(np.round(x / 1.5e-3) * 1.5e-3, torque, "rad", "N*m")
    free = PassiveAxis(np.round(q / 1.5e-3) * 1.5e-3, "rad")
    return Recording(t, {"arm": arm}, f"{seed}.csv", passive={"free": free})


def test_an_effort_that_is_mostly_weight_belongs_to_its_motion() -> None:
    """Inertia and friction alone explain less of it than of many a noise. Beside them the weight of
    the free link is found in the wrong sense first."""
    axis = identify(hanging_arm(0)).axes["arm"]
    assert axis.diagnosis is not None
    causes = [(cause.term.effect, cause.term.source_axis) for cause in axis.diagnosis.causes]
    assert causes == [("position_dependent_load", "free"), ("cross_axis_coupling", "free")]
    assert "unrelated_effort" not in {finding.code for finding in axis.findings}
    assert axis.model.parameters[0] == pytest.approx(0.024, rel=0.02)
