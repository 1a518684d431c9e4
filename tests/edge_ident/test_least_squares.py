"""Least squares: exact on exact data, honest deviations on coloured noise, EMPS's figures."""

from pathlib import Path

import numpy as np
import pytest
import scipy.signal

from edge_ident import least_squares
from edge_ident.recording_files import load_recording
from edge_ident.signals import condition

PERIOD_S = 0.0025
TRUTH = np.array([0.43, 0.9, 1.4, 0.05])


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
    return signals.regressor[part], signals.effort[part]


def test_a_noise_free_drive_is_recovered() -> None:
    found = least_squares.fit(condition(*drive(np.zeros(8742), 0.4)))
    np.testing.assert_allclose(found.parameters, TRUTH, rtol=5e-3, atol=1e-4)


@pytest.mark.parametrize("correlation", [0.0, 0.9, 0.97])
def test_intervals_cover_the_truth_under_coloured_noise(correlation: float) -> None:
    rng = np.random.default_rng(17)
    covered = []
    for _ in range(80):
        white = rng.normal(size=10742)
        noise = scipy.signal.lfilter([1], [1, -correlation], white)[2000:]
        noise *= 0.1 / np.std(noise)
        found = least_squares.fit(condition(*drive(noise, rng.uniform(0, 6))))
        covered.append(np.abs(found.parameters - TRUTH) < 1.96 * found.std)
    # 95 % wanted; 80 draws of four parameters resolve about 2.5 points
    assert 0.88 < np.mean(covered) < 0.99


def test_plain_standard_errors_would_not_do() -> None:
    """The reason for the robust covariance: independent residuals are assumed too small."""
    rng = np.random.default_rng(3)
    noise = 0.01 * scipy.signal.lfilter([1], [1, -0.995], rng.normal(size=8742))
    regressor, effort = solve(condition(*drive(noise)))
    found = least_squares.solve(regressor, effort)
    residual = effort - regressor @ found.parameters
    plain = np.sqrt(np.diag(np.linalg.inv(regressor.T @ regressor)) * np.mean(residual**2))
    assert np.all(found.std > 1.15 * plain)


def test_the_slow_sinusoid_is_well_conditioned() -> None:
    regressor, _ = solve(condition(*drive(np.zeros(8742))))
    assert least_squares.condition_number(regressor) == pytest.approx(4.5, abs=0.3)  # paper.md


def test_emps_figures(measured_data: Path) -> None:
    """Published values of the EMPS benchmark (Janot, Gautier, Brunot 2019)."""
    axis = load_recording(measured_data / "emps_train.csv").axes["q"]
    time = load_recording(measured_data / "emps_train.csv").time_s
    regressor, effort = solve(condition(time, axis.position, axis.effort))
    found = least_squares.solve(regressor, effort)
    np.testing.assert_allclose(found.parameters, [95.1089, 203.5034, 20.3935, -3.1648], rtol=0.01)
    residual = effort - regressor @ found.parameters
    assert np.linalg.norm(residual) / np.linalg.norm(effort) == pytest.approx(0.0408, abs=0.002)
