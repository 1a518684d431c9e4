"""The residual in motion, against what follows from the equations of motion by hand."""

from dataclasses import replace

import numpy as np
import pytest

from edge_ident.diagnosis.measures import Verdict
from edge_ident.diagnosis.motion_check import with_motion_errors
from edge_ident.diagnosis.result import Diagnosis
from edge_ident.model.inverse import inverse_effort
from edge_ident.model.model import AxisModel, Estimate, Term, base_axis
from edge_ident.model.motion import Motion
from edge_ident.signals.recording import AxisRecord, Recording
from tests.edge_ident.diagnosis import hand_made
from tests.edge_ident.diagnosis.hand_made import PERIOD_S, STD, TRUTH

CUTOFF_HZ = 6.5
POLE = 2.0 * np.pi * CUTOFF_HZ / 5.0
RIPPLE = Term("torque_ripple", {"cosine": 0.5, "sine": 0.0, "period": 2.0})
TIME = PERIOD_S * np.arange(4000)


def wave() -> Motion:
    """Two sines, with reversals."""
    angle = 0.9 * TIME + 0.3
    position = 3.0 * np.sin(angle) + 0.5 * np.sin(4.0 * angle)
    velocity = 0.9 * (3.0 * np.cos(angle) + 2.0 * np.cos(4.0 * angle))
    acceleration = -(0.9**2) * (3.0 * np.sin(angle) + 8.0 * np.sin(4.0 * angle))
    return Motion.known(TIME, position, velocity, acceleration)


def ramp() -> Motion:
    """Constant speed."""
    return Motion.known(TIME, 2.0 * TIME, np.full_like(TIME, 2.0), np.zeros_like(TIME))


def drive(*effects: Term, parameters: np.ndarray = TRUTH) -> AxisModel:
    base = base_axis(Estimate(parameters, STD))
    return AxisModel((*base.terms, *effects))


def recorded(truth: AxisModel, motion: Motion, delay_s: float = 0.0) -> Recording:
    """What the truth would record, its effort late by a delay."""
    effort = np.interp(TIME - delay_s, TIME, inverse_effort(truth, motion))
    axis = AxisRecord(motion.position, effort.reshape(TIME.shape), "rad", "N*m")
    return Recording(TIME, {"x": axis}, "test")


def errors(
    recordings: list[Recording], model: AxisModel, base: np.ndarray = TRUTH
) -> tuple[float | None, float | None]:
    """Before and after."""
    axis = hand_made.axis(Verdict.ADEQUATE, samples=400)
    axis = replace(
        axis,
        model=model,
        base=replace(axis.base, estimate=Estimate(base, STD)),
        extended=replace(axis.extended, estimate=Estimate(TRUTH, STD)),
        cutoff_hz=CUTOFF_HZ,
    )
    found = with_motion_errors(Diagnosis({"x": axis}, (), {}), recordings).axes["x"]
    return found.base.motion_error, found.extended.motion_error


def test_the_true_model_follows_the_measured_motion() -> None:
    error, _ = errors([recorded(drive(), wave())], drive())
    assert error < 1e-3 * 7.0  # of the travel


def test_a_constant_residual_is_held_by_the_feedbacks_stiffness() -> None:
    """In steady motion, residual = inertia·pole²·error."""
    off = TRUTH + np.array([0.0, 0.0, 0.0, 0.4])
    before, after = errors([recorded(drive(), ramp())], drive(), off)
    assert before == pytest.approx(0.4 / (TRUTH[0] * POLE**2), rel=0.1)
    assert after < 0.02 * before


def test_a_model_without_the_effect_strays_one_with_it_does_not() -> None:
    truth = drive(RIPPLE)
    before, after = errors([recorded(truth, wave())], truth)
    assert after < 0.1 * before
    assert before < 0.5 / (TRUTH[0] * POLE**2)  # no more than at rest at the ripple's crest


def test_a_delay_of_the_record_is_taken_out_of_the_effort() -> None:
    late = recorded(drive(), wave(), delay_s=0.02)
    before, after = errors([late], drive(Term("time_delay", {"delay": 0.02})))
    assert after < 0.2 * before


def test_effects_in_time_meet_every_stretch_at_its_own_time() -> None:
    event = Term(
        "payload_change", {"time": 6.0, "inertia": 0.3, "coulomb_friction": 0.0, "offset": 0.5}
    )
    truth = drive(event)
    before, after = errors([recorded(truth, wave())], truth)
    assert after < 0.1 * before


def test_recordings_are_followed_each_from_its_own_start() -> None:
    truth = drive(RIPPLE)
    shifted = replace(recorded(truth, wave()), time_s=TIME + 100.0)
    one, _ = errors([recorded(truth, wave())], truth)
    two, _ = errors([recorded(truth, wave()), shifted], truth)
    assert two == pytest.approx(one, rel=1e-6)


def test_a_short_recording_is_followed_as_far_as_it_goes() -> None:
    whole = recorded(drive(), wave())
    axis = whole.axes["x"]
    short = replace(
        whole,
        time_s=TIME[:300],
        axes={"x": replace(axis, position=axis.position[:300], effort=axis.effort[:300])},
    )
    error, _ = errors([short], drive())
    assert error < 0.01


def test_what_cannot_be_simulated_has_no_error() -> None:
    recording = recorded(drive(), wave())
    stiff = Term("presliding_hysteresis", {"level": 0.5, "distance": 1e-7})
    unphysical = TRUTH * [-1.0, 1.0, 1.0, 1.0]
    assert errors([recording], drive(stiff), unphysical) == (None, None)
