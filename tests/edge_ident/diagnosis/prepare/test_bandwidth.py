"""The band of a diagnosis makes the noise white, whatever the noise."""

import numpy as np
import pytest
import scipy.signal

from edge_ident.diagnosis.prepare.bandwidth import (
    Band,
    balanced_band,
    comparison_band,
    white_noise,
)
from edge_ident.signals.conditioning import choose_cutoff
from edge_ident.signals.filters import differentiate

PERIOD_S = 0.002
INERTIA = 0.4
POSITION_NOISE = 2e-4
EFFORT_NOISE = 0.05


def swing() -> tuple[np.ndarray, np.ndarray]:
    """Position and effort of an axis with noise in both, (N,) each."""
    rng = np.random.default_rng(7)
    time_s = np.arange(100_000) * PERIOD_S
    rate = 2.0 * np.pi * 0.3
    position = np.sin(rate * time_s) + POSITION_NOISE * rng.standard_normal(len(time_s))
    effort = -INERTIA * rate**2 * np.sin(rate * time_s)
    return position, effort + EFFORT_NOISE * rng.standard_normal(len(time_s))


def unevenness(band: Band) -> float:
    """Largest over smallest density, within the band, of what a perfect model leaves."""
    position, effort = swing()
    acceleration = differentiate(position, 2.0 * band.cutoff_hz, PERIOD_S)[2]
    left = band.lowpass(effort - INERTIA * acceleration, PERIOD_S)
    frequency_hz, density = scipy.signal.welch(left, 1.0 / PERIOD_S, nperseg=2048)
    inside = density[(frequency_hz > 0.6) & (frequency_hz < 0.6 * band.cutoff_hz)]
    return float(np.max(inside) / np.min(inside))


def test_above_the_knee_the_filter_falls_as_the_noise_grows() -> None:
    density = 2.0 * PERIOD_S * EFFORT_NOISE**2
    position, effort = swing()
    widest_hz = choose_cutoff(position, PERIOD_S)
    band = comparison_band(position, effort, POSITION_NOISE, density, widest_hz, PERIOD_S)
    both_alike_hz = np.sqrt(EFFORT_NOISE / (INERTIA * POSITION_NOISE)) / (2.0 * np.pi)
    assert band.knee_hz == pytest.approx(both_alike_hz, rel=0.05)
    assert band.cutoff_hz == pytest.approx(min(4.0 * band.knee_hz, widest_hz))
    assert unevenness(band) < 1.5
    assert unevenness(Band(band.cutoff_hz, np.inf)) > 2.5


def test_the_band_of_an_estimate_balances_the_noise_of_encoder_and_effort() -> None:
    density = 2.0 * PERIOD_S * EFFORT_NOISE**2
    band = balanced_band(INERTIA, POSITION_NOISE, density, 20.0, PERIOD_S)
    rng = np.random.default_rng(8)
    encoder, effort = rng.standard_normal((2, 200_000))
    acceleration = differentiate(POSITION_NOISE * encoder, 2.0 * band.cutoff_hz, PERIOD_S)[2]
    seen = [band.lowpass(x, PERIOD_S) for x in (INERTIA * acceleration, EFFORT_NOISE * effort)]
    assert np.std(seen[0]) == pytest.approx(np.std(seen[1]), rel=0.05)


@pytest.mark.parametrize(("noise", "density"), [(0.0, 1e-5), (2e-4, 0.0)])
def test_a_perfect_instrument_has_a_band_too(noise: float, density: float) -> None:
    position, effort = swing()
    band = comparison_band(position, effort, noise, density, 50.0, PERIOD_S)
    assert 0.0 < band.cutoff_hz <= 50.0
    assert np.all(np.isfinite(band.lowpass(effort, PERIOD_S)))


@pytest.mark.parametrize("late", [-9, -4, 0, 4, 9])
def test_a_controllers_answer_to_rounding_is_no_noise_whichever_column_is_late(late: int) -> None:
    rng = np.random.default_rng(9)
    time_s = np.arange(20_000) * PERIOD_S
    count, rate = 1e-3, 2.0 * np.pi * 0.3
    read = count * np.round(np.sin(rate * time_s) / count)
    answer = -20.0 * np.diff(read, prepend=read[0]) / PERIOD_S
    effort = answer - INERTIA * rate**2 * np.sin(rate * time_s)
    effort += EFFORT_NOISE * rng.standard_normal(len(time_s))
    whole = slice(10, -10)
    found = white_noise(effort[whole], np.roll(read, late)[whole], 10.0, PERIOD_S)
    assert found == pytest.approx(EFFORT_NOISE, rel=0.05)
