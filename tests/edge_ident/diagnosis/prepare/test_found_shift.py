"""The shift that the diagnosis finds in a recording without one."""

import numpy as np
import pytest

from edge_ident.diagnosis.prepare import timing
from edge_ident.diagnosis.prepare.preparation import prepare_axis
from edge_ident.diagnosis.prepare.segment import Segment
from edge_ident.diagnosis.prepare.timing import whole_shift
from edge_ident.drive.motions import MotionName
from edge_ident.signals.recording import AxisRecord, Recording
from edge_ident.simulation.flexible import reduced_model
from edge_ident.simulation.simulate import simulate
from tests.repetitions import a_few


@pytest.mark.parametrize("motion", a_few(["sinusoid", "multisine", "staircase"], ["sinusoid"]))
def test_a_rigid_drive_without_noise_is_in_step(motion: MotionName) -> None:
    """In closed loop, with the rounding of encoder and effort; the shift is that of the board.

    Effort and motion fade with the same weight at unknown directions, or a shift of up to a sample
    appears, nine standard deviations.
    """
    recording = simulate(reduced_model(), motion)
    for name in ("x", "z"):
        (segment,) = prepare_axis([recording], name).segments
        found = whole_shift(segment, np.zeros(len(segment.sample_index)))
        assert abs(found.shift_s) < 3.0 * found.std_s, name
        if motion != "sinusoid":
            assert abs(found.shift_s) < 0.1 * segment.raw_period_s, name


@pytest.mark.parametrize("late_samples", [-1.2, 0.4])
def test_where_the_first_order_asks_for_the_wrong_way_a_shift_that_was_tried_is_taken(
    late_samples: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As beside a dead band: the first order is stood in for by a step to the farther limit."""
    time_s, period_s = np.arange(0.0, 20.0, 0.02), 0.02
    rates = 2.0 * np.pi * np.array([0.2, 0.9, 2.1])
    sizes = 1.0 / rates**2

    def effort(at: np.ndarray) -> np.ndarray:
        angles = np.outer(rates, at)
        velocity = (sizes * rates) @ np.cos(angles)
        return -2.0 * (sizes * rates**2) @ np.sin(angles) + 9.0 * velocity + 0.5 * np.sign(velocity)

    def farther(segment: Segment) -> Segment:
        return segment.in_step(-np.copysign(1.5 * period_s, late_samples))

    monkeypatch.setattr(timing, "_moved", farther)
    position = sizes @ np.sin(np.outer(rates, time_s))
    noise = 0.01 * np.random.default_rng(3).standard_normal(len(time_s))
    axis = AxisRecord(position, effort(time_s - late_samples * period_s) + noise, "rad", "N*m")
    (segment,) = prepare_axis([Recording(time_s, {"x": axis}, "test")], "x").segments
    assert segment.applied_s / period_s == pytest.approx(late_samples, abs=0.1)
