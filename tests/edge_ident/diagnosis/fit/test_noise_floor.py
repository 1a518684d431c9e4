"""The noise floor is that of noise, whatever differs from lap to lap besides."""

import numpy as np

from edge_ident.diagnosis.diagnose import diagnose
from edge_ident.diagnosis.fit.noise_floor import NoiseFloor
from edge_ident.signals.recording import AxisRecord, Recording

PERIOD_S = 0.004
NOISE = 0.01


def swing(time_s: np.ndarray, rates: tuple[float, ...], order: int) -> np.ndarray:
    """Sum of sinusoids of as much acceleration each, differentiated."""
    return sum(w ** (order - 2) * np.sin(w * time_s + w + order * np.pi / 2) for w in rates)


def test_what_another_axis_does_from_lap_to_lap_is_no_noise() -> None:
    """One axis repeats its motion every two seconds, and the other moves it in no such rhythm."""
    time_s = np.arange(0.0, 24.0, PERIOD_S)
    mine, other = (np.pi, 4.0 * np.pi, 9.0 * np.pi), (2.3, 7.1, 17.9)
    velocity = swing(time_s, mine, 1)
    effort = swing(time_s, mine, 2) + 0.8 * velocity + 0.3 * np.sign(velocity)
    effort += 0.2 * swing(time_s, other, 2)
    effort += NOISE * np.random.default_rng(5).standard_normal(len(time_s))
    axes = {
        "x": AxisRecord(swing(time_s, mine, 0), effort, "rad", "N*m"),
        "y": AxisRecord(swing(time_s, other, 0), swing(time_s, other, 2), "rad", "N*m"),
    }
    found = diagnose([Recording(time_s, axes, "test")], only=["x"]).axes["x"]
    assert [cause.term.effect for cause in found.causes] == ["cross_axis_coupling"]
    assert found.noise_floor * np.sqrt(np.mean(effort**2)) < 1.2 * NOISE
    assert found.noise_floor_source == "from what the model leaves"


def test_noise_is_no_more_than_what_a_model_leaves() -> None:
    floor = NoiseFloor(0.05, 0.1, "from the motion's repetition")
    assert floor.at_most(0.06) is floor
    assert floor.at_most(0.02).rms == 0.02
