"""What a cause takes off the recorded effort, inside the band and above it."""

import numpy as np
import pytest
from numpy.typing import NDArray

from edge_ident.diagnosis.diagnose import diagnose
from edge_ident.diagnosis.fit.candidates import Candidate
from edge_ident.diagnosis.fit.fitting import FittedModel, FittedTerm, fit
from edge_ident.diagnosis.fit.summary import base_space, own_shares, recorded_sizes
from edge_ident.diagnosis.judge import assessment
from edge_ident.diagnosis.measures import Verdict
from edge_ident.diagnosis.prepare.axis_data import AxisData, Segment
from edge_ident.diagnosis.prepare.preparation import prepare_axis
from edge_ident.model.effects import named
from edge_ident.model.inverse import inverse_effort
from edge_ident.model.model import BASE, PARAMETERS, AxisModel, Term
from edge_ident.model.motion import Motion
from edge_ident.model.search import SOUND_RESONANCE_HZ, Form
from edge_ident.signals.metrics import rms
from edge_ident.signals.recording import Recording
from tests.edge_ident.diagnosis.select.test_search_parts import (
    PERIOD_S,
    TEMPLATE,
    recorded,
    rigid,
    swing,
)

Array = NDArray[np.float64]

MOTION = swing()


def with_presliding(distance: float, level: float = 1.0) -> Array:
    t, x, v, a = MOTION
    known = Motion.known(t, x, v, a)
    base = Term(BASE, dict(zip(PARAMETERS, (0.5, 0.8, 1.1, 0.2), strict=True)))
    added = Term("presliding_hysteresis", {"level": level, "distance": distance})
    return inverse_effort(AxisModel((base, added)), known)


def fitted(data: AxisData, distance: float, level: float) -> FittedModel:
    form = named("presliding_hysteresis").search.forms[0]
    term = FittedTerm(
        Candidate("presliding_hysteresis", form), {"distance": distance}, {"level": level}
    )
    return fit(data, TEMPLATE, np.zeros(4), (term,))


def test_what_acts_at_reversals_is_larger_in_the_recorded_effort_than_in_a_narrow_band() -> None:
    """An encoder of a hundredth of the speed in a second leaves a band of a few hertz."""
    t, x, _, _ = MOTION
    effort = with_presliding(0.05)
    data = prepare_axis([recorded(t, x, effort, noise=0.01, count=3e-3)], "x")
    assert data.segments[0].cutoff_hz < 8.0
    model = fitted(data, 0.05, 1.0)
    start = fit(data, TEMPLATE, np.zeros(4), ())
    (in_band,) = own_shares(data, model, base_space(data, start))
    (size,) = recorded_sizes(data, model)
    added = effort - with_presliding(0.05, level=0.0)
    columns = np.stack([MOTION[3], MOTION[2], np.sign(MOTION[2]), np.ones_like(t)], axis=1)
    basis = np.linalg.qr(columns)[0]
    own = added - basis @ (basis.T @ added)
    truth = float(np.sqrt(np.mean(own**2) / np.mean(effort**2)))
    assert in_band < size < 1.1 * truth


@pytest.mark.parametrize("samples", [1.55, 6.0])
def test_a_delay_is_as_large_as_what_exceeds_a_controllers_timing(samples: float) -> None:
    """The base model is late by 1.5 samples, too."""
    t, x, v, a = MOTION
    delay_s = samples * PERIOD_S
    effort = np.interp(t - delay_s, t, rigid(v, a))
    data = prepare_axis([recorded(t, x, effort, noise=1e-4)], "x", timed=False)
    (form,) = named("time_delay").search.forms
    term = FittedTerm(Candidate("time_delay", form), {}, {"delay": delay_s})
    model = fit(data, TEMPLATE, np.array([0.5, 0.8, 1.1, 0.2]), (term,))
    space = base_space(data, fit(data, TEMPLATE, np.zeros(4), ()))
    whole = (data.predicted(model.axis) - data.predicted(model.axis_without([0])))[data.valid]
    whole_share = rms(whole - space @ (space.T @ whole)) / rms(data.effort[data.valid])
    found = model.terms[0].linear["delay"] / PERIOD_S
    expected = (found - 1.5) / found * whole_share
    (in_band,) = own_shares(data, model, space)
    (size,) = recorded_sizes(data, model)
    assert in_band == pytest.approx(expected, rel=0.1)
    # friction's steps at reversals are in the recorded effort, too
    assert size < 2.0 * expected + 0.1 * whole_share
    assert found == pytest.approx(samples, rel=0.01)


def test_an_effort_that_is_not_in_the_record_counts_against_its_cause() -> None:
    t, x, v, a = MOTION
    data = prepare_axis([recorded(t, x, rigid(v, a), noise=0.01)], "x")
    form = Form(("level",), ("time", "duration"))
    values = {"time": 9.0, "duration": 0.4}
    term = FittedTerm(Candidate("disturbance_event", form), values, {"level": 0.0})
    sound = fit(data, TEMPLATE, np.zeros(4), (term,))
    event = sound.axis.terms[-1]
    pushed = Term(event.effect, {**event.values, "level": 2.0})
    claimed = FittedModel(**{**vars(sound), "axis": AxisModel((*sound.axis.terms[:-1], pushed))})
    (size,) = recorded_sizes(data, claimed)
    assert size < -0.01


def on_a_chain(rate_hz: float, load: float) -> Recording:
    """A drive whose load swings behind an encoder on the motor."""
    t, x, v, a = MOTION
    base = Term(BASE, dict(zip(PARAMETERS, (0.5, 0.8, 1.1, 0.2), strict=True)))
    rate = 2.0 * np.pi * rate_hz
    spring = {"load_inertia": load, "rate": rate, "damping_ratio": 0.1, "deceleration": 3.0}
    axis = AxisModel((base, Term("coupling_compliance", spring)))
    effort = inverse_effort(axis, Motion.known(t, x, v, a))
    return recorded(t, x, effort, noise=0.02)


@pytest.mark.parametrize(
    ("rate_hz", "load", "causes"), [(30.0, 0.4, 0), (20.0, 0.25, 1), (6.0, 0.25, 1)]
)
def test_the_chain_of_a_sound_drive_is_no_cause(rate_hz: float, load: float, causes: int) -> None:
    """A load that swings at 30 Hz is on a chain as stiff as any; one at 6 Hz is not, and one that
    takes 3 % of the effort is no small matter."""
    found = diagnose([on_a_chain(rate_hz, load)]).axes["x"]
    assert len(found.causes) == causes
    if not causes:
        assert found.verdict is not Verdict.UNEXPLAINED
        for cause in found.minor:
            assert "sound drive" in cause.decision


def test_what_a_sound_chain_does_while_friction_may_hold_the_table_is_no_fault(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """With twice the friction over the inertia as its acceleration, it winds up by that over the
    square of its rate."""
    travels = []

    def held(segment: Segment, travel: float) -> NDArray[np.bool_]:
        travels.append(travel)
        return np.ones(len(segment.motion.position), dtype=bool)

    monkeypatch.setattr(assessment, "may_be_held", held)
    found = diagnose([on_a_chain(20.0, 0.25)]).axes["x"]
    assert (found.verdict, [cause.term.effect for cause in found.minor]) == (
        Verdict.ADEQUATE,
        ["coupling_compliance"],
    )
    most = 2.0 * 1.1 / 0.5 / (2.0 * np.pi * SOUND_RESONANCE_HZ) ** 2
    assert travels == pytest.approx([most] * len(travels), rel=0.05)


def test_a_sound_chain_is_as_stiff_whichever_effect_says_so() -> None:
    t, x, v, a = MOTION
    data = prepare_axis([recorded(t, x, rigid(v, a), noise=0.01)], "x")
    excitation = data.excitation(np.array([0.5, 0.8, 1.1, 0.2]))
    rate = 2.0 * np.pi * SOUND_RESONANCE_HZ
    for factor, sound in ((1.1, True), (0.9, False)):
        spring = {"rate": np.array([factor * rate])}
        assert named("coupling_compliance").search.sound(spring, excitation) is sound
        level = 0.5 * 0.5 * (factor * rate) ** 2 * 1e-3
        bristles = {"level": np.array([level]), "distance": np.array([1e-3])}
        assert named("presliding_hysteresis").search.sound(bristles, excitation) is sound
        lost = 2.0 * 5.0 / (factor * rate) ** 2
        play = {"deceleration": 5.0, "gap": 0.8 * lost, "contact_rate": factor * rate / 0.2**0.5}
        gap = {name: np.array([value]) for name, value in play.items()}
        assert named("backlash").search.sound(gap, excitation) is sound


def test_hysteresis_that_hides_the_inertia_is_not_called_that_of_a_sound_chain() -> None:
    """Along a slow sinusoid it looks like a negative inertia, so the base model has none."""
    t = PERIOD_S * np.arange(8000)
    rate, reach = 2.0 * np.pi * 0.1, 0.7
    x, v, a = (
        reach * np.sin(rate * t),
        reach * rate * np.cos(rate * t),
        -reach * rate**2 * np.sin(rate * t),
    )
    base = Term(BASE, dict(zip(PARAMETERS, (0.2, 0.5, 1.2, 0.3), strict=True)))
    bristles = Term("presliding_hysteresis", {"level": 0.8, "distance": 0.09})
    effort = inverse_effort(AxisModel((base, bristles)), Motion.known(t, x, v, a))
    found = diagnose([recorded(t, x, effort, noise=0.005)]).axes["x"]
    assert found.base.estimate.parameters[0] < 0.02
    assert [cause.term.effect for cause in found.causes] == ["presliding_hysteresis"]


def test_a_gap_narrower_than_its_contacts_wind_up_is_no_play() -> None:
    """Friction of the load winds up both: twice its deceleration over the rate squared."""
    for factor, doubtful in ((1.1, False), (0.9, True)):
        play = {"gap": factor * 2.0 * 5.0 / 60.0**2, "deceleration": 5.0, "contact_rate": 60.0}
        play["load_inertia"] = 0.3
        values = {name: np.array([value]) for name, value in play.items()}
        assert ("compliance" in named("backlash").search.degenerate(values, 0.5)) is doubtful


def test_a_spring_that_does_not_ring_is_a_lag_of_another_kind() -> None:
    """Its own damping and the load's viscous friction add up to 0.7 of the critical."""
    for factor, doubtful in ((0.9, False), (1.1, True)):
        ratio = factor * 0.5**0.5
        spring = {"rate": 60.0, "damping_ratio": 0.4 * ratio, "damping_rate": 1.2 * ratio * 60.0}
        values = {
            name: np.array([value]) for name, value in {**spring, "load_inertia": 0.3}.items()
        }
        assert bool(named("coupling_compliance").search.degenerate(values, 0.5)) is doubtful


@pytest.mark.parametrize(("inertia", "doubtful"), [(0.32, False), (0.28, True), (-0.1, False)])
def test_a_load_of_more_than_the_whole_inertia_is_no_part_of_the_axis(
    inertia: float, doubtful: bool
) -> None:
    spring = {"rate": 60.0, "damping_ratio": 0.05, "damping_rate": 0.0, "load_inertia": 0.3}
    play = {"gap": 0.1, "deceleration": 5.0, "contact_rate": 60.0, "load_inertia": 0.3}
    for effect, known in (("coupling_compliance", spring), ("backlash", play)):
        values = {name: np.array([value]) for name, value in known.items()}
        reason = named(effect).search.degenerate(values, inertia)
        assert ("1.1 times the inertia" in reason) is doubtful
