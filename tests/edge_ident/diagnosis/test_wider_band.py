"""Where nothing is named in the usual band, a wider one is looked at."""

import math
from dataclasses import replace

import numpy as np
import pytest

from edge_ident.diagnosis.axis_diagnosis import is_open, settles
from edge_ident.diagnosis.diagnose import diagnose
from edge_ident.diagnosis.measures import Verdict
from edge_ident.diagnosis.prepare.bandwidth import Band
from edge_ident.diagnosis.result import AxisDiagnosis
from edge_ident.estimation.trust import Finding
from edge_ident.model.model import Term
from edge_ident.signals.recording import AxisRecord, Recording
from tests.edge_ident.diagnosis.hand_made import axis, friction_by_direction, ripple

PERIOD_S, STEPS, SECONDS = 0.0025, 5, 20.0
COUNT_RAD = math.tau / 8400
LOAD, COULOMB = 0.3, 1.0


def sprung(chain_hz: float) -> AxisDiagnosis:
    """A motor on a slow motion, and a load with Coulomb friction behind a spring: it swings after
    every reversal. The usual band ends at 7 to 10 Hz, because the encoder is coarse."""
    step = PERIOD_S / STEPS
    time_s = step * np.arange(int(SECONDS / step))
    rates = math.tau * np.array([0.11, 0.19, 0.31])[:, None]
    motor = np.sum(np.sin(rates * time_s), axis=0)
    speed = np.sum(rates * np.cos(rates * time_s), axis=0)
    acceleration = -np.sum(rates**2 * np.sin(rates * time_s), axis=0)
    stiffness = LOAD * (math.tau * chain_hz) ** 2
    damping = 0.06 * math.sqrt(stiffness * LOAD)
    place, pace, torque = 0.0, float(speed[0]), np.zeros(len(time_s))
    for k in range(len(time_s)):
        torque[k] = stiffness * (motor[k] - place) + damping * (speed[k] - pace)
        pushed = pace + step * torque[k] / LOAD
        pace = math.copysign(max(abs(pushed) - step * COULOMB / LOAD, 0.0), pushed)
        place += step * pace
    effort = (0.4 * acceleration + 0.5 * speed + torque)[::STEPS]
    effort += 0.02 * np.random.default_rng(5).standard_normal(len(effort))
    read = COUNT_RAD * np.round(motor[::STEPS] / COUNT_RAD)
    record = AxisRecord(read, effort, "rad", "N*m")
    return diagnose([Recording(time_s[::STEPS], {"x": record}, "a test")]).axes["x"]


def test_a_spring_that_swings_above_the_usual_band_is_found() -> None:
    found = sprung(12.0)
    [cause] = found.causes
    assert (found.verdict, cause.term.effect) == (Verdict.EXPLAINED, "coupling_compliance")
    assert float(cause.term.values["rate"]) == pytest.approx(math.tau * 12.0, rel=0.05)
    assert found.extended.estimate.parameters[2] == pytest.approx(COULOMB, rel=0.02)
    assert found.cutoff_hz > 12.0


def test_a_stiff_chain_stays_adequate_in_the_usual_band() -> None:
    found = sprung(40.0)
    assert (found.verdict, found.causes) == (Verdict.ADEQUATE, ())
    assert found.cutoff_hz < 12.0


def test_a_wider_band_is_looked_at_only_where_it_could_name_something() -> None:
    adequate = axis(Verdict.ADEQUATE)
    blocked = replace(adequate, findings=(Finding("a", "b", "c", blocks=True),))
    suspicious = replace(adequate, suspected=(ripple(),))
    assert is_open(adequate, Verdict.ADEQUATE)
    assert is_open(suspicious, Verdict.UNEXPLAINED)
    assert not is_open(adequate, Verdict.UNEXPLAINED)
    assert not is_open(blocked, Verdict.ADEQUATE)
    assert not is_open(axis(Verdict.EXPLAINED, ripple()), Verdict.EXPLAINED)


def test_beside_something_unexplained_only_what_was_suspected_is_confirmed() -> None:
    suspicious = replace(axis(Verdict.UNEXPLAINED), suspected=(ripple(),))
    for again, verdict, settled in (
        (axis(Verdict.EXPLAINED, ripple()), Verdict.UNEXPLAINED, True),
        (axis(Verdict.EXPLAINED, ripple(), friction_by_direction()), Verdict.UNEXPLAINED, False),
        (axis(Verdict.EXPLAINED, friction_by_direction()), Verdict.UNEXPLAINED, False),
        (axis(Verdict.EXPLAINED, friction_by_direction()), Verdict.ADEQUATE, True),
        (axis(Verdict.UNEXPLAINED, ripple()), Verdict.UNEXPLAINED, False),
    ):
        assert settles(again, suspicious, verdict) is settled


def test_what_is_tied_to_a_moment_has_to_show_in_the_usual_band() -> None:
    """A sound chain rings after a jerk, which a wider band alone shows."""
    pulse = replace(ripple(), term=Term("disturbance_event", {"time": 1.0, "level": 1.0}))
    again = replace(axis(Verdict.EXPLAINED, ripple()), causes=(pulse,))
    suspicious = replace(axis(Verdict.UNEXPLAINED), suspected=(pulse,))
    assert not settles(again, axis(Verdict.ADEQUATE), Verdict.ADEQUATE)
    assert not settles(again, axis(Verdict.UNEXPLAINED), Verdict.UNEXPLAINED)
    assert settles(again, suspicious, Verdict.UNEXPLAINED)


@pytest.mark.parametrize(("left", "settled"), [(0.05, True), (0.07, False)])
def test_what_explains_little_is_no_cause_of_a_wider_band(left: float, settled: bool) -> None:
    again = axis(Verdict.EXPLAINED, ripple())
    base, extended = replace(again.base, fitted=0.1), replace(again.extended, fitted=left)
    again = replace(again, base=base, extended=extended, noise_floor=0.01)
    assert settles(again, axis(Verdict.ADEQUATE), Verdict.ADEQUATE) is settled


def test_a_band_is_no_wider_than_the_sampling_allows() -> None:
    band = Band(6.0, 3.0)
    assert band.wider(2.0, 0.0025) == Band(12.0, 3.0)
    assert band.wider(2.0, 0.005) == Band(10.0, 3.0)
    assert band.wider(2.0, 0.01) == band
