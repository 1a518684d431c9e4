"""Play that gains make up for: the motor leads, and is judged by the way that it was to take."""

from dataclasses import replace

import numpy as np

from edge_ident.commissioning.motor_way import of_motor, unseen_load
from edge_ident.commissioning.verification import compare_motions
from edge_ident.control.gain_design import GainDesign
from edge_ident.signals.recording import AxisRecord, Recording
from firmware_interface.gains import AxisGains
from firmware_interface.virtual.settings import CONSERVATIVE_GAINS

LEADING = replace(CONSERVATIVE_GAINS, backlash_offset_rad=0.01, backlash_distance_rad=0.002)
TIME = 0.0025 * np.arange(8000)
REFERENCE = np.sin(0.8 * TIME)


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
    led = of_motor(recording(leading_motor()), {"x": LEADING}).axes["x"]
    np.testing.assert_allclose(led.reference, led.position, atol=1e-12)


def test_without_such_a_term_the_way_is_the_reference() -> None:
    plain = recording(REFERENCE)
    assert of_motor(plain, {"x": CONSERVATIVE_GAINS}).axes["x"] is plain.axes["x"]


def test_the_lead_is_not_taken_for_an_error() -> None:
    noise = 1e-3 * np.random.default_rng(1).standard_normal((2, len(TIME)))
    before = recording(REFERENCE + noise[0])
    after = recording(leading_motor() + noise[1])
    assert compare_motions(before, after, 7.5e-4).verdict == "worse"
    ways = of_motor(before, {"x": CONSERVATIVE_GAINS}), of_motor(after, {"x": LEADING})
    assert compare_motions(*ways, 7.5e-4).verdict == "equal"


def test_the_outcome_says_what_the_encoder_cannot_show() -> None:
    def designed(gains: AxisGains) -> GainDesign:
        return GainDesign(gains, 20.0, 1.0, 3.0, 0.1)

    assert unseen_load({"x": designed(CONSERVATIVE_GAINS)}) == ""
    said = unseen_load({"x": designed(LEADING), "z": designed(CONSERVATIVE_GAINS)})
    assert said.startswith("; axis x: ")
    assert "the encoder on the motor cannot show" in said
