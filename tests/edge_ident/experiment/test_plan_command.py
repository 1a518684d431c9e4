"""`edge-ident plan` from end to end: recording, motion file, capture on a board, simulation."""

import json
from pathlib import Path

import pytest
from typer.testing import CliRunner

from edge_ident.cli import app
from edge_ident.diagnosis import diagnose as engine
from edge_ident.drive.motions import load_motion
from edge_ident.experiment.plan import BoardSide, plan_motion
from edge_ident.signals.recording import Recording
from edge_ident.signals.recording_files import load_recording, save_recording
from edge_ident.simulation.simulate import simulate
from tests.edge_ident.experiment.problems import one_axis, rival_pair, supposed, term
from tests.edge_ident.shared_board import SharedBoard


def run(*arguments: object) -> tuple[int, str, str]:
    done = CliRunner().invoke(app, [*map(str, arguments)])
    assert done.exception is None or isinstance(done.exception, SystemExit), done
    return done.exit_code, done.stdout, done.stderr


@pytest.fixture(scope="module")
def planned(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, dict]:
    """A capture of the virtual board, and the plan that follows from it."""
    folder = tmp_path_factory.mktemp("plan")
    with pytest.MonkeyPatch.context() as patch:
        SharedBoard(patch).json("capture", "--output", folder)
    motion = folder / "motion.json"
    code, text, errors = run("plan", folder / "capture.npz", "--output", motion, "--json")
    assert code == 0, errors
    assert f"capture --motion {motion}" in errors
    return motion, json.loads(text)


def test_it_separates_what_one_sinusoid_cannot_test(planned: tuple[Path, dict]) -> None:
    _, document = planned
    assert document["schema"] == "edge-ident/plan/1"
    assert {pair["why"] for pair in document["pairs"]} == {"untested"}
    assert all(pair["before"] < pair["needed"] <= pair["after"] for pair in document["pairs"])
    for use in document["axes"].values():
        for quantity in ("travel_rad", "speed_rad_s", "acceleration_rad_s2", "effort_nm"):
            assert use["worst"][quantity] <= 0.9001 * use["limit"][quantity]


def test_the_file_is_the_motion_of_the_document(planned: tuple[Path, dict]) -> None:
    motion, document = planned
    assert json.loads(motion.read_text()) == document["motion"]
    assert document["motion_file"] == str(motion)


def test_a_board_follows_the_motion(
    planned: tuple[Path, dict], monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    motion, _ = planned
    shared = SharedBoard(monkeypatch)
    shared.json("capture", "--motion", motion, "--output", tmp_path)
    recording = load_recording(tmp_path / "capture.npz")
    trajectory = load_motion(motion)
    assert recording.time_s[-1] == pytest.approx(trajectory.duration_s, abs=0.01)


def test_an_axis_that_the_motion_leaves_at_rest_is_no_fault_of_the_capture(
    planned: tuple[Path, dict], monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """As where the recordings that it was designed from have the other axis alone."""
    document = json.loads(planned[0].read_text())
    for component in document["axes"]["z"]["components"]:
        component["amplitude_rad"] = 0.0
    alone = tmp_path / "alone.json"
    alone.write_text(json.dumps(document))
    SharedBoard(monkeypatch).json("capture", "--motion", alone, "--output", tmp_path)
    code, _, errors = run("identify", tmp_path / "capture.npz")
    assert code in (0, 1)
    assert "axis z rests, and is not identified" in " ".join(errors.split())


def test_a_motion_of_other_axes_is_refused_by_the_board(
    planned: tuple[Path, dict], monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    document = json.loads(planned[0].read_text())
    del document["axes"]["z"]
    alone = tmp_path / "alone.json"
    alone.write_text(json.dumps(document))
    code, _, errors = SharedBoard(monkeypatch).run(
        "capture", "--motion", alone, "--output", tmp_path
    )
    assert code == 5
    assert "the motion is one of axes x, the board has x, z" in errors


def test_a_motion_of_too_few_samples_is_refused_before_it_moves(
    planned: tuple[Path, dict], monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    short = tmp_path / "short.json"
    short.write_text(json.dumps({**json.loads(planned[0].read_text()), "duration_s": 0.001}))
    code, _, errors = SharedBoard(monkeypatch).run("capture", "--motion", short)
    assert code == 5
    assert "duration_s of 0.001 is too short for 200 samples" in errors
    assert "at least 0.5 s" in errors


def test_a_file_has_no_periods(planned: tuple[Path, dict], monkeypatch: pytest.MonkeyPatch) -> None:
    code, _, errors = SharedBoard(monkeypatch).run("capture", "--motion", planned[0], "--cycles", 2)
    assert code == 2
    assert "has no periods" in errors


def test_without_a_second_axis_its_effects_are_left_out_for_that_reason(tmp_path: Path) -> None:
    recording = simulate()
    alone = Recording(recording.time_s, {"x": recording.axes["x"]}, "alone")
    save_recording(alone, tmp_path / "alone.npz")
    code, text, errors = run("plan", tmp_path / "alone.npz", "--json")
    document = json.loads(text)
    assert code == 0, document["pairs"]
    reasons = {left["effect"]: left["reason"] for left in document["left_out"]}
    assert set(reasons) == {"cross_axis_coupling", "pose_dependent_inertia"}
    assert set(reasons.values()) == {
        "the recordings have no second axis, whose motion would show it"
    }
    assert "limits: those of the built-in drive" in errors
    assert "--drive FILE" in errors


@pytest.mark.thorough
def test_what_nothing_separates_ends_with_1_and_writes_nothing(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    recording, diagnosis = rival_pair("asymmetric_friction", "nonlinear_viscous")
    tiny = supposed(recording, diagnosis, term("asymmetric_friction", difference=1e-5), None)
    monkeypatch.setattr(engine, "diagnose", lambda *_, **__: tiny)
    save_recording(recording, tmp_path / "recording.npz")
    motion = tmp_path / "motion.json"
    code, text, errors = run("plan", tmp_path / "recording.npz", "-o", motion)
    assert code == 1
    assert "no motion inside the limits can show whether there is asymmetric friction" in text
    assert "next:" in errors
    assert not motion.exists()


def test_a_missing_recording_and_a_damaged_motion_are_refused(tmp_path: Path) -> None:
    assert run("plan", tmp_path / "none.csv")[0] == 5
    (tmp_path / "motion.json").write_text("{}")
    code, _, errors = run(
        "simulate", "--motion", tmp_path / "motion.json", "-o", tmp_path / "out.npz"
    )
    assert code == 5
    assert "its schema is not edge-ident/motion/1" in errors


def test_with_a_board_its_own_limits_and_loop_count(monkeypatch: pytest.MonkeyPatch) -> None:
    """Soft gains fall behind: the board's limit of the following error bounds the motion."""
    board = SharedBoard(monkeypatch).board
    side = BoardSide(board.limits(), board.active_gains(), board.identity.control_delay_s)
    recording, diagnosis = rival_pair("asymmetric_friction", "nonlinear_viscous")
    plan = plan_motion(diagnosis, [recording], one_axis(), board=side)
    assert plan.loops == "the loop is that of the gains in force"
    use = plan.axes["x"]
    assert use.limit.following_rad == pytest.approx(0.6)
    assert 0.0 < use.worst.following_rad <= 0.9001 * 0.6
