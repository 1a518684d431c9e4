"""Recordings of ideal machines, each with one defect of the recording and none of the machine."""

import re

import numpy as np
import pytest
from numpy.typing import NDArray

from edge_ident.diagnosis.diagnose import diagnose
from edge_ident.diagnosis.measures import Verdict
from edge_ident.diagnosis.result import AxisDiagnosis
from edge_ident.identification.identify import identify
from edge_ident.signals.recording import AxisRecord, Recording

Array = NDArray[np.float64]

PERIOD_S, DURATION_S = 0.005, 20.0
INERTIA, VISCOUS, COULOMB, OFFSET = 0.115, 0.255, 0.242, -0.222
COUNT = 2.0 * np.pi / 65536


def ideal(tones: int = 1, *, before_s: float = 2.0) -> tuple[Array, Array, Array]:
    """Time, position and effort of a machine without a fault along one or four tones; from
    before_s before the record to as long after it."""
    time_s = PERIOD_S * np.arange(round((DURATION_S + 2.0 * before_s) / PERIOD_S)) - before_s
    position, velocity, acceleration = np.zeros((3, len(time_s)))
    for k, rate in enumerate((1.7, 4.1, 8.9, 15.2)[:tones]):
        size, phase = 1.9 / (1 + k) ** 1.5, 0.6 + 2.0 * k
        position += size * np.sin(rate * time_s + phase)
        velocity += size * rate * np.cos(rate * time_s + phase)
        acceleration -= size * rate**2 * np.sin(rate * time_s + phase)
    effort = INERTIA * acceleration + VISCOUS * velocity + COULOMB * np.sign(velocity) + OFFSET
    return time_s, position, effort


def inside(time_s: Array, *signals: Array) -> list[Array]:
    """The signals from time zero on, as long as the record is."""
    within = (time_s >= -0.5 * PERIOD_S) & (time_s < DURATION_S - 0.5 * PERIOD_S)
    return [signal[within] for signal in signals]


def recorded(position: Array, effort: Array, noise: float = 0.01) -> Recording:
    """With noise, as a share of the effort, and an encoder's rounding."""
    rng = np.random.default_rng(5)
    effort = effort + noise * np.std(effort) * rng.standard_normal(len(effort))
    axis = AxisRecord(COUNT * np.round(position / COUNT), effort, "rad", "N*m")
    return Recording(PERIOD_S * np.arange(len(effort)), {"x": axis}, "a test")


def named(axis: AxisDiagnosis) -> list[str]:
    return [cause.term.effect for cause in axis.causes]


@pytest.mark.parametrize("tones", [1, 4])
def test_rows_that_are_missing_are_no_load(tones: int) -> None:
    """Along one sinusoid a load took the place of the inertia, of which 0.7 % was left, with
    *explained*: it has no accelerations where rows are missing."""
    position, effort = inside(*ideal(tones))
    kept = np.random.default_rng(3).random(len(effort)) > 0.004
    recording = recorded(position[kept], effort[kept])
    diagnosis = diagnose([recording])
    assert (diagnosis.axes["x"].verdict, named(diagnosis.axes["x"])) == (Verdict.ADEQUATE, [])
    assert "lost_rows" in [finding.code for finding in diagnosis.data_quality]
    found = identify(recording).axes["x"]
    assert found.trusted
    assert "lost_rows" in [finding.code for finding in found.findings]
    assert found.estimate.parameters[0] == pytest.approx(INERTIA, rel=0.02)


@pytest.mark.parametrize("wrong", [6.0, 8.0, 20.0])
def test_what_takes_the_place_of_the_inertia_is_no_cause(wrong: float) -> None:
    """An encoder is wrong by some counts in a part of each turn: along one sinusoid a load has no
    acceleration there, and fits better than the inertia."""
    position, effort = inside(*ideal())
    angle = np.mod(position, 2.0 * np.pi)
    position = position + wrong * COUNT * ((angle > 1.0) & (angle < 1.1))
    axis = diagnose([recorded(position, effort)]).axes["x"]
    assert named(axis) == []
    found = axis.extended.estimate.parameters
    assert found[0] == pytest.approx(INERTIA, rel=0.05)


def test_a_load_that_bends_may_take_most_of_an_inertia() -> None:
    """The base model takes the load for three quarters of its inertia, but its bend for nothing."""
    position, effort = inside(*ideal())
    axis = diagnose([recorded(position, effort - 1.5 * np.sin(position / 0.8))]).axes["x"]
    assert axis.base.estimate.parameters[0] > 3.0 * INERTIA
    assert (axis.verdict, named(axis)) == (Verdict.EXPLAINED, ["position_dependent_load"])
    assert axis.extended.estimate.parameters[0] == pytest.approx(INERTIA, rel=0.1)


def filtered(signal: Array, hz: float) -> Array:
    """Behind a first-order low-pass filter."""
    kept = np.exp(-2.0 * np.pi * hz * PERIOD_S)
    out, state = np.empty_like(signal), signal[0]
    for k, value in enumerate(signal):
        state = kept * state + (1.0 - kept) * value
        out[k] = state
    return out


@pytest.mark.parametrize(("tones", "hz"), [(1, 3.0), (4, 10.0), (4, 4.0)])
def test_an_effort_that_was_smoothed_has_no_presliding_and_no_soft_coupling(
    tones: int, hz: float
) -> None:
    time_s, position, effort = ideal(tones)
    position, effort = inside(time_s, position, filtered(effort, hz))
    axis = diagnose([recorded(position, effort)]).axes["x"]
    assert (axis.verdict, named(axis)) == (Verdict.UNEXPLAINED, [])
    (doubt,) = [finding for finding in axis.findings if finding.blocks]
    assert doubt.code == "undetermined_filter"
    (said,) = re.findall(r"filter of ([0-9.]+) Hz", doubt.message)
    assert float(said) == pytest.approx(hz, rel=0.1)


@pytest.mark.parametrize("gain", [1.1, 1.3])
def test_an_amplifier_with_a_gain_for_each_sign_has_no_friction_along_the_stroke(
    gain: float,
) -> None:
    position, effort = inside(*ideal())
    axis = diagnose([recorded(position, np.where(effort > 0.0, gain, 1.0) * effort)]).axes["x"]
    assert named(axis) == []
