"""Noise of a position, told from its motion."""

import numpy as np
import pytest

from edge_ident.signals.conditioning import encoder_count, position_noise


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
