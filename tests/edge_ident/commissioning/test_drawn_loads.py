"""What a recording tells of the effort that other gains will meet."""

from dataclasses import replace

import numpy as np
import pytest

from edge_ident.commissioning.drawn_loads import (
    DRAWS,
    Grounds,
    RecordedMotion,
    drawn_axis,
    drawn_loads,
    drawn_unexplained,
    encoder_replicas,
    from_then_on,
)
from edge_ident.control.position_loop import LoopHardware
from edge_ident.model.inverse import inverse_effort
from edge_ident.model.model import Estimate, Model, Term, base_axis
from edge_ident.model.motion import Motion
from edge_ident.signals.conditioning import condition
from edge_ident.signals.recording import AxisRecord, Recording

PERIOD_S = 0.0025
COUNT_RAD = 2 * np.pi / 8400
BASE = np.array([0.43, 0.9, 1.4, 0.03])
TIME_S = PERIOD_S * np.arange(2400)
KNOWN = np.abs(np.cos(2.0 * TIME_S)) > 0.1


def unexplained(disturbance: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """What the base model leaves of a sinusoid's effort, and what drawn drives need of it."""
    position, velocity = np.sin(2.0 * TIME_S), 2.0 * np.cos(2.0 * TIME_S)
    needed = np.column_stack([-4.0 * position, velocity, np.sign(velocity), 1.0 + 0.0 * position])
    read = COUNT_RAD * np.round(position / COUNT_RAD)
    signals = condition(TIME_S, read, needed @ BASE + disturbance)
    left = np.tile(signals.effort - signals.regressor @ BASE, (DRAWS, 1))
    rng = np.random.default_rng(0)
    replicas = encoder_replicas(BASE, signals, read, rng)
    return left[0], drawn_unexplained(left, KNOWN, replicas, rng)


def slow_rms(effort: np.ndarray) -> np.ndarray:
    """Of the known part, below 3 Hz, where a loop feels it."""
    spectrum = np.fft.rfft(np.where(KNOWN, effort, 0.0))
    spectrum[..., np.fft.rfftfreq(len(TIME_S), PERIOD_S) > 3.0] = 0.0
    return np.sqrt(np.mean(np.fft.irfft(spectrum) ** 2, axis=-1))


def test_noise_of_the_encoder_is_no_effort_that_a_drive_needs() -> None:
    """Differentiated twice, rounding to counts leaves much effort unexplained on a sound axis."""
    left, drawn = unexplained(np.zeros(len(TIME_S)))
    rms = np.sqrt(np.mean(drawn[:, KNOWN] ** 2, axis=-1))
    assert np.median(rms) < 0.5 * np.sqrt(np.mean(left[KNOWN] ** 2))


def test_a_disturbance_stays_and_is_as_strong_whether_or_not_it_comes_back() -> None:
    disturbance = 0.1 * np.sin(9.0 * TIME_S)
    _, drawn = unexplained(disturbance)
    strength = np.sqrt(np.mean(slow_rms(drawn) ** 2))
    assert strength == pytest.approx(float(slow_rms(disturbance)), rel=0.1)


def test_replicas_at_every_other_sample_are_those_of_all() -> None:
    position = np.sin(2.0 * TIME_S)
    signals = condition(TIME_S, position, position)
    drawn = [
        encoder_replicas(BASE, signals, position, np.random.default_rng(1), every)
        for every in (1, 2)
    ]
    np.testing.assert_array_equal(drawn[0][:, ::2], drawn[1])


@pytest.mark.parametrize(("end_s", "inertia"), [(9.0, 0.53), (1.0, 0.43), (None, 0.43)])
def test_a_payload_taken_up_in_the_recording_stays(end_s: float | None, inertia: float) -> None:
    values = {"inertia": 0.1, "time": 4.0, "coulomb_friction": 0.2, "offset": 0.0}
    axis = base_axis(Estimate(BASE, np.zeros(4)))
    axis = replace(axis, terms=(*axis.terms, Term("payload_change", values)))
    drawn = drawn_axis(axis, np.random.default_rng(0))
    then = from_then_on(drawn, end_s)
    assert [term.effect for term in then.terms] == ["rigid_body"]
    assert then.parameters.shape == (1 + DRAWS, 4)
    assert then.parameters[:, 0] == pytest.approx(inertia)


def test_drives_without_anything_tied_to_time_are_the_same_from_then_on() -> None:
    drawn = drawn_axis(base_axis(Estimate(BASE, 0.01 * BASE)), np.random.default_rng(0))
    assert from_then_on(drawn, 9.0) is drawn
    assert drawn.parameters[0] == pytest.approx(BASE)


def test_friction_from_before_the_recording_is_no_disturbance_that_comes_back() -> None:
    """A recording begins right after a reversal: friction still acts as before it."""
    axis = base_axis(Estimate(BASE, np.zeros(4)))
    friction = Term("presliding_hysteresis", {"level": 1.2, "distance": 0.05})
    axis = replace(axis, terms=(*axis.terms, friction))
    before = 400
    time_s = PERIOD_S * np.arange(-before, len(TIME_S))
    way = -np.cos(2.0 * time_s), 2.0 * np.sin(2.0 * time_s), 4.0 * np.cos(2.0 * time_s)
    effort = inverse_effort(axis, Motion.known(time_s, *way))[before:]
    position = COUNT_RAD * np.round(way[0][before:] / COUNT_RAD)
    recording = Recording(TIME_S, {"x": AxisRecord(position, effort, "rad", "N·m")}, "recorded.csv")
    hardware = LoopHardware(PERIOD_S, PERIOD_S, COUNT_RAD, 5.0)
    moved, grounds = RecordedMotion.of(recording, ("x",)), Grounds(Model({"x": axis}), {}, {})
    loads, _ = drawn_loads("x", moved, grounds, hardware, 1)
    later = loads.beside[:, len(TIME_S) // 2 :]
    assert np.median(np.std(later, axis=0)) < 0.02 * friction.values["level"]
