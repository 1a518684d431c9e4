"""What the tests of measured recordings test, on recordings that the project makes itself."""

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from edge_ident.baselines.comparison import compare
from edge_ident.baselines.methods import METHODS
from edge_ident.diagnosis.diagnose import diagnose
from edge_ident.diagnosis.measures import Verdict
from edge_ident.diagnosis.result import AxisDiagnosis, Diagnosis
from edge_ident.estimation.network import load_network
from edge_ident.identification.identify import identify
from edge_ident.identification.result import ParameterSource
from edge_ident.model.model import Model
from edge_ident.model.model_files import load_model, save_model
from edge_ident.report.diagnosis import diagnosis_document
from edge_ident.signals.recording_files import load_recording
from edge_ident.simulation.simulate import simulate
from edge_ident.support.documents import to_json
from export.motion import motion_from
from tests.repetitions import a_few
from tests.synthetic import LAP_S, Synthetic, arm, carriage, motor


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("synthetic")


@pytest.fixture(scope="module")
def slide(folder: Path) -> Synthetic:
    return carriage(folder)


@pytest.fixture(scope="module")
def turning(folder: Path) -> Synthetic:
    return motor(folder)


@pytest.fixture(scope="module")
def joints(folder: Path) -> Synthetic:
    return arm(folder)


@cache
def diagnosed(path: Path) -> Diagnosis:
    """The diagnosis of a recording, which several tests look at."""
    return diagnose([load_recording(path)])


def found_on(axis: AxisDiagnosis) -> list[str]:
    return [cause.term.effect for cause in axis.causes]


@pytest.mark.stand_in
def test_the_slide_has_friction_by_direction_and_a_late_effort(slide: Synthetic) -> None:
    axis = diagnosed(slide.path).axes["q"]
    # beyond what the base model expresses, a delay of several samples is the larger one
    assert found_on(axis) == ["time_delay", "asymmetric_friction"]
    # friction by direction bends otherwise than the law of the catalogue
    wanted = {"delay": 0.05, "difference": 0.1}
    for cause, (value, rel) in zip(axis.causes, wanted.items(), strict=True):
        truth = slide.hidden[cause.term.effect]
        assert cause.term.values[value] == pytest.approx(truth, rel=rel)
    np.testing.assert_allclose(axis.extended.estimate.parameters[:3], slide.truth[:3], rtol=0.02)
    assert axis.noise_floor_source == "from the motion's repetition"
    assert axis.verdict is Verdict.EXPLAINED


def test_the_slide_moves_in_metres_and_newtons(slide: Synthetic) -> None:
    found = identify(load_recording(slide.path), load_network("fp32")).axes["q"]
    assert found.network_reason == "the network was trained for rad and N*m, not m and N"
    assert found.estimate.parameters[0] == pytest.approx(slide.truth[0], rel=0.03)


def test_every_method_says_what_the_slide_is(slide: Synthetic) -> None:
    rows = {row.method: row for row in compare(load_recording(slide.path), None).axes["q"].rows}
    assert list(rows) == list(METHODS)
    usual = rows["ordinary_least_squares"].estimate
    assert usual is not None
    # the delay of 18 ms, and more than timing takes, moves the viscous friction of all by 40 %
    np.testing.assert_allclose(usual.parameters[[0, 2]], slide.truth[[0, 2]], rtol=0.15)
    for name in set(rows) - {"network", "random_search"}:
        estimate = rows[name].estimate
        assert estimate is not None, rows[name].reason
        np.testing.assert_allclose(estimate.parameters[:3], usual.parameters[:3], rtol=0.15)


def test_a_network_can_be_trained_for_the_slides_laps(slide: Synthetic) -> None:
    found = motion_from(load_recording(slide.path), None, "slide")
    assert len(found.position) * found.period_s == pytest.approx(LAP_S, abs=2e-3)
    assert (found.position_unit, found.effort_unit) == ("m", "N")


@pytest.mark.stand_in
def test_the_motor_has_ripple_of_12_and_18_orders(turning: Synthetic) -> None:
    axis = diagnosed(turning.path).axes["m"]
    assert found_on(axis) == ["torque_ripple", "torque_ripple"]
    orders = [2.0 * np.pi / cause.term.values["period"] for cause in axis.causes]
    assert orders == pytest.approx([12.0, 18.0], abs=0.01)
    values = axis.causes[0].term.values
    assert np.hypot(values["cosine"], values["sine"]) == pytest.approx(0.05, rel=0.02)


def test_a_pause_in_the_time_stamps_is_said(turning: Synthetic) -> None:
    whole = load_recording(turning.path)
    kept = np.delete(np.arange(len(whole.time_s)), slice(3000, 3007))
    axis = whole.axes["m"]
    part = replace(axis, position=axis.position[kept], effort=axis.effort[kept])
    paused = replace(whole, time_s=whole.time_s[kept], axes={"m": part})
    found = diagnose([paused])
    assert "gaps" in {finding.code for finding in found.data_quality}
    assert set(found_on(found.axes["m"])) == {"torque_ripple"}


def test_a_motor_that_turns_one_way_is_not_trusted(turning: Synthetic) -> None:
    found = identify(load_recording(turning.path), None, diagnose=False)
    codes = {finding.code for finding in found.axes["m"].findings if finding.blocks}
    assert "inseparable" in codes
    assert not found.trusted


@pytest.mark.stand_in
def test_the_arm_bears_weight_and_its_joints_are_coupled(joints: Synthetic) -> None:
    """The load has no law of the catalogue; what that lacks of it is less than a tenth of it."""
    axes = diagnosed(joints.path).axes
    found = found_on(axes["j1"])
    assert found[:2] == ["position_dependent_load", "cross_axis_coupling"]
    shares = [cause.share for cause in axes["j1"].causes]
    assert all(share < 0.1 * shares[0] for share in shares[2:])
    assert found_on(axes["j2"]) == ["position_dependent_load"]
    for axis in axes.values():
        assert axis.extended.held_out <= 0.1 * axis.base.held_out
    assert axes["j1"].extended.estimate.parameters[0] == pytest.approx(joints.truth[0], rel=0.02)


def test_an_arm_that_bears_weight_is_not_trusted_by_its_base_model(joints: Synthetic) -> None:
    found = identify(load_recording(joints.path), None, diagnose=False)
    assert not found.trusted
    for axis in found.axes.values():
        codes = {finding.code for finding in axis.findings if finding.blocks}
        assert "poor_fit" in codes


@pytest.mark.stand_in
def test_the_arms_answer_is_that_of_the_extended_model(joints: Synthetic) -> None:
    found = identify(load_recording(joints.path), None)
    assert found.trusted
    axis = found.axes["j1"]
    assert axis.source is ParameterSource.EXTENDED_MODEL
    off = np.abs(axis.estimate.parameters - joints.truth)
    base = np.abs(axis.least_squares.parameters - joints.truth)
    assert np.all(off[:3] < 3.0 * axis.estimate.std[:3])
    assert off[0] < 0.02 * joints.truth[0] < base[0]


def test_the_same_recording_gives_the_same_document_byte_for_byte(turning: Synthetic) -> None:
    first, second = (
        to_json(diagnosis_document(found, None))
        for found in (diagnosed(turning.path), diagnose([load_recording(turning.path)]))
    )
    assert first == second


# ---- what a diagnosis writes can be read again, and says the same to every command that takes it


def written(found: Diagnosis, folder: Path) -> Model:
    save_model(found.model, folder / "model.json")
    return load_model(folder / "model.json")


@pytest.mark.parametrize("machine", a_few(["slide", "joints", "turning"], ["turning"]))
def test_a_written_model_leaves_the_same_residual_in_every_command(
    machine: str, request: pytest.FixtureRequest, tmp_path: Path
) -> None:
    """The residual of `diagnose` with the written model is that of the diagnosis that wrote it,
    within a fiftieth or a thousandth of the effort: the parameters are fitted again. `identify`
    compares in a wider band, where more noise is left; there the model must take away most of what
    it explains."""
    made: Synthetic = request.getfixturevalue(machine)
    recording, found = load_recording(made.path), diagnosed(made.path)
    known = written(found, tmp_path)
    again = diagnose([recording], model=known)
    compensated = identify(recording, model=known, diagnose=False)
    plain = identify(recording, diagnose=False)
    for name, axis in found.axes.items():
        left = again.axes[name].base.fitted
        assert left == pytest.approx(axis.extended.fitted, rel=0.02, abs=1e-3)
        if axis.causes:
            before, after = (
                identified.axes[name].metric.relative_residual
                for identified in (plain, compensated)
            )
            assert after**2 < 0.6 * before**2
            codes = {finding.code for finding in compensated.axes[name].findings}
            assert "outside_support" not in codes, "it is the recording that supports the model"


@pytest.mark.stand_in
def test_a_written_model_can_be_simulated_along_its_recording(
    slide: Synthetic, tmp_path: Path
) -> None:
    known = written(diagnosed(slide.path), tmp_path)
    moved = simulate(known, load_recording(slide.path), effort_resolution=0.0)
    for axis in diagnose([moved], model=known).axes.values():
        assert axis.base.fitted < 0.05, "the model knows what moved the simulated drive"
