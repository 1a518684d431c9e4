"""Bandwidth, even grid, standstills: what becomes of measured samples before estimation."""

from typing import Final

import numpy as np
import pytest

from edge_ident.signals import conditioning
from edge_ident.signals.conditioning import at_rest, bridge, encoder_count, position_noise, widened
from edge_ident.signals.filters import differentiate
from edge_ident.signals.made_columns import unwrapped
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


# Standstills and what is near them, against windows that are looked at one by one.


@pytest.mark.parametrize("by", [1, 4, 31, 300])
def test_a_mask_is_widened_to_both_sides(by: int) -> None:
    mask = np.random.default_rng(by).random(200) < 0.01
    marked = np.flatnonzero(mask)
    expected = [np.any(np.abs(marked - sample) <= by) for sample in range(len(mask))]
    np.testing.assert_array_equal(widened(mask, by), expected)


@pytest.mark.parametrize(("width", "margin"), [(1, 0), (7, 0), (8, 5), (25, 12)])
def test_a_rest_is_a_window_in_which_the_position_hardly_changes(width: int, margin: int) -> None:
    rng = np.random.default_rng(width)
    position = np.cumsum(rng.integers(0, 2, 300) * (np.arange(300) % 60 < 30))
    expected = np.zeros(300, dtype=bool)
    for begin in range(300 - width + 1):
        if np.ptp(position[begin : begin + width]) <= 0.5:
            expected[max(0, begin - margin) : begin + width + margin] = True
    assert 0 < np.count_nonzero(expected) < 300 or width == 1
    np.testing.assert_array_equal(at_rest(position, 0.5, width, margin), expected)


def test_straight_lines_lead_over_a_rest() -> None:
    moving = np.array([True, True, False, False, True, False])
    signals = np.array([[0.0, 1.0, 9.0, 9.0, 4.0, 9.0], [0.0, 2.0, 9.0, 9.0, 8.0, 9.0]])
    bridged = bridge(signals, moving)
    np.testing.assert_allclose(bridged, [[0, 1, 2, 3, 4, 4], [0, 2, 4, 6, 8, 8]])


# Noise of a position, told from its motion; a position that starts again.


def sampled(rate_hz: float, noise: float, sampling_hz: float = 50.0) -> np.ndarray:
    """A sinusoid of 0.1 rad with white noise."""
    time_s = np.arange(3000) / sampling_hz
    white = np.random.default_rng(5).standard_normal(len(time_s))
    return 0.1 * np.sin(2.0 * np.pi * rate_hz * time_s) + noise * white


@pytest.mark.parametrize("rate_hz", [0.3, 1.5, 2.5])
def test_noise_is_no_part_of_a_fast_motion(rate_hz: float) -> None:
    assert position_noise(sampled(rate_hz, 3e-5)) == pytest.approx(3e-5, rel=0.1)


def test_noise_is_at_least_that_of_the_counts() -> None:
    count = 1e-3
    position = count * np.round(sampled(0.3, 0.0) / count)
    assert encoder_count(position) == pytest.approx(count)
    assert position_noise(position) == pytest.approx(count / np.sqrt(12.0), rel=0.15)


TURNS: Final = 60.0 * sampled(0.2, 0.0)
"""Of 12 rad, rounded by whoever prints it."""


@pytest.mark.parametrize(
    ("turn", "unit", "count"),
    [
        (2.0 * np.pi, "rad", 1e-5),
        (4.0 * np.pi, "rad", 4.0 * np.pi / 65536),
        (256 * 2e-3, "rad", 2e-3),
        (0.3, "m", 1e-9),
    ],
)
def test_a_position_that_starts_again_goes_on(turn: float, unit: str, count: float) -> None:
    scale = turn / (2.0 * np.pi)
    position = count * np.round(scale * TURNS / count)
    whole, found, times = unwrapped((position + 0.3 * turn) % turn, unit)
    assert times > 10
    assert found == pytest.approx(turn, rel=1e-4 if unit == "m" else 1e-12)
    np.testing.assert_allclose(whole - whole[0], position - position[0], atol=1e-3 * turn)


def test_lost_counts_and_a_spike_are_no_turn() -> None:
    lost, spike = TURNS + 9.0 * (np.arange(3000) > 1500), TURNS.copy()
    spike[1234] += 40.0
    for position in (TURNS, lost, spike, np.zeros(0)):
        assert unwrapped(position, "rad")[0] is position
