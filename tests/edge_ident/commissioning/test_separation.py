"""Motions that an open diagnosis asks for: how many are made, why they end, what is left of them.

The diagnoses are made by hand, and so is the motion that is designed: what a diagnosis finds and
how a motion is designed have tests of their own. A run with neither is in test_livelier_motion.py.
"""

from dataclasses import replace
from pathlib import Path

import pytest
from interrupted_link import InterruptedLink
from old_gains import assert_old_gains

from edge_ident.commissioning import identification_motions
from edge_ident.commissioning.identification_motions import Plan
from edge_ident.commissioning.run import Outcome, commission
from edge_ident.commissioning.separation import contradictions
from edge_ident.diagnosis.measures import Verdict
from edge_ident.diagnosis.result import AxisDiagnosis
from edge_ident.drive.description import Drive, load_drive
from edge_ident.errors import BoardError
from edge_ident.experiment import plan as planning
from edge_ident.experiment import plan as together
from edge_ident.experiment.limits import Use
from edge_ident.experiment.result import AxisUse, LeftOut, MotionPlan, PlannedPair, Why
from edge_ident.identification.identify import identify
from edge_ident.signals.recording_files import load_recording
from firmware_interface.board import Board
from firmware_interface.link import Link
from firmware_interface.motion import Trajectory
from firmware_interface.plant import Hidden
from firmware_interface.registers import Fault, State
from firmware_interface.virtual.board import VirtualBoard
from tests.edge_ident.diagnosis import hand_made
from tests.short_runs import Listening, brief_drive

OPEN = hand_made.axis(Verdict.EXPLAINED, hand_made.friction_by_direction())
RIVAL = "nonlinear_viscous"
PAIR = PlannedPair("x", "asymmetric_friction", RIVAL, Why.ALTERNATIVE, 0.4, 31.0, 31.0, 7.4, 0.0)


def closed() -> AxisDiagnosis:
    cause = replace(hand_made.friction_by_direction(), alternatives=())
    return hand_made.axis(Verdict.EXPLAINED, cause)


class Listener(Listening):
    """Keeps what was said, and stops the job at a stage."""

    def __init__(self, stop_at: str = "") -> None:
        super().__init__()
        self._stage, self._stop_at = "", stop_at

    def stage(self, title: str) -> None:
        self._stage = title

    def samples(self, in_hand: int, expected: int) -> None:
        if self._stage == self._stop_at and in_hand > 400:
            raise KeyboardInterrupt


def designed(trajectory: Trajectory | None, pair: PlannedPair = PAIR) -> MotionPlan:
    use = Use(1.6, 1.8, 2.1, 3.0, 0.1)
    uses = {axis: AxisUse(use, use, use.times(2.0)) for axis in ("x", "z")}
    return MotionPlan(trajectory, uses, (pair,), (), 0.1, "the loop", 100)


@pytest.fixture
def script(monkeypatch: pytest.MonkeyPatch) -> dict[str, object]:
    """What the diagnosis finds after the first and the further motions, and what is designed."""
    said: dict[str, object] = {
        "after": closed(),
        "plan": designed(brief_drive().trajectory()),
    }
    adequate = hand_made.axis(Verdict.ADEQUATE)

    def found(recording, network, *, diagnosed=None, **_):  # type: ignore[no-untyped-def]
        first = {"x": OPEN, "z": adequate}
        plain = identify(recording, network, diagnose=False)
        axes = {
            name: replace(axis, diagnosis=(diagnosed or first).get(name))
            for name, axis in plain.axes.items()
        }
        return replace(plain, axes=axes)

    monkeypatch.setattr(identification_motions, "identify", found)
    monkeypatch.setattr(planning, "plan_motion", lambda *_, **__: said["plan"])
    monkeypatch.setattr(
        together, "diagnose_together", lambda *_, **__: {"x": said["after"], "z": adequate}
    )
    return said


def run(
    link: Link,
    folder: Path,
    listener: Listener | None = None,
    drive: Drive | None = None,
    **plan: object,
) -> Outcome:
    board = Board.connect(link)
    try:
        wanted = Plan(**{"write": False, **plan})  # type: ignore[arg-type]
        return commission(
            board, drive or brief_drive(), None, wanted, folder, listener or Listener()
        )
    finally:
        board.close()


def test_a_second_motion_leaves_one_cause(script: dict[str, object], tmp_path: Path) -> None:
    listener = Listener()
    outcome = run(VirtualBoard(), tmp_path, listener)
    first, second = outcome.separation.motions
    assert (first.file, second.file) == ("capture.npz", "capture_2.npz")
    assert second.ruled_out == {"x": (RIVAL,), "z": ()}
    assert outcome.separation.ended == "one explanation is left"
    assert outcome.identification is second.found
    samples = [len(load_recording(tmp_path / made.file).time_s) for made in (first, second)]
    assert samples == [2185, 2185]
    [asked] = [line for line in listener.said if "to be settled" in line]
    assert "asymmetric friction or nonlinear viscous (distance 31, needed 7.4)" in asked
    assert any("speed 1.8 of 3.6 rad/s" in line for line in listener.said)


def test_one_motion_is_the_limit_where_one_is_allowed(
    script: dict[str, object], tmp_path: Path
) -> None:
    outcome = run(VirtualBoard(), tmp_path, most_motions=1)
    assert len(outcome.separation.motions) == 1
    assert outcome.separation.ended.endswith("after the one motion that was allowed")


def test_motions_end_when_they_are_used_up(script: dict[str, object], tmp_path: Path) -> None:
    """The first motion beyond the given one answers a question and leaves another."""
    other = replace(hand_made.friction_by_direction().alternatives[0], effect="torque_ripple")
    cause = replace(hand_made.friction_by_direction(), alternatives=(other,))
    script["after"] = hand_made.axis(Verdict.EXPLAINED, cause)
    outcome = run(VirtualBoard(), tmp_path, most_motions=2)
    files = [made.file for made in outcome.separation.motions]
    assert files == ["capture.npz", "capture_2.npz"]
    assert outcome.separation.ended.endswith("after the 2 that were allowed")


def test_what_stays_open_on_its_motion_is_not_asked_again(
    script: dict[str, object], tmp_path: Path
) -> None:
    script["after"] = OPEN
    outcome = run(VirtualBoard(), tmp_path)
    assert len(outcome.separation.motions) == 2
    assert outcome.separation.ended == (
        "axis x: what is left stayed open on a motion that was made for it"
    )


def test_a_motion_that_takes_too_long_is_not_made(
    script: dict[str, object], tmp_path: Path
) -> None:
    outcome = run(VirtualBoard(), tmp_path, most_s=12.0)
    assert len(outcome.separation.motions) == 1
    assert outcome.separation.ended.endswith("would take 7 s, 5 s of 12 s are left")
    assert not (tmp_path / "capture_2.npz").exists()


def test_that_no_motion_can_separate_them_is_said_with_the_number(
    script: dict[str, object], tmp_path: Path
) -> None:
    plan = designed(None, replace(PAIR, after=0.0, best=3.1))
    left = LeftOut("x", "gain_drift", "it belongs to the time of its recording")
    script["plan"] = replace(plan, left_out=(left,))
    outcome = run(VirtualBoard(), tmp_path)
    assert len(outcome.separation.motions) == 1
    assert (
        "axis x, no motion inside the limits can separate asymmetric friction and nonlinear "
        "viscous: the best reaches a distance of 3.1, needed is 7.4" in outcome.separation.ended
    )
    assert "gain drift: it belongs to the time" in outcome.separation.ended


def test_ctrl_c_in_the_second_motion_leaves_a_machine_at_rest_and_the_first_capture(
    script: dict[str, object], tmp_path: Path
) -> None:
    virtual, listener = VirtualBoard(), Listener("identification motion 2")
    with pytest.raises(KeyboardInterrupt):
        run(virtual, tmp_path, listener, write=True, diagnose_first=True)
    status = Board.connect(virtual).status()
    assert status.state is State.IDLE
    assert not status.enabled
    assert_old_gains(virtual)
    assert len(load_recording(tmp_path / "capture.npz").time_s) == 2185
    assert len(load_recording(tmp_path / "capture_2_partial.npz").time_s) > 400


def test_ctrl_c_in_the_diagnosis_keeps_what_was_confirmed(
    script: dict[str, object], tmp_path: Path
) -> None:
    virtual, listener = VirtualBoard(), Listener("identification motion 2")
    outcome = run(virtual, tmp_path, listener, write=True)
    assert outcome.confirmed
    assert outcome.good  # exit code 0
    assert "interrupted: the gains that were confirmed stay" in listener.said
    board = Board.connect(virtual)
    status = board.status()
    assert (status.state, status.enabled, status.unconfirmed) == (State.IDLE, False, False)
    assert board.active_gains()["x"].coulomb_feedforward > 1.0


def test_ctrl_c_while_a_motion_is_designed_leaves_a_machine_at_rest(
    script: dict[str, object], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def interrupted(*_: object, **__: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(planning, "plan_motion", interrupted)
    virtual = VirtualBoard()
    with pytest.raises(KeyboardInterrupt):
        run(virtual, tmp_path)
    status = Board.connect(virtual).status()
    assert (status.state, status.enabled) == (State.IDLE, False)
    assert len(load_recording(tmp_path / "capture.npz").time_s) == 2185


def test_a_fault_in_the_second_motion_leaves_the_gains_and_the_first_capture(
    script: dict[str, object], tmp_path: Path
) -> None:
    class StopsIt(InterruptedLink):
        """Somebody presses the emergency stop."""

        def _look(self, address: int, words: list[int]) -> None:
            machine = self.virtual.machine
            if self.starts == 2 and machine.capture.samples > 1000:
                self.virtual.inputs.press_stop()

    virtual = VirtualBoard()
    link = StopsIt(virtual, "draining", KeyboardInterrupt)
    with pytest.raises(BoardError, match="STO"):
        run(link, tmp_path, write=True, diagnose_first=True)
    assert virtual.machine.fault is Fault.STO
    assert_old_gains(virtual)
    assert len(load_recording(tmp_path / "capture.npz").time_s) == 2185


def test_a_sound_machine_makes_one_motion(tmp_path: Path) -> None:
    outcome = run(VirtualBoard(), tmp_path)
    assert [made.file for made in outcome.separation.motions] == ["capture.npz"]
    assert outcome.separation.ended == ""


# A model that the second motion contradicts: nothing is written from it.


def run_with(effects: list[str], folder: Path, **plan: object) -> tuple[Outcome, Listening]:
    hidden = Hidden.of(effects, "x")
    board, listener = Board.connect(VirtualBoard(plant=hidden.plant())), Listening()
    wanted = Plan(**plan)  # type: ignore[arg-type]
    return commission(board, load_drive(), None, wanted, folder, listener), listener


def test_a_weak_spring_that_one_sinusoid_hides_is_named_before_the_write(tmp_path: Path) -> None:
    """With a positive inertia, nothing on the sinusoid says that a part of it is a spring."""
    outcome, listener = run_with(["position_dependent_load=0.03"], tmp_path)
    first, second = outcome.separation.motions
    alone = first.found.axes["x"]
    assert alone.trusted
    assert alone.estimate.parameters[0] < 0.35
    assert second.file == "capture_multisine.npz"
    assert list(second.sought) == ["x"]
    assert any("capture_multisine.npz joins the identification" in said for said in listener.said)
    after = outcome.identification.axes["x"]
    assert after.compensated_effects == ("position_dependent_load",)
    assert after.estimate.parameters[0] == pytest.approx(0.43, rel=0.02)
    assert outcome.confirmed


def test_one_motion_alone_is_not_contradicted_by_a_second(tmp_path: Path) -> None:
    outcome, _ = run_with(["position_dependent_load=0.03"], tmp_path, most_motions=1, write=False)
    assert len(outcome.separation.motions) == 1


def test_the_second_motion_of_a_sound_machine_says_nothing(tmp_path: Path) -> None:
    outcome, _ = run_with([], tmp_path)
    assert len(outcome.separation.motions) == 1
    found = identify(load_recording(tmp_path / "capture.npz"))
    assert contradictions(found, load_recording(tmp_path / "capture_multisine.npz")) == {}
