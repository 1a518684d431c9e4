"""Play that gains make up for: the motor leads, and is judged by the way that it was to take."""

from dataclasses import replace

import numpy as np
import pytest

from edge_ident.commissioning.drawn_loads import Grounds, RecordedMotion
from edge_ident.commissioning.tracking_forecast import drawn_errors, of_motor, unseen_load
from edge_ident.commissioning.verification import compare_motions
from edge_ident.control.gain_design import GainDesign
from edge_ident.control.position_loop import LoopHardware
from edge_ident.model.model import Estimate, Model, base_axis
from edge_ident.signals.recording import AxisRecord, Recording
from firmware_interface.gains import CONSERVATIVE_GAINS, AxisGains
from firmware_interface.motion import Multisine, SineComponent, Trajectory, reference

LEADING = replace(CONSERVATIVE_GAINS, backlash_offset_rad=0.01, backlash_distance_rad=0.002)
TIME = 0.0025 * np.arange(8000)
REFERENCE = np.sin(0.8 * TIME)


def trajectory(phase_rad: float = 0.0) -> Trajectory:
    """That of `REFERENCE`, or with another phase."""
    return Trajectory({"x": Multisine((SineComponent(1.0, 0.8, phase_rad),))}, 20.0, 5.0)


def recording(position: np.ndarray) -> Recording:
    return Recording(TIME, {"x": AxisRecord(position, 0 * TIME, "rad", "N*m", REFERENCE)}, "test")


def leading_motor() -> np.ndarray:
    """Half the gap ahead of the reference, in the direction that it goes to."""
    ahead, position = 0.01, np.empty_like(REFERENCE)
    for k, step in enumerate(np.diff(REFERENCE, prepend=REFERENCE[0])):
        side = np.copysign(0.01, step)
        ahead += (side - ahead) * (1.0 - np.exp(-abs(step) / 0.002))
        position[k] = REFERENCE[k] + ahead
    return position


def test_a_motor_that_leads_as_it_should_follows_its_way() -> None:
    led = of_motor(recording(leading_motor()), {"x": LEADING}, trajectory()).axes["x"]
    np.testing.assert_allclose(led.reference, led.position, atol=1e-12)


def test_a_motion_that_begins_with_a_reversal_begins_on_the_side_that_it_came_from() -> None:
    turning = np.cos(0.8 * TIME)
    record = AxisRecord(turning, 0 * TIME, "rad", "N*m", turning)
    moved = Recording(TIME, {"x": record}, "test")
    led = of_motor(moved, {"x": LEADING}, trajectory(np.pi / 2)).axes["x"].reference
    assert led is not None
    assert led[0] - turning[0] == pytest.approx(0.01, abs=1e-9)
    assert led[400] - turning[400] == pytest.approx(-0.01, abs=1e-9)


def test_the_forecast_counts_the_lead_as_no_error_either() -> None:
    """A drive without friction and noise, and gains that feed all of its effort forward."""
    way = reference(trajectory().axes["x"], TIME, 5.0, 0.0)
    base = np.array([0.4, 0.9, 1e-9, 0.0])
    needed = base[0] * way.acceleration_rad_s2 + base[1] * way.velocity_rad_s
    record = AxisRecord(way.position_rad, needed, "rad", "N*m", way.position_rad)
    model = Model({"x": base_axis(Estimate(base, 1e-3 * base))})
    hardware = LoopHardware(0.0025, 0.0005, 0.0, 12.0)
    gains = replace(CONSERVATIVE_GAINS, inertia_feedforward=0.4, viscous_feedforward=0.9)
    gains = replace(gains, proportional=120.0, derivative=13.0)
    leading = replace(gains, backlash_offset_rad=0.01, backlash_distance_rad=0.2)
    moved = RecordedMotion.along(Recording(TIME, {"x": record}, "test"), trajectory())
    grounds = Grounds(model, {}, {})
    banks = ({"x": gains}, {"x": leading})
    plain, led = drawn_errors(moved, grounds, {"x": hardware}, (), banks)
    assert np.max(led["x"].rms_rad) < 0.15 * 0.01
    assert np.max(plain["x"].rms_rad) < 0.15 * 0.01


def test_without_such_a_term_the_way_is_the_reference() -> None:
    plain = recording(REFERENCE)
    assert of_motor(plain, {"x": CONSERVATIVE_GAINS}, trajectory()).axes["x"] is plain.axes["x"]


def test_the_lead_is_not_taken_for_an_error() -> None:
    noise = 1e-3 * np.random.default_rng(1).standard_normal((2, len(TIME)))
    before = recording(REFERENCE + noise[0])
    after = recording(leading_motor() + noise[1])
    assert compare_motions(before, after, 7.5e-4).verdict == "worse"
    banks = ({"x": CONSERVATIVE_GAINS}, {"x": LEADING})
    ways = (of_motor(r, g, trajectory()) for r, g in zip((before, after), banks, strict=True))
    assert compare_motions(*ways, 7.5e-4).verdict == "equal"


def test_the_outcome_says_what_the_encoder_cannot_show() -> None:
    def designed(gains: AxisGains) -> GainDesign:
        return GainDesign(gains, 20.0, 1.0, 3.0, 0.1)

    assert unseen_load({"x": designed(CONSERVATIVE_GAINS)}) == ""
    said = unseen_load({"x": designed(LEADING), "z": designed(CONSERVATIVE_GAINS)})
    assert said.startswith("; axis x: ")
    assert "its encoder cannot show" in said
