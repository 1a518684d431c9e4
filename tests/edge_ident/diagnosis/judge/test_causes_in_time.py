"""Events that friction or an extreme of the motion may imitate, others, and those that recur."""

from dataclasses import replace

import numpy as np
import pytest
import scipy.integrate
import scipy.signal
from numpy.typing import NDArray

from edge_ident.diagnosis.fit.candidates import Candidate
from edge_ident.diagnosis.fit.fitting import FittedTerm, fit
from edge_ident.diagnosis.fit.held_out import (
    deviations_by_term,
    standard_deviations,
)
from edge_ident.diagnosis.fit.noise_floor import noise_floor
from edge_ident.diagnosis.judge.assessment import Assessment
from edge_ident.diagnosis.judge.causes_in_time import (
    at_standstill,
    brief,
    may_be_held,
    never_repeated,
)
from edge_ident.diagnosis.judge.judgement import _in_time
from edge_ident.diagnosis.measures import Verdict
from edge_ident.diagnosis.prepare.preparation import prepare_axis
from edge_ident.diagnosis.select.cross_validation import unsized
from edge_ident.diagnosis.select.search import Search
from edge_ident.model.effects import named
from edge_ident.model.model import AxisModel, Term
from edge_ident.model.search import Form
from tests.edge_ident.diagnosis.select.test_search_parts import (
    COARSE_S,
    TEMPLATE,
    diagnosed,
    recorded,
    rigid,
    swing,
)

Array = NDArray[np.float64]

COULOMB = 1.1
"""Of the drive that `rigid` computes."""


STOP_S = 10.0
"""The axis dwells there: within a sound chain's wind-up, 0.5 mrad, for a quarter of a second."""
MOVING_S = 11.0


def motion() -> tuple[Array, Array, Array, Array]:
    """Time, position, velocity and acceleration of an axis that stops every 2 s."""
    t = np.arange(0.0, 20.0, 0.0025)
    rate, swing = 0.5 * np.pi, 2.0
    sine, cosine = np.sin(rate * t), np.cos(rate * t)
    position = swing * (cosine**3 / 3.0 - cosine) / rate
    return t, position, swing * sine**3, 3.0 * swing * rate * sine**2 * cosine


def doubts(
    centre_s: float, level: float, duration_s: float = 0.2, *beside: FittedTerm
) -> dict[int, str]:
    """Of a model that claims an event around a moment, beside what else it has."""
    t, x, v, a = motion()
    values = {"time": centre_s - 0.5 * duration_s, "duration": duration_s}
    data = prepare_axis([recorded(t, x, rigid(v, a), noise=0.01)], "x")
    form = Form(("level",), ("time", "duration"))
    term = FittedTerm(Candidate("disturbance_event", form), values, {"level": 0.0})
    model = fit(data, TEMPLATE, np.zeros(4), (*beside, term))
    event = Term("disturbance_event", {**values, "level": level})
    return at_standstill(data, replace(model, axis=AxisModel((*model.axis.terms[:-1], event))))


def test_friction_at_a_stop_may_be_the_event() -> None:
    (reason,) = doubts(STOP_S, 0.9 * COULOMB, duration_s=0.3).values()
    assert "friction" in reason


@pytest.mark.parametrize("level", [0.9 * COULOMB, 4.0 * COULOMB])
def test_an_axis_that_moves_is_held_by_nothing(level: float) -> None:
    assert doubts(MOVING_S, level) == {}


def test_a_recording_that_ends_the_other_way_does_not_begin_with_a_stop() -> None:
    t, x, v, a = (signal[400:-400] for signal in motion())
    assert v[-1] < 0.0 < v[0]
    data = prepare_axis([recorded(t, x, rigid(v, a), noise=0.01)], "x")
    assert not np.any(may_be_held(data.segments[0], 0.05)[:50])


def test_no_friction_is_as_large_as_that() -> None:
    assert doubts(STOP_S, 20.0 * COULOMB, duration_s=0.24) == {}


def test_what_lasts_beyond_the_stop_is_no_friction() -> None:
    assert doubts(STOP_S, 0.9 * COULOMB, duration_s=1.5) == {}


def test_a_guide_with_presliding_creeps_to_its_stop() -> None:
    """The axis is 16 mrad from its stop, and friction needs 20 mrad to build up."""
    form = Form(("level",), ("distance",))
    presliding = FittedTerm(
        Candidate("presliding_hysteresis", form), {"distance": 0.02}, {"level": 0.5 * COULOMB}
    )
    creeps_s = STOP_S + 0.3
    assert doubts(creeps_s, 0.9 * COULOMB) == {}
    assert list(doubts(creeps_s, 0.9 * COULOMB, 0.2, presliding)) == [1]


@pytest.mark.parametrize("times", [2, 4])
def test_events_are_named_only_as_long_as_each_may_have_happened_once(times: int) -> None:
    t, x, v, a = swing(period_s=COARSE_S)
    begins_s = np.array([3.1, 8.3, 5.7, 11.9])[:times, None]
    pushes = 2.0 * np.sin(np.pi * np.clip((t - begins_s) / 0.4, 0.0, 1.0)) ** 2
    axis = diagnosed(recorded(t, x, rigid(v, a) + pushes.sum(axis=0), noise=0.05))
    named = [cause.term.effect for cause in axis.causes]
    if times == 2:
        assert named == ["disturbance_event"] * 2
        assert axis.verdict is Verdict.EXPLAINED
    else:
        assert not named
        assert axis.verdict is Verdict.UNEXPLAINED
        assert all("something recurs" in cause.decision for cause in axis.suspected)


@pytest.mark.parametrize("weak", [1, 2])
def test_weak_events_that_are_suspected_already_recur_as_well(weak: int) -> None:
    t, x, v, a = swing()
    data = prepare_axis([recorded(t, x, rigid(v, a), noise=0.05)], "x")
    start = fit(data, TEMPLATE, np.zeros(4), ())
    form = Form(("level",), ("time", "duration"))
    places = [{"time": 3.0 * k, "duration": 0.4, "clock": 0.0} for k in range(1, weak + 2)]
    events = [
        FittedTerm(Candidate("disturbance_event", form), place, {"level": 0.0}) for place in places
    ]
    search = Search.of(data, TEMPLATE, start)
    model = search.fit(start.base, events)
    assessed = Assessment.of(search, model, noise_floor(data, start), 0.01)
    assert list(_in_time(assessed, [0])) == ([0] if weak == 2 else [])


def test_a_push_of_another_shape_is_one_event() -> None:
    """It rises within 0.05 s, stays for 0.8 s and falls: no single pulse of the catalogue."""
    t, x, v, a = swing(seconds=24.0, period_s=COARSE_S)
    push = 2.5 * np.clip(np.minimum(t - 11.0, 11.9 - t) / 0.05, 0.0, 1.0)
    axis = diagnosed(recorded(t, x, rigid(v, a) + push, noise=0.05))
    assert axis.verdict is Verdict.EXPLAINED
    assert {cause.term.effect for cause in axis.causes} == {"disturbance_event"}
    assert len(axis.causes) > 2
    assert all(10.8 < float(cause.term.values["time"]) < 12.0 for cause in axis.causes)


@pytest.mark.parametrize(("level", "unknown"), [(3.0, False), (0.0, True)])
def test_of_pulses_that_overlap_the_size_is_that_of_their_sum(level: float, unknown: bool) -> None:
    """A push that swings back takes several, and how it is divided among them is not sure."""
    t, x, v, a = swing()
    swings_back = level * np.cos(30.0 * (t - 6.05)) * ((t > 6.0) & (t < 6.1))
    data = prepare_axis([recorded(t, x, rigid(v, a) + swings_back, noise=0.05)], "x")
    form = Form(("level",), ("time", "duration"))
    places = [{"time": time, "duration": 0.1, "clock": 0.0} for time in (5.995, 6.0, 6.005)]
    events = [
        FittedTerm(Candidate("disturbance_event", form), place, {"level": 0.0}) for place in places
    ]
    model = fit(data, TEMPLATE, np.zeros(4), events)
    stds = deviations_by_term(model, standard_deviations(data, model))
    for pulse, std in zip(model.terms, stds, strict=True):
        assert abs(pulse.linear["level"]) < std["level"]
    assert unsized(data, model) == [unknown] * 3


def test_what_a_bound_holds_at_zero_has_no_size() -> None:
    """Its derivatives are as sure as any, and rounding may say that it improves a prediction."""
    t, x, v, a = swing()
    data = prepare_axis([recorded(t, x, rigid(v, a), noise=0.05)], "x")
    candidate = Candidate("stribeck_friction", named("stribeck_friction").search.forms[0])
    law = FittedTerm(candidate, {"speed": 0.3, "exponent": 1.0}, {"level": 0.0})
    model = fit(data, TEMPLATE, np.zeros(4), (law,))
    stopped = replace(model, terms=(law,))
    assert unsized(data, stopped) == [True]


def test_a_knock_that_is_shorter_than_the_grid_is_one_event() -> None:
    """The grid begins at a 250th of the recording, 0.096 s."""
    t, x, v, a = swing(seconds=24.0, period_s=COARSE_S)
    knock = 9.0 * np.sin(np.pi * np.clip((t - 11.0) / 0.04, 0.0, 1.0)) ** 2
    axis = diagnosed(recorded(t, x, rigid(v, a) + knock, noise=0.05))
    assert axis.verdict is Verdict.EXPLAINED
    (cause,) = axis.causes
    assert cause.term.values["time"] == pytest.approx(11.0, abs=0.005)
    assert cause.term.values["duration"] == pytest.approx(0.04, rel=0.1)
    assert cause.term.values["level"] == pytest.approx(9.0, rel=0.1)


def alone(centre_s: float, level: float, pushed: float = 0.0) -> str:
    """The reason against an event about a moment, of a drive that something pushes then."""
    t, x, v, a = swing()
    at = {"time": centre_s - 0.1, "duration": 0.2}
    push = np.sin(np.pi * np.clip((t - at["time"]) / at["duration"], 0.0, 1.0)) ** 2
    data = prepare_axis([recorded(t, x, rigid(v, a) + pushed * push, noise=0.01)], "x")
    form = Form(("level",), ("time", "duration"))
    term = FittedTerm(Candidate("disturbance_event", form), at, {"level": 0.0})
    model = fit(data, TEMPLATE, np.zeros(4), (term,))
    event = Term("disturbance_event", {**at, "level": level})
    model = replace(model, axis=AxisModel((*model.axis.terms[:-1], event)))
    return never_repeated(data, model).get(0, "")


def test_what_happens_at_an_extreme_of_the_motion_may_be_a_law_that_shows_there_alone() -> None:
    t, x, v, a = swing()
    end_s = t[np.argmax(np.abs(x - np.mean(x)))]
    assert not alone(end_s, 1.0), "an end stop is an event that the model does not carry on"
    assert "faster" in alone(t[np.argmax(v)], 1.0)
    assert "under more effort" in alone(t[np.argmax(np.abs(rigid(v, a)))], 1.0)


@pytest.mark.parametrize("pushed", [0.0, 40.0])
def test_neither_the_push_itself_nor_what_it_stops_is_an_extreme(pushed: float) -> None:
    """A stiff loop answers a push by as much effort; in a collision the axis brakes as hard."""
    t, _, v, a = swing()
    ordinary_s = t[np.argmin(np.abs(rigid(v, a) - 2.0))]
    assert not alone(ordinary_s, 40.0, pushed)


def test_a_push_that_ends_before_the_axis_turns_farthest_out_is_an_event() -> None:
    """A spring there would push on the way back as well."""
    t, x, *_ = swing()
    turns_s = t[np.argmax(np.abs(x - np.mean(x)))]
    assert not alone(turns_s - 0.1, 1.0)


def test_drag_above_a_speed_that_is_reached_once_is_no_event() -> None:
    t, x, v, a = swing(seconds=24.0, period_s=COARSE_S)
    drag = 4.0 * np.maximum(v - 0.8 * np.max(v), 0.0)
    axis = diagnosed(recorded(t, x, rigid(v, a) + drag, noise=0.02))
    assert not axis.verdict.complete
    assert not axis.causes
    assert all(curve.term.effect.endswith("over_speed") for curve in axis.curves)
    assert any("faster than at any other time" in cause.decision for cause in axis.suspected)


def test_a_push_that_drives_the_axis_faster_than_ever_is_an_event() -> None:
    """A soft loop gives way at the highest speed: a speed that follows the push late is no law."""
    t, x, v, a = swing(seconds=24.0, period_s=COARSE_S)
    begin_s, lasts_s, lag_s = t[np.argmax(v)] - 0.2, 0.4, 0.15
    push = 2.0 * np.sin(np.pi * np.clip((t - begin_s) / lasts_s, 0.0, 1.0)) ** 2
    keep = np.exp(-COARSE_S / lag_s)
    gained = scipy.signal.lfilter([0.25 * (1.0 - keep)], [1.0, -keep], push)
    moved = scipy.integrate.cumulative_trapezoid(gained, t, initial=0.0)
    effort = rigid(v + gained, a + (0.25 * push - gained) / lag_s) - push
    axis = diagnosed(recorded(t, x + moved, effort, noise=0.02))
    assert axis.verdict is Verdict.EXPLAINED
    (cause,) = axis.causes
    assert cause.term.values["time"] == pytest.approx(begin_s, abs=0.05)
    assert cause.term.values["level"] == pytest.approx(-2.0, rel=0.05)


def test_what_is_picked_up_and_put_down_is_two_changes() -> None:
    t, x, v, a = swing(seconds=24.0, period_s=COARSE_S)
    carried = (t > 7.0) & (t < 17.0)
    effort = rigid(v, a) + carried * (0.2 * a + 0.3 * np.sign(v))
    axis = diagnosed(recorded(t, x, effort, noise=0.05))
    assert axis.verdict is Verdict.EXPLAINED
    changes = sorted((cause.term for cause in axis.causes), key=lambda term: term.values["time"])
    assert [term.effect for term in changes] == ["payload_change"] * 2
    assert [term.values["time"] for term in changes] == pytest.approx([7.0, 17.0], abs=0.1)
    masses = [term.values["inertia"] for term in changes]
    assert masses == pytest.approx([0.2, -0.2], abs=0.02)
    assert axis.extended.estimate.parameters[0] == pytest.approx(0.5, rel=0.02)


@pytest.mark.parametrize(("lasts_s", "doubtful"), [(0.02, []), (0.5, [0, 1]), (3.0, [])])
def test_what_is_carried_for_less_than_a_cycle_may_be_a_push(
    lasts_s: float, doubtful: list[int]
) -> None:
    """The motion has the speed and the acceleration of a sine with a cycle of 1.9 s."""
    t, x, v, a = swing()
    data = prepare_axis([recorded(t, x, rigid(v, a), noise=0.05)], "x")
    form = Form(("inertia", "coulomb_friction"), ("time",))
    none = {"inertia": 0.0, "coulomb_friction": 0.0}
    model = fit(
        data,
        TEMPLATE,
        np.zeros(4),
        [
            FittedTerm(Candidate("payload_change", form), {"time": time, "clock": 0.0}, none)
            for time in (6.0, 6.0 + lasts_s)
        ],
    )
    doubts = brief(data, model, data.excitation(np.ones(4)))
    assert list(doubts) == doubtful
    assert all("may be a push" in reason for reason in doubts.values())
