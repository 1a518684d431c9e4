"""Least squares: exact on exact data, honest deviations on coloured noise, EMPS's figures."""

import numpy as np
import pytest
import scipy.signal

from edge_ident.errors import DataError
from edge_ident.estimation import least_squares
from edge_ident.estimation.least_squares import Columns
from edge_ident.model import model
from edge_ident.signals.conditioning import Signals, condition
from edge_ident.signals.filters import lowpass
from edge_ident.signals.recording_files import load_recording
from edge_ident.signals.time_stamps import EvenGrid
from tests.measured import MeasuredData

PERIOD_S = 0.0025
TRUTH = np.array([0.43, 0.9, 1.4, 0.05])
PUBLISHED = [95.1089, 203.5034, 20.3935, -3.1648]
"""Of the EMPS benchmark (Janot, Gautier, Brunot 2019)."""


def drive(noise: np.ndarray, phase: float = 0.0, amplitude: float = 2 * np.pi) -> tuple:
    """Time, quantized position and effort of a drive that obeys the base model."""
    time = PERIOD_S * np.arange(len(noise))
    angle = 0.2875 * time + phase
    velocity = amplitude * 0.2875 * np.cos(angle)
    acceleration = -amplitude * 0.2875**2 * np.sin(angle)
    inertia, viscous, coulomb, offset = TRUTH
    effort = inertia * acceleration + viscous * velocity + coulomb * np.sign(velocity) + offset
    count = 2 * np.pi / 8400
    return time, count * np.round(amplitude * np.sin(angle) / count), effort + noise


def solve(signals) -> tuple:
    part = least_squares.estimation_part(signals)
    return part.columns, signals.effort[part.samples]


def fit(signals: Signals) -> model.Estimate:
    return least_squares.fit(signals, least_squares.estimation_part(signals))


def test_a_noise_free_drive_is_recovered() -> None:
    found = fit(condition(*drive(np.zeros(8742), 0.4)))
    np.testing.assert_allclose(found.parameters, TRUTH, rtol=5e-3, atol=1e-4)


def test_encoder_noise_does_not_bias_the_inertia() -> None:
    """The cut-off lets as much noise into the acceleration as takes 0.25 % off the inertia."""
    plain, corrected = [], []
    for phase in np.linspace(0.1, 6.0, 25):
        signals = condition(*drive(np.zeros(8742), phase))
        plain.append(least_squares.solve(*solve(signals)).parameters[0])
        corrected.append(fit(signals).parameters[0])
    assert np.mean(plain) / TRUTH[0] - 1 == pytest.approx(-0.0025, abs=0.001)
    assert np.mean(corrected) / TRUTH[0] - 1 == pytest.approx(0.0, abs=0.001)


def test_a_reversal_that_the_filter_moves_is_put_back() -> None:
    """A kink at zero speed is smeared, so the filtered velocity changes its sign too early."""
    time, cutoff_hz = PERIOD_S * np.arange(8742), 4.0
    smooth = 1.8 * np.sin(1.3 * time) + 0.7 * np.sin(2.9 * time + 1.0)
    velocity = np.where(smooth > 0, smooth, 0.3 * smooth)
    true = model.regressor(velocity, np.gradient(velocity, PERIOD_S))
    filtered = np.column_stack([lowpass(column, cutoff_hz, PERIOD_S) for column in true.T])
    seen = filtered.copy()
    seen[:, 2] = lowpass(np.sign(filtered[:, 1]), cutoff_hz, PERIOD_S)
    moving = np.ones(len(time), dtype=bool)
    signals = Signals(EvenGrid.of(time), cutoff_hz, filtered @ TRUTH, seen, moving, 1e-6)
    plain = least_squares.solve(*solve(signals)).parameters - TRUTH
    found = fit(signals)
    error = np.abs(found.parameters - TRUTH)
    assert np.all(error < 0.3 * np.abs(plain))
    assert np.all(error < found.std)


@pytest.mark.parametrize("correlation", [0.0, 0.9, 0.97])
def test_intervals_cover_the_truth_under_coloured_noise(correlation: float) -> None:
    rng = np.random.default_rng(17)
    covered = []
    for _ in range(60):
        white = rng.normal(size=10742)
        noise = scipy.signal.lfilter([1], [1, -correlation], white)[2000:]
        noise *= 0.1 / np.std(noise)
        found = fit(condition(*drive(noise, rng.uniform(0, 6))))
        covered.append(np.abs(found.parameters - TRUTH) < 1.96 * found.std)
    # 95 % wanted; 60 draws of four parameters resolve about 3 points
    assert 0.90 < np.mean(covered) < 0.99


def test_half_of_the_noise_in_the_regressor_is_corrected_and_the_rest_is_doubted() -> None:
    """A loop follows its encoder's noise, so the bias lies between none and that of white noise."""
    rng = np.random.default_rng(5)
    clean = rng.standard_normal((20000, 4))
    noisy = clean + np.array([0.2, 0.0, 0.0, 0.0]) * rng.standard_normal((20000, 4))
    effort = clean @ TRUTH
    half = 0.5 * TRUTH[0] * 0.2**2 / (1.0 + 0.2**2)
    found = least_squares.solve(Columns(noisy), effort, acceleration_noise=0.2)
    assert TRUTH[0] - found.parameters[0] == pytest.approx(half, rel=0.2)
    assert found.std[0] == pytest.approx(half, rel=0.2)


def test_plain_standard_errors_would_not_do() -> None:
    """The reason for the robust covariance: independent residuals are assumed too small."""
    rng = np.random.default_rng(3)
    noise = 0.01 * scipy.signal.lfilter([1], [1, -0.995], rng.normal(size=8742))
    columns, effort = solve(condition(*drive(noise)))
    found, regressor = least_squares.solve(columns, effort), columns.values
    residual = effort - regressor @ found.parameters
    plain = np.sqrt(np.diag(np.linalg.inv(regressor.T @ regressor)) * np.mean(residual**2))
    assert np.all(found.std > 1.15 * plain)


def test_the_slow_sinusoid_is_well_conditioned() -> None:
    columns, _ = solve(condition(*drive(np.zeros(8742))))
    assert columns.condition_number == pytest.approx(4.5, abs=0.3)  # paper.md


def test_emps_figures(measured_data: MeasuredData) -> None:
    """As published, and the corrections for encoder and reversals hardly move them."""
    axis = load_recording(measured_data / "emps_train.csv").axes["q"]
    time = load_recording(measured_data / "emps_train.csv").time_s
    signals = condition(time, axis.position, axis.effort)
    columns, effort = solve(signals)
    found, regressor = least_squares.solve(columns, effort), columns.values
    np.testing.assert_allclose(found.parameters, PUBLISHED, rtol=0.01)
    residual = effort - regressor @ found.parameters
    assert np.linalg.norm(residual) / np.linalg.norm(effort) == pytest.approx(0.0408, abs=0.002)
    corrected = fit(signals).parameters
    np.testing.assert_allclose(corrected, PUBLISHED, rtol=0.01)


def test_moves_that_are_too_short_for_the_sampling_rate_are_said_to_be() -> None:
    """Of moves of 0.25 s, with rests as long between them, a longer record shows no more."""
    time = 0.01 * np.arange(4000)
    speed = np.where(time % 0.5 < 0.25, 1.0 - np.cos(8.0 * np.pi * time), 0.0)
    position = np.round(np.cumsum(speed * np.where(time % 4.0 < 2.0, 1.0, -1.0)) / 1e-3) * 1e-5
    with pytest.raises(DataError) as refused:
        fit(condition(time, position, speed))
    assert "100 Hz shows moves between rests of 0.6 s, or more" in str(refused.value.next_step)
