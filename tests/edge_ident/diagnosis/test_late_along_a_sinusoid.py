"""An effort that was recorded late, or early, along one sinusoid.

Inertia and viscous friction share any phase there. Only what reverses tells a shift, and play or
presliding are late where the motion reverses as well.
"""

import numpy as np
import pytest
from numpy.typing import NDArray

from edge_ident.diagnosis.diagnose import diagnose
from edge_ident.diagnosis.measures import Verdict
from edge_ident.diagnosis.result import AxisDiagnosis, Diagnosis
from edge_ident.signals.recording import AxisRecord, Recording
from tests.repetitions import a_few

Array = NDArray[np.float64]

PERIOD_S, SAMPLES, BEFORE = 0.0025, 4000, 400
INERTIA, VISCOUS, COULOMB, OFFSET = 0.5, 0.8, 0.6, 0.2


def recorded(
    rate: float, late_s: float = 0.0, *, count: float = 0.0, softness: float = 0.0
) -> Diagnosis:
    """A drive along a sinusoid of unit amplitude; softness is the distance in which its friction
    turns over (Dahl)."""
    rng = np.random.default_rng(2)
    time_s = PERIOD_S * np.arange(SAMPLES + 2 * BEFORE)
    position = np.sin(rate * time_s + rate)
    velocity = rate * np.cos(rate * time_s + rate)
    friction = dahl(position, softness) if softness else np.sign(velocity)
    effort = VISCOUS * velocity - INERTIA * rate**2 * position + COULOMB * friction + OFFSET
    effort = np.interp(time_s - late_s, time_s, effort + 0.02 * rng.standard_normal(len(time_s)))
    if count:
        position = count * np.round(position / count)
    else:
        position = position + 2e-7 * rng.standard_normal(len(time_s))
    inside = slice(BEFORE, BEFORE + SAMPLES)
    axis = AxisRecord(position[inside], effort[inside], "rad", "N*m")
    return diagnose([Recording(PERIOD_S * np.arange(SAMPLES), {"x": axis}, "a test")])


def dahl(position: Array, softness: float) -> Array:
    """Friction of unit level, by the exact solution between two samples."""
    state = np.zeros(len(position))
    for k, step in enumerate(np.diff(position)):
        way, kept = np.sign(step), np.exp(-abs(step) / softness)
        state[k + 1] = way + (state[k] - way) * kept
    return state


def named(axis: AxisDiagnosis) -> list[str]:
    return [cause.term.effect for cause in axis.causes]


LATE = ((1.1, -0.05), (2.0, 0.1), (5.0, 0.06))


@pytest.mark.parametrize(("rate", "late_s"), a_few(LATE, LATE[:2]))
def test_a_late_effort_is_named_and_its_parameters_are_right(rate: float, late_s: float) -> None:
    axis = recorded(rate, late_s).axes["x"]
    assert (axis.verdict, named(axis)) == (Verdict.EXPLAINED, ["time_delay"])
    assert axis.causes[0].term.values["delay"] == pytest.approx(late_s, abs=PERIOD_S)
    found = axis.extended.estimate.parameters
    assert found == pytest.approx([INERTIA, VISCOUS, COULOMB, OFFSET], rel=0.02)


@pytest.mark.parametrize("softness", a_few([0.03, 0.1], [0.1]))
def test_presliding_is_no_late_effort(softness: float) -> None:
    axis = recorded(2.0, softness=softness).axes["x"]
    assert named(axis) == ["presliding_hysteresis"]
    assert not any(finding.blocks for finding in axis.findings)


def test_a_load_that_bounces_takes_no_better_cause_s_place() -> None:
    """It left seven times as much, which its discrepancy and the noise that it passes excused."""
    axis = recorded(2.0, softness=0.1, count=2.0 * np.pi / 65536).axes["x"]
    assert named(axis) == ["presliding_hysteresis"]
    assert axis.extended.fitted < 1.3 * axis.noise_floor


@pytest.mark.parametrize("late_s", [0.05, 0.08, -0.06])
@pytest.mark.parametrize("counts", [2000, 8400])
def test_where_the_encoder_hides_the_reversal_a_late_effort_is_no_play(
    counts: int, late_s: float
) -> None:
    axis = recorded(2.0, late_s, count=2.0 * np.pi / counts).axes["x"]
    assert set(named(axis)) <= {"time_delay"}


def test_what_a_shift_explains_about_as_well_is_only_suspected() -> None:
    axis = recorded(2.0, 0.08, count=2.0 * np.pi / 8400).axes["x"]
    (doubt,) = [finding for finding in axis.findings if finding.blocks]
    assert doubt.code == "undetermined_delay"
    assert doubt.message.startswith("later by")
    (suspected,) = axis.suspected
    assert (axis.verdict, suspected.term.effect) == (Verdict.UNEXPLAINED, "presliding_hysteresis")
    assert suspected.decision == doubt.message
