"""What is missed above the band: a vibration there by its size, and little of a sound axis."""

import numpy as np
import pytest

from edge_ident.diagnosis.above_band.content import above_band
from edge_ident.diagnosis.prepare.preparation import prepare_axis
from edge_ident.signals.recording import AxisRecord, Recording

PERIOD_S = 0.0025


def missed(amplitude: float) -> float:
    """Of a rigid axis in an effort of 1.4 N·m rms, and of a vibration about 45 Hz."""
    time_s = np.arange(0.0, 30.0, PERIOD_S)
    velocity = 1.2 + 0.8 * np.sin(1.1 * time_s) + 0.3 * np.sin(2.7 * time_s)
    acceleration = 0.88 * np.cos(1.1 * time_s) + 0.81 * np.cos(2.7 * time_s)
    effort = 0.4 * acceleration + 0.5 * velocity + 0.8
    phase = 2.0 * np.pi * (45.0 * time_s + 3.0 * np.sin(0.4 * time_s))
    noise = 0.01 * np.random.default_rng(2).standard_normal(len(time_s))
    effort = effort + amplitude * np.sin(phase) + noise
    position = np.cumsum(velocity) * PERIOD_S
    step = 2.0 * np.pi / 2**18
    axis = AxisRecord(step * np.round(position / step), effort, "rad", "N*m")
    recording = Recording(time_s, {"x": axis}, "written", 0.0)
    return above_band([recording], "x", prepare_axis([recording], "x")).missed


def test_a_vibration_is_missed_by_its_size() -> None:
    assert missed(0.2) == pytest.approx(0.2 / np.sqrt(2.0), rel=0.1)


def test_nothing_is_missed_of_a_sound_axis() -> None:
    assert missed(0.0) < 0.01
