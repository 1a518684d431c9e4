"""Another recording judges a model: what helps there stays, and the rest becomes a suspicion."""

from dataclasses import replace

import numpy as np
import pytest

from edge_ident.diagnosis.diagnose import diagnose
from edge_ident.diagnosis.fit.held_out import gain_of
from edge_ident.diagnosis.measures import Verdict
from edge_ident.diagnosis.result import Diagnosis
from edge_ident.signals.recording import AxisRecord, Recording

PERIOD_S = 2e-3
NOISE = 0.02
RIPPLE_M = 0.31


def session(
    seed: int,
    *,
    spring: float = 0.0,
    push: float = 0.0,
    offset: float = 0.2,
    ripple: float = 0.15,
    friction: float = 1.0,
    cold: float = 0.0,
    lasts_s: float = 4.0,
    period_s: float = PERIOD_S,
    noise: float = NOISE,
) -> Recording:
    """14 s of five sines of random phase on an axis with ripple."""
    rng = np.random.default_rng(seed)
    t = np.arange(0.0, 14.0, period_s)
    rate = 2.0 * np.pi * np.array([0.11, 0.23, 0.37, 0.61, 0.89])
    angle = rate * t[:, None] + rng.uniform(0.0, 2.0 * np.pi, 5)
    x, v, a = (np.sin(angle) / rate).sum(1), np.cos(angle).sum(1), -(rate * np.sin(angle)).sum(1)
    effort = 0.5 * a + friction * (0.8 * v + 1.1 * np.sign(v)) + offset
    effort += ripple * np.sin(2.0 * np.pi * x / RIPPLE_M) + spring * x
    effort += cold * np.exp(-t / lasts_s) * v
    effort += push * np.exp(-(((t - 9.0) / 0.15) ** 2)) + noise * rng.standard_normal(len(t))
    axis = AxisRecord(np.round(x / 1e-5) * 1e-5, effort, "rad", "N*m")
    return Recording(t, {"x": axis}, f"session {seed}")


@pytest.fixture(scope="module")
def judged() -> Diagnosis:
    """A spring and a push that were there on one day only, another offset on the other."""
    first = session(1, spring=0.4, push=0.8)
    return diagnose([first], validate=session(2, offset=-0.3))


def test_what_helps_on_the_other_recording_stays(judged: Diagnosis) -> None:
    carried = {c.effect: c for c in judged.validation["x"].causes}
    ripple = carried["torque_ripple"]
    assert ripple.carries_over
    assert ripple.without is not None
    assert ripple.without > judged.validation["x"].extended
    assert "torque_ripple" in [term.effect for term in judged.axes["x"].model.terms]


def test_what_does_not_carry_over_is_a_suspicion_with_the_reason(judged: Diagnosis) -> None:
    axis = judged.axes["x"]
    assert [c.term.effect for c in axis.suspected] == ["position_dependent_load"]
    assert "raises the residual of the other recording" in axis.suspected[0].decision
    assert "position_dependent_load" not in [c.term.effect for c in axis.causes]
    assert axis.verdict is Verdict.PARTLY_EXPLAINED, "without the spring the first recording is not"


def test_a_push_is_not_carried_on(judged: Diagnosis) -> None:
    carried = {c.effect: c for c in judged.validation["x"].causes}
    assert carried["disturbance_event"].carries_over is None
    assert "disturbance_event" in [c.term.effect for c in judged.axes["x"].causes]
    assert [term.effect for term in judged.axes["x"].model.terms] == ["rigid_body", "torque_ripple"]


def test_the_written_model_leaves_less_than_the_base_model(judged: Diagnosis) -> None:
    found = judged.validation["x"]
    assert found.extended < found.base < found.as_found


def test_a_machine_that_is_explained_on_both_days_is_explained() -> None:
    found = diagnose([session(3)], validate=session(4, offset=-0.3))
    assert found.axes["x"].verdict is Verdict.EXPLAINED
    assert found.axes["x"].suspected == ()
    worse = diagnose([session(3)], validate=session(4, spring=0.4))
    assert worse.axes["x"].verdict is Verdict.PARTLY_EXPLAINED, "the other day had a spring"


def test_parameters_that_noise_has_moved_leave_no_structure_of_the_other_day() -> None:
    """The first day was so noisy that its parameters are a few percent off."""
    day, noisy = session(4, ripple=0.0), session(3, ripple=0.0, noise=4.0)
    found = diagnose([noisy], validate=day)
    left = found.validation["x"].base
    assert left > 0.015, "more than noise and the tolerance are there"
    assert found.axes["x"].verdict is Verdict.ADEQUATE
    other = diagnose([noisy], validate=session(4, ripple=0.3))
    assert other.axes["x"].verdict is Verdict.UNEXPLAINED, "the other day had a ripple"


def test_friction_of_another_day_is_seen_from_what_is_left_with_its_own() -> None:
    found = diagnose([session(3)], validate=session(4, friction=1.05))
    carried = found.validation["x"]
    assert carried.extended > 0.015
    assert carried.friction_anew[1] < 0.5 * carried.extended
    assert carried.friction_anew[0] > 2.0 * carried.friction_anew[1], "the ripple is still there"


def test_each_cause_says_in_which_recordings_it_shows() -> None:
    ripples = {5: 0.15, 6: 0.0, 7: 0.15}
    three = diagnose(
        [session(seed, ripple=ripple, period_s=6e-3) for seed, ripple in ripples.items()]
    )
    shown = {c.term.effect: c.shown_in for c in three.axes["x"].causes}
    assert shown["torque_ripple"] == ("session 5", "session 7")


def test_a_colder_day_does_not_refute_a_warm_up() -> None:
    """Viscous friction is another every day: base and extended model leave the same there."""
    colder = session(9, cold=0.6, lasts_s=1e6)
    found = diagnose([session(8, cold=0.6)], validate=colder)
    assert "warm_up" in [c.term.effect for c in found.axes["x"].causes]
    carried = found.validation["x"]
    assert carried.extended <= 1.01 * carried.base
    assert found.axes["x"].verdict is Verdict.EXPLAINED


def test_a_gain_that_drifts_leaves_nothing_to_be_unsure_of() -> None:
    """It changes every base parameter, so each is fitted anew to the other day."""
    day, drifted = session(11, ripple=0.0), session(10, ripple=0.0)
    axis = drifted.axes["x"]
    drift = replace(axis, effort=axis.effort * (1.0 + 0.02 * drifted.time_s))
    first = replace(drifted, axes={"x": drift})
    found = diagnose([first], validate=day).axes["x"]
    assert [c.term.effect for c in found.causes] == ["gain_drift"]


def test_another_recording_may_drift_by_itself() -> None:
    """The same effect at another pace is no structure that the model misses."""
    days = [session(seed, ripple=0.0) for seed in (10, 11)]
    first, other = (
        replace(day, axes={"x": replace(axis, effort=axis.effort * (1.0 + rate * day.time_s))})
        for day, rate in zip(days, (0.02, 0.03), strict=True)
        for axis in (day.axes["x"],)
    )
    found = diagnose([first], validate=other).axes["x"]
    assert [c.term.effect for c in found.causes] == ["gain_drift"]
    assert found.verdict is Verdict.EXPLAINED


def test_the_interval_of_a_gain_covers_it() -> None:
    """Residuals of 30 blocks, coloured within a block, the second three quarters of the first."""
    rng = np.random.default_rng(8)
    block = np.repeat(np.arange(30), 20)
    inside = []
    for _ in range(400):
        level = rng.standard_normal((2, 30))[:, block]
        before, after = level + 0.3 * rng.standard_normal((2, len(block)))
        low, high = gain_of(block, before, 0.75 * after).interval
        inside.append(low <= 0.25 <= high)
    assert 0.9 <= np.mean(inside) <= 0.99
