"""Decimation: what a low rate can hold stays, what it cannot is gone, blocks leave no trace."""

import numpy as np
import pytest

from edge_ident.signals import filters
from edge_ident.signals.filters import differentiate, lowpass

STRIDE = 7


def tone(per_rate: float, samples: int = 200_000) -> np.ndarray:
    """A sinusoid whose frequency is given in rates after decimation."""
    return np.sin(2.0 * np.pi * per_rate / STRIDE * np.arange(samples) + 0.3)


@pytest.mark.parametrize("per_rate", [0.001, 0.1, 0.34])
def test_the_pass_band_is_kept_without_delay(per_rate: float) -> None:
    signal = tone(per_rate)
    kept, _ = filters.decimate(signal, signal, STRIDE)
    expected = signal[filters.kept(len(signal), STRIDE)]
    np.testing.assert_allclose(kept, expected, atol=3e-5)


@pytest.mark.parametrize("per_rate", [0.52, 0.9, 3.2])
def test_nothing_is_aliased(per_rate: float) -> None:
    kept, other = filters.decimate(tone(per_rate), tone(0.1), STRIDE)
    assert np.max(np.abs(kept)) < 3e-5
    assert np.max(np.abs(other)) > 0.9


def test_marks_are_kept_with_the_sample_before() -> None:
    mask = np.zeros(1000, dtype=bool)
    mask[filters.kept(len(mask), STRIDE).start + STRIDE + 2] = True
    found = filters.any_of(mask, STRIDE)
    assert np.flatnonzero(found).tolist() == [1]


def test_a_long_record_is_filtered_like_its_middle() -> None:
    """Blocks meet without a seam: truth is a motion whose derivatives are known."""
    time_s = 0.004 * np.arange(300_000)
    motion = np.sin(3.0 * time_s) + 0.1 * np.sin(17.0 * time_s)
    acceleration = -9.0 * np.sin(3.0 * time_s) - 28.9 * np.sin(17.0 * time_s)
    found = differentiate(motion, 50.0, 0.004)[2]
    inside = slice(300, -300)
    np.testing.assert_allclose(found[inside], acceleration[inside], atol=2e-3)
    np.testing.assert_allclose(lowpass(motion, 50.0, 0.004)[inside], motion[inside], atol=1e-6)
