"""Supported, suspected and minor causes."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from edge_ident.diagnosis.diagnose import diagnose
from edge_ident.diagnosis.fit.candidates import Candidate
from edge_ident.diagnosis.fit.external_vibrations import VIBRATION
from edge_ident.diagnosis.fit.fitting import FittedTerm, fit
from edge_ident.diagnosis.fit.noise_floor import NoiseFloor, noise_floor
from edge_ident.diagnosis.judge import assessment
from edge_ident.diagnosis.judge.assessment import Assessment
from edge_ident.diagnosis.measures import Verdict
from edge_ident.diagnosis.prepare.preparation import prepare_axis
from edge_ident.diagnosis.result import AxisDiagnosis, Cause
from edge_ident.diagnosis.select import cross_validation
from edge_ident.diagnosis.select.physics import unphysical
from edge_ident.diagnosis.select.search import Search
from edge_ident.model.effects import named
from edge_ident.model.model import BASE
from edge_ident.model.search import Form
from tests.edge_ident.diagnosis.select.test_search_parts import TEMPLATE, recorded, rigid, swing

MOTION = swing()
RIPPLE = np.sin(2.0 * np.pi * MOTION[1] / 0.31 + 0.4)


def found(effort: np.ndarray, noise: float = 0.02, **asked: float) -> AxisDiagnosis:
    t, x, _, _ = MOTION
    return diagnose([recorded(t, x, effort, noise=noise)], **asked).axes["x"]  # type: ignore[arg-type]


def effects(listed: tuple[Cause, ...]) -> list[str]:
    return [cause.term.effect for cause in listed]


def test_no_cause_is_named_beside_friction_that_drives_the_motion() -> None:
    """The law of a speed loop: the effort falls with speed."""
    _, _, v, a = MOTION
    axis = found(0.05 * a - 0.4 * v + 0.1 * RIPPLE + 0.5)
    assert axis.verdict is Verdict.UNEXPLAINED
    assert axis.causes == ()
    assert all("controller's law" in cause.decision for cause in axis.suspected)
    assert "feedback_law" in {finding.code for finding in axis.findings}
    assert [term.effect for term in axis.model.terms] == [BASE]


@pytest.mark.parametrize("viscous", [-0.4, 0.8])
def test_negative_friction_is_unphysical(viscous: float) -> None:
    t, x, v, a = MOTION
    data = prepare_axis([recorded(t, x, 0.5 * a + viscous * v + 0.2, noise=0.02)], "x")
    model = fit(data, TEMPLATE, np.zeros(4), ())
    reason = unphysical(data, model, model, 0.01)
    assert (reason is not None) is (viscous < 0.0)
    assert reason is None or "negative viscous friction, -0.4" in reason


@pytest.mark.parametrize("mass", [0.0, 0.1])
def test_a_payload_without_mass_beside_what_stays_is_doubtful(mass: float) -> None:
    """Events that were found beside it may have left, with what told its mass."""
    t, x, v, a = MOTION
    added = (mass * a + 0.2 * np.sign(v)) * (t > 9.0)
    data = prepare_axis([recorded(t, x, rigid(v, a) + added, noise=0.02)], "x")
    start = fit(data, TEMPLATE, np.zeros(4), ())
    search = Search.of(data, TEMPLATE, start)
    _, form, _ = named("payload_change").search.forms
    payload = FittedTerm(
        Candidate("payload_change", form),
        {"time": 9.0, "clock": 0.0},
        {"inertia": 0.0, "coulomb_friction": 0.0},
    )
    model = search.fit(start.base, (payload,))
    doubts = Assessment.of(search, model, noise_floor(data, start), 0.01).doubtful_sizes([0])
    assert ("inertia lies within" in doubts.get(0, "")) is (mass == 0.0)


@pytest.mark.parametrize(("deviations", "doubtful"), [(0.9, False), (1.1, True)])
def test_a_cause_that_is_as_uncertain_as_it_is_large_is_doubtful(
    monkeypatch: pytest.MonkeyPatch, deviations: float, doubtful: bool
) -> None:
    t, x, v, a = MOTION
    data = prepare_axis([recorded(t, x, rigid(v, a) + 0.1 * np.abs(v), noise=0.02)], "x")
    start = fit(data, TEMPLATE, np.zeros(4), ())
    search = Search.of(data, TEMPLATE, start)
    (form, *_) = named("asymmetric_friction").search.forms
    term = FittedTerm(Candidate("asymmetric_friction", form), {}, dict.fromkeys(form.linear, 0.0))
    model = search.fit(start.base, (term,))
    monkeypatch.setattr(cross_validation, "joint_deviation", lambda *_: deviations)
    doubts = Assessment.of(search, model, noise_floor(data, start), 0.01).doubtful_sizes([0])
    assert ("as uncertain as it is large" in doubts.get(0, "")) is doubtful


@pytest.mark.parametrize(("lost", "doubtful"), [(0.5, False), (0.95, True)])
def test_a_cause_at_the_end_of_what_is_possible_is_doubtful(lost: float, doubtful: bool) -> None:
    """No transmission loses more than nine tenths."""
    t, x, v, a = MOTION
    passed = 0.5 * a + 0.2
    friction = passed / (1.0 - lost * np.sign(v) * np.sign(passed)) - passed
    data = prepare_axis([recorded(t, x, rigid(v, a) + friction, noise=0.02)], "x")
    start = fit(data, TEMPLATE, np.zeros(4), ())
    search = Search.of(data, TEMPLATE, start)
    (form, *_) = named("load_dependent_friction").search.forms
    sides = {"guided": 0.0, "moved": 1.0}
    term = FittedTerm(Candidate("load_dependent_friction", form), sides, {"share": 0.3})
    model = search.fit(start.base, (term,))
    doubts = Assessment.of(search, model, noise_floor(data, start), 0.01).doubtful_sizes([0])
    assert ("share would be larger" in doubts.get(0, "")) is doubtful


def test_a_cause_below_the_tolerance_is_minor_and_no_accusation() -> None:
    _, _, v, a = MOTION
    effort = rigid(v, a) + 0.02 * RIPPLE
    axis = found(effort, noise=0.005)
    assert axis.verdict is Verdict.ADEQUATE
    assert axis.causes == axis.suspected == ()
    assert effects(axis.minor) == ["torque_ripple"]
    assert [term.effect for term in axis.model.terms] == [BASE, "torque_ripple"]
    named = found(effort, noise=0.005, tolerance=0.002)
    assert effects(named.causes) == ["torque_ripple"]
    assert named.verdict is Verdict.EXPLAINED


def test_a_cause_that_is_smaller_than_what_is_left_is_suspected() -> None:
    """Beside a disturbance that no effect explains."""
    t, _, v, a = MOTION
    unknown = sum(np.sin(w * t + w**2) for w in np.linspace(2.0, 9.0, 23)) * 0.1
    axis = found(rigid(v, a) + unknown + 0.12 * RIPPLE)
    assert axis.verdict is Verdict.UNEXPLAINED
    assert "torque_ripple" not in effects(axis.causes)
    for cause in axis.suspected:
        assert "left unexplained" in cause.decision


def test_a_supported_cause_says_why() -> None:
    _, _, v, a = MOTION
    axis = found(rigid(v, a) + 0.1 * RIPPLE)
    (cause,) = axis.causes
    assert axis.verdict is Verdict.EXPLAINED
    share = float(np.sqrt(np.mean((0.1 * RIPPLE) ** 2) / np.mean(axis.traces.effort**2)))
    assert cause.share == pytest.approx(share, rel=0.1)


def test_a_rest_of_a_fifth_of_the_effort_is_unexplained_however_rough_the_formulas_are(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    t, x, v, a = MOTION
    wave = np.sin(2.0 * np.pi * 0.517 * t)
    data = prepare_axis([recorded(t, x, 0.5 * a + v + wave, noise=0.02)], "x")
    start = fit(data, TEMPLATE, np.zeros(4), ())
    floor = NoiseFloor(0.02, 0.05, "known")
    assessed = Assessment.of(Search.of(data, TEMPLATE, start), start, floor, 0.01)
    monkeypatch.setattr(Search, "discrepancy", lambda *_: 10.0 * start.error)
    assert assessed.rest(start) > 0.1
    assert assessed.structure(start)


@pytest.mark.parametrize(
    ("rates", "disturbance", "doubtful"),
    [([0.7], 0.0, False), ([0.7], 0.05, True), ([0.7, 2.3], 0.05, False)],
)
def test_a_delay_along_one_sinusoid_leaves_nothing_but_noise(
    rates: list[float], disturbance: float, doubtful: bool
) -> None:
    """A chirp was a delay there, and the inertia far off."""
    t = MOTION[0]
    late = t - 0.06
    x = sum(np.sin(rate * t) / rate for rate in rates)
    v = sum(np.cos(rate * late) for rate in rates)
    a = sum(-rate * np.sin(rate * late) for rate in rates)
    effort = rigid(np.asarray(v), np.asarray(a)) + disturbance * np.sin(0.6 * t**2)
    data = prepare_axis([recorded(t, np.asarray(x), effort, noise=0.02)], "x")
    start = fit(data, TEMPLATE, np.zeros(4), ())
    delay = FittedTerm(Candidate("time_delay", Form(("delay",))), {}, {"delay": 0.06})
    model = fit(data, TEMPLATE, start.base, (delay,))
    floor = NoiseFloor(0.02, 0.05, "known")
    assessed = Assessment.of(Search.of(data, TEMPLATE, start), model, floor, 0.01)
    assert (assessed.phases([0]) != {}) is doubtful


@pytest.mark.parametrize(
    ("doubts", "left", "outweighs"),
    [
        ([1], 0.04, True),
        ([1], 0.08, False),
        ([2], 0.04, False),
        ([3], 0.001, False),
        ([], 0.0, False),
    ],
)
def test_a_doubtful_cause_that_is_larger_than_the_rest_outweighs_what_is_named(
    doubts: list[int], left: float, outweighs: bool
) -> None:
    """A play of 7 % is in doubt, and a compliance that took its place leaves 4 %. Nothing speaks
    for a vibration, nor for what is below the tolerance."""
    places = [SimpleNamespace(candidate=c) for c in ("compliance", "play", VIBRATION, "drift")]
    assessed: Any = SimpleNamespace(
        model=SimpleNamespace(terms=places),
        rest=lambda model: left,
        shares=lambda model: [0.14, 0.07, 0.3, 0.005],
        tolerance=0.02,
        scale=2.0,
    )
    without: Any = None
    assert Assessment.outweighed(assessed, without, doubts) is outweighs


@pytest.mark.parametrize(("size", "doubtful"), [(1.5, []), (3.0, [0, 2])])
def test_what_the_other_causes_take_back_is_suspected(
    monkeypatch: pytest.MonkeyPatch, size: float, doubtful: list[int]
) -> None:
    """Two efforts that cancel each other but for a rest, and one that stands alone between them."""
    wave = np.sqrt(2.0) * np.sin(2.0 * np.pi * np.arange(1000) / 100.0)
    other = np.roll(wave, 25)
    efforts = np.array([size * wave, other, other - size * wave])
    monkeypatch.setattr(assessment, "own_efforts", lambda *_: efforts)
    model: Any = SimpleNamespace(terms=range(3), of_law=lambda t: (t,))
    assessed: Any = SimpleNamespace(
        left=lambda model: 1.0, scale=1.0, space=None,
        search=SimpleNamespace(data=None, start=None),
    )  # fmt: skip
    assessed._together = lambda of: Assessment._together(assessed, of)
    found = Assessment.taken_back(assessed, model)
    assert sorted(found) == doubtful
    assert all("taken back by the other causes" in reason for reason in found.values())
