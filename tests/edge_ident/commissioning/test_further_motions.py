"""The drive's own multisine as a further motion: a spring that looks like inertia, a drift.

Nothing is made by hand here: the machines have hidden faults, and are diagnosed.
"""

from dataclasses import replace
from io import StringIO
from pathlib import Path

import numpy as np
import pytest
from rich.console import Console

from edge_ident.commissioning import separation
from edge_ident.commissioning.further_motions import lines_in_doubt, livelier_motion
from edge_ident.commissioning.identification_motions import IdentificationMotion, Plan, Study
from edge_ident.commissioning.run import Outcome, commission
from edge_ident.diagnosis.measures import SpectralLine, Verdict
from edge_ident.diagnosis.result import AxisDiagnosis, OutsideVibration
from edge_ident.drive.description import load_drive
from edge_ident.drive.motions import named_trajectory
from edge_ident.identification.identify import identify
from edge_ident.identification.result import Identification
from edge_ident.report.render import rendered
from edge_ident.report.run import outcome_view
from edge_ident.signals.recording_files import load_recording
from edge_ident.simulation.simulate import simulate
from firmware_interface.board import Board
from firmware_interface.motion import Multisine, SineComponent, Trajectory, reference
from firmware_interface.plant import Hidden
from firmware_interface.virtual.board import VirtualBoard
from tests.edge_ident.diagnosis.hand_made import axis
from tests.short_runs import Listening, Silent


def run(
    virtual: VirtualBoard, folder: Path, observer: Silent | None = None, **plan: object
) -> Outcome:
    wanted = Plan(**{"write": False, **plan})  # type: ignore[arg-type]
    board = Board.connect(virtual)
    return commission(board, load_drive(), None, wanted, folder, observer or Silent())


def drawn(seed: int) -> VirtualBoard:
    """A machine with a fault that nobody chose."""
    return VirtualBoard(plant=Hidden.drawn(seed).plant())


@pytest.mark.thorough
def test_the_harmonics_of_a_cause_are_no_lines(tmp_path: Path) -> None:
    """The other axis's friction turns round at once, which has harmonics above the band. It has a
    law of its own, which leaves something at each reversal."""
    after = run(drawn(1007), tmp_path, most_motions=1).identification.axes["z"].diagnosis
    assert after is not None
    assert after.causes[0].term.effect == "cross_axis_coupling"
    assert after.explained_share > 0.98
    assert all(line.frequency_range_hz is not None for line in after.lines)


@pytest.mark.thorough
def test_a_push_is_no_wave_over_the_way_that_the_axis_has_gone_meanwhile(tmp_path: Path) -> None:
    """An order that half a second of effort looked like spoiled the push itself. It acts at the top
    speed, so it is only suspected."""
    outcome = run(drawn(1081), tmp_path, most_motions=1)
    after = outcome.identification.axes["z"].diagnosis
    assert after is not None
    assert [cause.term.effect for cause in after.suspected] == ["disturbance_event"]
    assert after.minor == after.causes == ()


def test_what_friction_makes_at_the_reversals_is_no_vibration(tmp_path: Path) -> None:
    """The encoder does not show it, and a second motion is not asked for."""
    outcome = run(drawn(1049), tmp_path)
    (made,) = outcome.separation.motions
    found = made.found.axes["z"].diagnosis
    assert found is not None
    assert [cause.term.effect for cause in found.causes] == ["asymmetric_friction"]
    assert found.verdict is Verdict.EXPLAINED
    assert found.lines == ()
    assert outcome.identification.trusted


def test_time_goes_on_from_one_motion_to_the_next(tmp_path: Path) -> None:
    """A drive that warms up: the second motion finds it warm, and no amplifier drifts like that."""
    outcome = run(drawn(1299), tmp_path)
    first, second = outcome.separation.motions
    assert second.sought == {"z": ("what changes with time",)}
    assert second.recording.begin_s > first.duration_s
    before, after = (made.found.axes["z"].diagnosis for made in (first, second))
    assert before is not None
    assert after is not None
    (either,) = before.causes
    names = {either.term.effect, *(other.effect for other in either.inseparable)}
    assert names >= {"warm_up", "gain_drift"}
    [cause] = after.causes
    assert cause.term.effect == "warm_up"
    assert not cause.inseparable
    assert after.verdict is Verdict.EXPLAINED
    assert outcome.identification.axes["z"].end_s > second.recording.begin_s
    assert outcome.identification.trusted


def spring() -> VirtualBoard:
    """On one sinusoid its effort is that of a negative inertia."""
    hidden = Hidden.of(["position_dependent_load"], "x")
    (hose,) = hidden.effects
    straight = replace(hose, hose=np.ones((1, 2)), slack=np.zeros((1, 2)))
    return VirtualBoard(plant=replace(hidden, effects=(straight,)).plant())


def test_a_spring_that_looks_like_inertia_is_named_on_a_livelier_motion(tmp_path: Path) -> None:
    listener = Listening()
    outcome = run(spring(), tmp_path, listener)
    first, second = outcome.separation.motions
    before, after = (made.found.axes["x"] for made in (first, second))
    assert before.adequacy.adequate
    assert before.diagnosis is None, "nothing is left to explain"
    assert not before.trusted
    assert before.estimate.parameters[0] < 0.0
    assert second.plan is None
    assert second.sought == {"x": ("inertia cannot be told from a spring",)}
    assert "on capture.npz: axis x, inertia cannot be told from a spring" in listener.said
    assert outcome.identification is second.found
    assert after.diagnosis is not None
    (cause,) = after.diagnosis.causes
    assert cause.term.effect == "position_dependent_load"
    assert all(other.separable for other in cause.alternatives)
    assert separation.diagnoses(outcome.identification).keys() == {"x"}
    assert outcome.identification.trusted
    assert after.estimate.parameters[0] == pytest.approx(0.43, rel=0.02)
    assert outcome.separation.ended == "one explanation is left"
    assert_time_is_told(outcome)


def assert_time_is_told(outcome: Outcome) -> None:
    own_ms, spent_ms = outcome.identification.timing_ms["total"], outcome.timing_ms
    assert 0.0 < spent_ms["diagnosis"] < spent_ms["total"]
    assert spent_ms["diagnosis"] <= spent_ms["separation"] + spent_ms["last_sample_to_verified"]
    console = Console(width=200, record=True, file=StringIO())
    console.print(rendered(outcome_view(outcome, details=True)))
    spent_s = 1e-3 * spent_ms["diagnosis"]
    told = f"identified in {own_ms:.0f} ms, diagnosed in {spent_s:.1f} s"
    assert told in console.export_text()


@pytest.fixture(scope="module")
def only_one(tmp_path_factory: pytest.TempPathFactory) -> Outcome:
    """A run on that board to which one motion is allowed."""
    folder = tmp_path_factory.mktemp("one")
    return run(spring(), folder, most_motions=1)


def test_a_livelier_motion_asks_for_less_effort_than_the_board_allows(
    only_one: Outcome, tmp_path: Path
) -> None:
    """Whatever the sign of the inertia that was found: its amount counts."""
    [first] = only_one.separation.motions
    board = Board.connect(spring())
    study = Study(Plan(), board, load_drive(), None, tmp_path, Silent())
    trajectory = livelier_motion(study, first)
    assert trajectory is not None
    lively = replace(first, trajectory=named_trajectory(load_drive(), "multisine"))
    assert livelier_motion(study, lively) is None
    times = np.linspace(0.0, trajectory.duration_s, 5000)
    way = reference(trajectory.axes["x"], times, trajectory.lead_in_s, 0.0)
    inertia, viscous, coulomb, offset = np.abs(first.found.axes["x"].estimate.parameters)
    effort = inertia * np.abs(way.acceleration_rad_s2) + viscous * np.abs(way.velocity_rad_s)
    most_nm = np.max(effort) + coulomb + offset
    assert 1.0 < most_nm < board.limits()["x"].effort_nm


def test_no_livelier_motion_where_one_is_allowed(only_one: Outcome) -> None:
    assert not only_one.identification.trusted
    assert only_one.separation.ended == (
        "axis x, inertia cannot be told from a spring after the one motion that was allowed"
    )


def test_no_livelier_motion_without_a_diagnosis(tmp_path: Path) -> None:
    outcome = run(spring(), tmp_path, diagnose=False)
    assert len(outcome.separation.motions) == 1
    assert not outcome.identification.trusted


def test_a_livelier_motion_that_takes_too_long_is_not_made(tmp_path: Path) -> None:
    outcome = run(spring(), tmp_path, most_s=40.0)
    assert len(outcome.separation.motions) == 1
    assert outcome.separation.ended.startswith("axis x, inertia cannot be told from a spring: ")
    assert outcome.separation.ended.endswith("would take 27 s, 13 s of 40 s are left")


def test_a_livelier_motion_that_the_board_refuses_is_not_made(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The board alone knows that its axis may not go as fast as the description says."""

    def too_fast(study: Study, first: IdentificationMotion) -> Trajectory:
        axes = {name: Multisine((SineComponent(3.0, 9.0, 0.0),)) for name in first.trajectory.axes}
        return replace(first.trajectory, axes=axes)

    monkeypatch.setattr(separation, "livelier_motion", too_fast)
    virtual = spring()
    outcome = run(virtual, tmp_path, write=True)
    assert outcome.good, "what was found and written before holds"
    assert not (tmp_path / "capture_2.npz").exists()
    status = Board.connect(virtual).status()
    assert not status.enabled
    assert not status.unconfirmed  # what was confirmed before it stays
    assert len(load_recording(tmp_path / "capture.npz").time_s) == 8742


# Lines above the band that alone keep an axis from being explained ask for a second motion.

LINES = (SpectralLine(None, 9.7, 0.1, 0.01), SpectralLine(None, 14.2, 0.2, 0.01))


def doubts(diagnosis: AxisDiagnosis) -> dict[str, tuple[str, ...]]:
    sound = identify(simulate(), diagnose=False)
    return lines_in_doubt(
        Identification({"x": replace(sound.axes["x"], diagnosis=diagnosis)}, sound.timing_ms)
    )


def test_a_line_alone_is_in_doubt() -> None:
    made = axis(Verdict.UNEXPLAINED)
    within = replace(made.extended, fitted=made.noise_floor)
    alone = replace(made, lines=LINES, extended=within)
    said = "the origin of 0.2 N*m at 14.2 Hz and 0.1 N*m at 9.7 Hz"
    assert doubts(alone) == {"x": (said,)}
    assert doubts(replace(alone, verdict=Verdict.EXPLAINED)) == {}
    vibrating = replace(alone, external_vibrations=(OutsideVibration(3.0, 0.1, "a.csv"),))
    assert doubts(vibrating) == {}, "no motion tells more of what shakes the axis"
    assert doubts(replace(alone, extended=replace(within, fitted=0.2))) == {}
