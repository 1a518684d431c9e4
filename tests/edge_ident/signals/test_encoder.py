"""Noise of a position, told from its motion; a position that starts again."""

from typing import Final

import numpy as np
import pytest

from edge_ident.signals.conditioning import encoder_count, position_noise
from edge_ident.signals.made_columns import unwrapped


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
