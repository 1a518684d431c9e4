"""The shift between effort and position, on signals whose shift is known."""

import numpy as np
import pytest
from numpy.typing import NDArray

from edge_ident.model.model import PARAMETERS
from edge_ident.model.motion import LARGEST_SHIFT
from edge_ident.signals.conditioning import condition
from edge_ident.signals.timing import Shift, slow, smallest_at, solve_shift

_PERIOD_S = 0.002
_EVEN = LARGEST_SHIFT / np.sqrt(3.0)
"""Standard deviation, in samples, of an even distribution between the limits."""


def shift_of(late_samples: float, *, rates_hz: tuple[float, ...], noise: float = 0.02) -> Shift:
    """Estimated in samples, for a motion of sinusoids that never reverses."""
    rng = np.random.default_rng(7)
    time_s = _PERIOD_S * np.arange(8000)
    position, _, _ = motion(time_s, rates_hz)
    _, velocity, acceleration = motion(time_s - late_samples * _PERIOD_S, rates_hz)
    effort = 0.5 * acceleration + 1.5 * velocity + 0.4
    effort = effort + noise * np.std(effort) * rng.standard_normal(len(effort))
    position = position + 1e-6 * rng.standard_normal(len(position))
    signals = condition(time_s, position, effort)
    part = slice(200, 7800)
    rate = np.gradient(signals.regressor, _PERIOD_S, axis=0)
    rate[:, PARAMETERS.index("coulomb_friction")] = 0.0  # of a reversal, no signal
    instrument = -np.gradient(slow(signals.effort, signals.cutoff_hz, _PERIOD_S), _PERIOD_S)
    found = solve_shift(
        signals.regressor[part], rate[part], signals.effort[part], instrument[part], _PERIOD_S
    )
    return Shift(*(value / _PERIOD_S for value in vars(found).values()))


def motion(
    time_s: NDArray[np.float64], rates_hz: tuple[float, ...]
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Position, velocity and acceleration, (N,) each."""
    position, velocity, acceleration = 10.0 * time_s, 10.0 + 0.0 * time_s, 0.0 * time_s
    for k, rate_hz in enumerate(rates_hz):
        w = 2.0 * np.pi * rate_hz
        position = position + np.sin(w * time_s + k) / w
        velocity = velocity + np.cos(w * time_s + k)
        acceleration = acceleration - w * np.sin(w * time_s + k)
    return position, velocity, acceleration


@pytest.mark.parametrize("late", [-1.2, -0.5, 0.0, 0.7])
def test_a_shift_below_the_limit_is_found_with_its_deviation(late: float) -> None:
    found = shift_of(late, rates_hz=(0.7, 1.9, 3.1))
    assert found.shift_s == pytest.approx(late, abs=4.0 * found.std_s)
    assert found.std_s < 0.1


@pytest.mark.parametrize("late", [-5.0, 5.0])
def test_a_longer_delay_ends_at_the_limit_and_shows_beyond_it(late: float) -> None:
    found = shift_of(late, rates_hz=(0.7, 1.9, 3.1))
    assert found.shift_s == pytest.approx(np.sign(late) * LARGEST_SHIFT)
    assert found.unlimited_s == pytest.approx(late, rel=0.05)


def test_one_sinusoid_shows_no_shift_and_says_so() -> None:
    """Beside friction and inertia, the rate of a single sinusoid's effort is nothing new."""
    found = shift_of(0.7, rates_hz=(1.0,), noise=0.001)
    assert abs(found.shift_s) < 0.1
    assert found.std_s > 0.9 * _EVEN


def test_deviations_cover_the_errors_under_noise() -> None:
    found = shift_of(0.7, rates_hz=(0.7, 1.9, 3.1), noise=0.5)
    quiet = shift_of(0.7, rates_hz=(0.7, 1.9, 3.1), noise=0.05)
    assert abs(found.shift_s - 0.7) < 3.0 * found.std_s
    assert found.std_s > 5.0 * quiet.std_s


@pytest.mark.parametrize("late", [-1.4, -0.3, 0.0, 1.2])
def test_of_three_shifts_the_parabola_tells_where_a_model_leaves_least(late: float) -> None:
    limits = LARGEST_SHIFT * np.array([-1.0, 0.0, 1.0])
    left = (0.7 + 3.0 * (limits - late) ** 2).tolist()
    assert smallest_at(left, _PERIOD_S) == pytest.approx(late * _PERIOD_S)


def test_beyond_the_limits_a_model_leaves_least_at_the_limit() -> None:
    limit_s = LARGEST_SHIFT * _PERIOD_S
    assert smallest_at([9.0, 4.0, 1.0], _PERIOD_S) == pytest.approx(limit_s)
    assert smallest_at([1.0, 4.0, 3.0], _PERIOD_S) == pytest.approx(-limit_s)
