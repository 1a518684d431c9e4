"""Bandwidth, even grid, standstills: what becomes of measured samples before estimation."""

import numpy as np
import pytest

from edge_ident.signals import conditioning
from edge_ident.signals.filters import differentiate
from edge_ident.signals.time_stamps import EvenGrid

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


@pytest.mark.parametrize("phase", [0.0, np.pi / 2, 2.5])
def test_encoder_noise_stays_small_in_the_acceleration_ends_included(phase: float) -> None:
    position, _, acceleration = sine(phase)
    quantized = COUNT_RAD * np.round(position / COUNT_RAD)
    cutoff = conditioning.choose_cutoff(quantized, PERIOD_S)
    _, _, a = differentiate(quantized, cutoff, PERIOD_S)
    rms = np.std(acceleration)
    assert np.std(a - acceleration) < 0.08 * rms
    assert np.max(np.abs(a - acceleration)) < 0.5 * rms


def test_cutoff_follows_resolution_and_sampling() -> None:
    position = sine(0.0)[0]
    coarse = conditioning.choose_cutoff(COUNT_RAD * np.round(position / COUNT_RAD), PERIOD_S)
    count = COUNT_RAD / 8
    fine = conditioning.choose_cutoff(count * np.round(position / count), PERIOD_S)
    assert fine == pytest.approx(8**0.4 * coarse, rel=0.1)  # noise grows with cut-off to the 2.5
    assert conditioning.choose_cutoff(position, PERIOD_S) == pytest.approx(1 / (20 * PERIOD_S))


def test_uneven_sampling_is_interpolated() -> None:
    rng = np.random.default_rng(5)
    time = PERIOD_S * (np.arange(8742) + rng.uniform(-0.4, 0.4, 8742))
    position = 2 * np.pi * np.sin(0.2875 * time)
    velocity = 2 * np.pi * 0.2875 * np.cos(0.2875 * time)
    effort = 0.9 * velocity
    even = conditioning.condition(time, position, effort)
    assert even.grid.uneven
    assert 0.35 < even.grid.jitter < 0.45
    expected = 2 * np.pi * 0.2875 * np.cos(0.2875 * (time[0] + even.period_s * np.arange(8742)))
    np.testing.assert_allclose(even.regressor[:, 1], expected, atol=2e-3)
    np.testing.assert_allclose(even.effort[100:-100], 0.9 * expected[100:-100], atol=2e-3)


def test_friction_column_is_filtered_like_the_effort() -> None:
    position, velocity, _ = sine(0.0)
    smooth = conditioning.condition(PERIOD_S * np.arange(8742), position, 1.4 * np.sign(velocity))
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
    moving = ~conditioning.standing(stuck, conditioning.position_noise(stuck), 3.0, PERIOD_S)
    assert not moving[where].any()
    margin = int(1.5 / 3.0 / PERIOD_S) + 60
    assert moving[: where[0] - margin].all()
    assert moving[where[-1] + margin :].all()
    counted = COUNT_RAD * np.round(free / COUNT_RAD)
    noise = conditioning.position_noise(counted)
    assert not conditioning.standing(counted, noise, 3.0, PERIOD_S).any()


def test_bridging_keeps_effort_and_regressor_in_proportion() -> None:
    stuck, where, _ = stick_slip()
    time = PERIOD_S * np.arange(len(stuck))
    effort = 1.4 * np.sign(np.gradient(stuck)) + 0.9 * np.gradient(stuck, PERIOD_S)
    effort[where] = np.linspace(1.4, -1.4, len(where))  # what a stuck axis holds is no friction law
    smooth = conditioning.condition(time, stuck, effort)
    model = smooth.regressor @ np.array([0.0, 0.9, 1.4, 0.0])
    gap = where[0] - 200, where[-1] + 200
    error = np.abs(smooth.effort - model)[gap[0] : gap[1]]
    assert np.max(error) < 0.06


def test_a_motion_without_acceleration_still_has_a_cutoff() -> None:
    time = PERIOD_S * np.arange(8742)
    smooth = conditioning.condition(time, COUNT_RAD * np.round(time / COUNT_RAD), np.ones(8742))
    assert smooth.cutoff_hz == pytest.approx(10.0 / (PERIOD_S * 8742))
    np.testing.assert_allclose(smooth.regressor[500:-500, 1], 1.0, atol=1e-3)


def test_stamps_on_an_even_grid_leave_the_samples_as_they_were_read() -> None:
    position, _, _ = sine(0.0)
    time = 1e3 + PERIOD_S * np.arange(len(position))
    np.testing.assert_array_equal(EvenGrid.of(time).resampled(position), position)


def test_stamps_slightly_off_the_grid_are_corrected_for() -> None:
    jitter = np.random.default_rng(6).uniform(-0.04, 0.04, 8742)
    time = PERIOD_S * (np.arange(8742) + jitter)
    grid = EvenGrid.of(time)
    assert not grid.uneven
    wrong, found = (x - np.sin(grid.time_s) for x in (np.sin(time), grid.resampled(np.sin(time))))
    assert np.max(np.abs(found)) < 1e-3 * np.max(np.abs(wrong))


def test_the_slowest_step_of_a_motion_that_never_returns_is_no_count() -> None:
    time = 0.002 * np.arange(3000)
    turning = 6.0 * time + 0.02 * np.sin(9.0 * time)
    assert conditioning.encoder_count(turning) == 0.0
    assert conditioning.encoder_count(1e-3 * np.round(turning / 1e-3)) == pytest.approx(0.0, abs=0)
    coarse = 0.02 * np.round(turning / 0.02)
    assert conditioning.encoder_count(coarse) == pytest.approx(0.02)


@pytest.mark.parametrize("width", [1, 2, 7, 16, 400])
def test_an_axis_stands_where_the_range_of_a_window_is_small(width: int) -> None:
    """As by the plain formula, for every width of the window."""
    position = np.cumsum(np.random.default_rng(width).integers(-1, 2, 900)).astype(np.float64)
    windows = np.lib.stride_tricks.sliding_window_view(position, width)
    still = np.flatnonzero(np.ptp(windows, axis=1) <= 8.0)
    margin = int(np.ceil(1.5 * width))
    wanted = np.zeros(len(position), dtype=np.bool_)
    for first in still:
        wanted[max(0, first - margin) : first + width + margin] = True
    found = conditioning.standing(position, 1.0, 1.0 / (width * PERIOD_S), PERIOD_S)
    np.testing.assert_array_equal(found, wanted)
