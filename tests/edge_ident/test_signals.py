"""Filtering, differentiation and subsampling against scipy and against analytic motions."""

import numpy as np
import pytest
import scipy.fft
import scipy.signal
from hypothesis import given, settings
from hypothesis import strategies as st

from edge_ident import signals

PERIOD_S = 0.0025
COUNT_RAD = 2 * np.pi / 8400


def sine(phase: float, samples: int = 8742) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Position, velocity and acceleration of the paper's motion."""
    angle = 0.2875 * PERIOD_S * np.arange(samples) + phase
    amplitude = 2 * np.pi
    return (
        amplitude * np.sin(angle),
        amplitude * 0.2875 * np.cos(angle),
        -amplitude * 0.2875**2 * np.sin(angle),
    )


@given(st.integers(2, 400), st.integers(0, 2**32 - 1))
@settings(max_examples=60, deadline=None)
def test_dct_agrees_with_scipy_and_inverts(samples: int, seed: int) -> None:
    data = np.random.default_rng(seed).normal(size=(samples, 2))
    coefficients = signals.dct2(data)
    np.testing.assert_allclose(coefficients, scipy.fft.dct(data, norm="ortho", axis=0), atol=1e-12)
    np.testing.assert_allclose(signals.idct2(coefficients), data, atol=1e-12)


def test_subsampling_keeps_a_band_limited_signal() -> None:
    n = np.arange(8742)
    fine = 0.4 + np.cos(np.pi * 7 * (n + 0.5) / 8742)
    coarse = 0.4 + np.cos(np.pi * 7 * (np.arange(100) + 0.5) / 100)
    np.testing.assert_allclose(signals.subsample(fine), coarse, atol=1e-12)


@pytest.mark.parametrize("points", [10, 100, 333])
def test_subsampling_to_any_length_keeps_the_mean_square(points: int) -> None:
    slow = sine(0.3)[0]
    subsampled = signals.subsample(slow, points)
    assert subsampled.shape == (points,)
    assert np.mean(subsampled**2) == pytest.approx(np.mean(slow**2), rel=2e-3)


def test_subsampling_refuses_to_invent_samples() -> None:
    with pytest.raises(ValueError, match="cannot subsample 50 samples to 100"):
        signals.subsample(np.zeros(50))


@pytest.mark.parametrize("phase", [0.0, np.pi / 2, 1.0, 4.0])
def test_derivatives_are_exact_up_to_the_ends(phase: float) -> None:
    position, velocity, acceleration = sine(phase)
    _, v, a = signals.differentiate(position, 20.0, PERIOD_S)
    np.testing.assert_allclose(v, velocity, atol=1e-6 * 1.8)
    np.testing.assert_allclose(a, acceleration, atol=1e-4 * 0.52)


@pytest.mark.parametrize("phase", [0.0, np.pi / 2, 2.5])
def test_encoder_noise_stays_small_in_the_acceleration_ends_included(phase: float) -> None:
    position, _, acceleration = sine(phase)
    quantized = COUNT_RAD * np.round(position / COUNT_RAD)
    cutoff = signals.choose_cutoff(quantized, PERIOD_S)
    _, _, a = signals.differentiate(quantized, cutoff, PERIOD_S)
    rms = np.std(acceleration)
    assert np.std(a - acceleration) < 0.08 * rms
    assert np.max(np.abs(a - acceleration)) < 0.5 * rms


def test_cutoff_follows_resolution_and_sampling() -> None:
    position = sine(0.0)[0]
    coarse = signals.choose_cutoff(COUNT_RAD * np.round(position / COUNT_RAD), PERIOD_S)
    count = COUNT_RAD / 8
    fine = signals.choose_cutoff(count * np.round(position / count), PERIOD_S)
    assert fine == pytest.approx(8**0.4 * coarse, rel=0.1)  # noise grows with cut-off to the 2.5
    assert signals.choose_cutoff(position, PERIOD_S) == pytest.approx(1 / (20 * PERIOD_S))


def test_lowpass_is_a_butterworth_run_both_ways() -> None:
    rng = np.random.default_rng(3)
    noise = rng.normal(size=4000)
    section = scipy.signal.butter(4, 5.0, fs=1 / PERIOD_S, output="sos")
    expected = scipy.signal.sosfiltfilt(section, noise)
    filtered = signals.lowpass(noise, 5.0, PERIOD_S)
    middle = slice(400, -400)
    assert np.max(np.abs(filtered - expected)[middle]) < 0.01 * np.max(np.abs(expected))


def test_lowpass_moves_a_signal_by_a_fraction_of_a_sample() -> None:
    time = PERIOD_S * np.arange(6000)
    moved = signals.lowpass(np.sin(3 * time), 20.0, PERIOD_S, delay_s=0.0017)
    np.testing.assert_allclose(moved[500:-500], np.sin(3 * (time - 0.0017))[500:-500], atol=1e-6)


def test_uneven_sampling_is_interpolated() -> None:
    rng = np.random.default_rng(5)
    time = PERIOD_S * (np.arange(8742) + rng.uniform(-0.4, 0.4, 8742))
    position = 2 * np.pi * np.sin(0.2875 * time)
    velocity = 2 * np.pi * 0.2875 * np.cos(0.2875 * time)
    effort = 0.9 * velocity
    even = signals.condition(time, position, effort)
    assert even.interpolated
    assert 0.35 < even.jitter < 0.45
    expected = 2 * np.pi * 0.2875 * np.cos(0.2875 * (time[0] + even.period_s * np.arange(8742)))
    np.testing.assert_allclose(even.regressor[:, 1], expected, atol=2e-3)
    np.testing.assert_allclose(even.effort[100:-100], 0.9 * expected[100:-100], atol=2e-3)


def test_friction_column_is_filtered_like_the_effort() -> None:
    position, velocity, _ = sine(0.0)
    smooth = signals.condition(PERIOD_S * np.arange(8742), position, 1.4 * np.sign(velocity))
    np.testing.assert_allclose(1.4 * smooth.regressor[:, 2], smooth.effort, atol=1e-9)


def stick_slip() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """A sine that stands for 0.8 s at one reversal, as friction makes it, and then runs on."""
    position, _, _ = sine(0.0)
    reversal, held = 2186, 320
    stuck = np.concatenate([position[:reversal], np.full(held, position[reversal - 1])])
    stuck = np.concatenate([stuck, position[reversal:-held]])
    return COUNT_RAD * np.round(stuck / COUNT_RAD), np.arange(reversal, reversal + held), position


def test_a_standstill_is_found_and_a_quick_reversal_is_not() -> None:
    stuck, where, free = stick_slip()
    moving = ~signals.standing(stuck, 3.0, PERIOD_S)
    assert not moving[where].any()
    margin = int(1.5 / 3.0 / PERIOD_S) + 60
    assert moving[: where[0] - margin].all()
    assert moving[where[-1] + margin :].all()
    assert not signals.standing(COUNT_RAD * np.round(free / COUNT_RAD), 3.0, PERIOD_S).any()


def test_bridging_keeps_effort_and_regressor_in_proportion() -> None:
    stuck, where, _ = stick_slip()
    time = PERIOD_S * np.arange(len(stuck))
    effort = 1.4 * np.sign(np.gradient(stuck)) + 0.9 * np.gradient(stuck, PERIOD_S)
    effort[where] = np.linspace(1.4, -1.4, len(where))  # what a stuck axis holds is no friction law
    smooth = signals.condition(time, stuck, effort)
    model = smooth.regressor @ np.array([0.0, 0.9, 1.4, 0.0])
    gap = where[0] - 200, where[-1] + 200
    error = np.abs(smooth.effort - model)[gap[0] : gap[1]]
    assert np.max(error) < 0.06
