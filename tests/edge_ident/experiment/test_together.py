"""What is open after a diagnosis, and what a further motion settles about it."""

from dataclasses import replace

import numpy as np
import pytest

from edge_ident.diagnosis.error_budget import AgreeingCurve
from edge_ident.diagnosis.measures import SpectralLine, Verdict
from edge_ident.diagnosis.result import AxisDiagnosis
from edge_ident.experiment import plan as together
from edge_ident.experiment.limits import Load
from edge_ident.experiment.open_causes import explanations, is_open, questions
from edge_ident.experiment.result import MotionPlan, PlannedPair, Why
from edge_ident.signals.recording import AxisRecord, Recording
from tests.edge_ident.diagnosis import hand_made
from tests.edge_ident.experiment.problems import cause, term

DRIFT = term("gain_drift", rate=0.01)
UNEVEN = term("position_dependent_friction", cosine=0.1, period=2.0)
BEND = hand_made.BUDGET.entries[0].curves[0]


def left(axis: AxisDiagnosis, share: float) -> AxisDiagnosis:
    """The same with a residual of this share of the effort."""
    return replace(axis, extended=replace(axis.extended, fitted=share), noise_floor=0.0005)


def drifting() -> AxisDiagnosis:
    """A drift, or friction that depends on the position: the first motion shows both alike."""
    return left(hand_made.axis(Verdict.EXPLAINED, cause(DRIFT, UNEVEN)), 0.001)


def line(frequency_hz: float) -> SpectralLine:
    return SpectralLine(None, frequency_hz, 0.05, 0.01)


def test_untested_effects_are_asked_for_where_structure_is_left_in_the_band() -> None:
    axis = hand_made.axis(Verdict.UNEXPLAINED, hand_made.ripple())
    assert not is_open(questions(left(axis, 0.002)))
    assert is_open(questions(left(axis, 0.03)))
    assert "backlash" in explanations(left(axis, 0.03))


def test_an_adequate_axis_asks_nothing() -> None:
    axis = replace(hand_made.axis(Verdict.ADEQUATE), suspected=(hand_made.ripple(),))
    assert not is_open(questions(axis))


def test_a_question_that_a_motion_was_made_for_is_not_asked_again() -> None:
    axis = hand_made.axis(Verdict.EXPLAINED, hand_made.friction_by_direction())
    asked = frozenset({"asymmetric_friction", "nonlinear_viscous"})
    assert is_open(questions(axis))
    assert not is_open(questions(axis, {asked}))
    doubtful = replace(axis, causes=(), suspected=(hand_made.ripple(),))
    assert not is_open(questions(doubtful, {frozenset({"torque_ripple"})}))


@pytest.fixture
def diagnosed(monkeypatch: pytest.MonkeyPatch) -> dict[int, AxisDiagnosis]:
    """What is found, by the number of recordings."""
    found: dict[int, AxisDiagnosis] = {}
    monkeypatch.setattr(together, "_diagnosed", lambda recordings, *_: found[len(recordings)])
    return found


def judge(earlier: AxisDiagnosis) -> AxisDiagnosis:
    record = AxisRecord(np.zeros(3), np.ones(3), "rad", "N*m")
    recordings = [
        Recording(np.array([0.0, 5.0, 10.0]), {"x": record}, f"capture_{n}.npz") for n in (1, 2)
    ]
    pair = PlannedPair("x", UNEVEN.effect, None, Why.ALTERNATIVE, 1.0, 60.0, 60.0, 9.0, 0.0)
    plan = MotionPlan(None, {}, (pair,), (), 0.1, "", 1)
    told = together.diagnose_together(
        recordings,
        ["x"],
        before={"x": earlier},
        plan=plan,
        model=None,
        on_progress=lambda stage, done, of: None,
    )
    return told["x"]


def test_one_model_of_all_recordings_is_the_answer(diagnosed: dict[int, AxisDiagnosis]) -> None:
    diagnosed[2] = left(hand_made.axis(Verdict.EXPLAINED, cause(UNEVEN)), 0.001)
    assert judge(drifting()) is diagnosed[2]


def test_a_machine_that_has_drifted_keeps_its_cause_and_loses_what_the_motion_did_not_show(
    diagnosed: dict[int, AxisDiagnosis],
) -> None:
    diagnosed[2] = left(hand_made.axis(Verdict.UNEXPLAINED), 0.03)
    diagnosed[1] = left(hand_made.axis(Verdict.ADEQUATE), 0.001)
    found = judge(drifting())
    assert [c.term.effect for c in found.causes] == ["gain_drift"]
    assert not is_open(questions(found))
    [rival] = found.causes[0].alternatives
    assert rival.evidence == "capture_2.npz would have shown it, and does not"


def test_what_the_last_motion_does_show_stays_possible(
    diagnosed: dict[int, AxisDiagnosis],
) -> None:
    diagnosed[2] = left(hand_made.axis(Verdict.UNEXPLAINED), 0.03)
    diagnosed[1] = left(hand_made.axis(Verdict.EXPLAINED, cause(UNEVEN)), 0.001)
    assert UNEVEN.effect in explanations(judge(drifting()))


@pytest.mark.parametrize("lasts", [True, False])
def test_a_line_that_one_motion_alone_holds_comes_from_that_motion(
    diagnosed: dict[int, AxisDiagnosis], monkeypatch: pytest.MonkeyPatch, lasts: bool
) -> None:
    monkeypatch.setattr(
        together, "held", lambda recording, name, lines, axis: lines if lasts else ()
    )
    explained = left(hand_made.axis(Verdict.EXPLAINED, cause(UNEVEN)), 0.001)
    explained = replace(explained, cutoff_hz=2.0)
    diagnosed[2] = replace(explained, verdict=Verdict.UNEXPLAINED, lines=(line(3.0), line(7.0)))
    assert judge(explained).verdict is Verdict.EXPLAINED
    vibrating = judge(replace(explained, lines=(line(7.02),)))
    assert vibrating.verdict is (Verdict.UNEXPLAINED if lasts else Verdict.EXPLAINED)
    assert [found.frequency_hz for found in vibrating.lines] == ([7.0] if lasts else [])


def test_an_axis_with_curves_in_its_model_stays_partly_explained_without_such_lines(
    diagnosed: dict[int, AxisDiagnosis],
) -> None:
    """The base model was not adequate: curves account for what no cause names."""
    bent = left(hand_made.axis(Verdict.PARTLY_EXPLAINED), 0.001)
    bent = replace(bent, cutoff_hz=2.0, curves=(AgreeingCurve(UNEVEN, BEND, 0.05, 4.0),))
    diagnosed[2] = replace(bent, lines=(line(3.0),))
    assert judge(bent).verdict is Verdict.PARTLY_EXPLAINED
    assert judge(bent).lines == ()


def test_a_line_that_a_livelier_motion_would_show_in_its_band_is_judged_there(
    diagnosed: dict[int, AxisDiagnosis],
) -> None:
    explained = left(hand_made.axis(Verdict.EXPLAINED, cause(UNEVEN)), 0.001)
    explained = replace(explained, cutoff_hz=10.0)
    diagnosed[2] = replace(explained, verdict=Verdict.UNEXPLAINED, lines=(line(7.0),))
    assert judge(replace(explained, lines=(line(7.0),))).verdict is Verdict.EXPLAINED
    diagnosed[2] = left(diagnosed[2], 0.2)
    assert judge(replace(explained, lines=(line(7.0),))).verdict is Verdict.UNEXPLAINED


def test_of_a_rival_that_expects_more_than_was_recorded_the_excess_alone_is_left_out() -> None:
    load = Load(np.array([0.4, 0.8, 1.2, 0.1]), excess_nm=0.5)
    assert load.with_causes(2.0).added_nm == pytest.approx(1.5)
    assert load.with_causes(0.3).added_nm == 0.0
    assert load.with_causes(-0.3).added_nm == pytest.approx(-0.3)
    endless = replace(load, excess_nm=np.inf)
    assert endless.with_causes(2.0).added_nm == 0.0
