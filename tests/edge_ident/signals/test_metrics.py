"""Measures of signals against numpy's own."""

import numpy as np
import pytest
import scipy.fft
from hypothesis import given, settings
from hypothesis import strategies as st

from edge_ident.signals import metrics
from edge_ident.signals.metrics import quantile


@pytest.mark.parametrize("share", [0.0, 0.25, 0.5, 0.99, 1.0])
@pytest.mark.parametrize("size", [1, 2, 7, 100])
def test_a_quantile_is_numpys(size: int, share: float) -> None:
    values = np.random.default_rng(size).normal(size=size)
    before = values.copy()
    assert quantile(values, share) == pytest.approx(np.quantile(values, share), rel=1e-12)
    np.testing.assert_array_equal(values, before)


# DCT-II and subsampling against scipy and against band-limited signals.


@given(st.integers(2, 400), st.integers(0, 2**32 - 1))
@settings(max_examples=60, deadline=None)
def test_dct_agrees_with_scipy_and_inverts(samples: int, seed: int) -> None:
    data = np.random.default_rng(seed).normal(size=(samples, 2))
    coefficients = metrics.dct2(data)
    np.testing.assert_allclose(coefficients, scipy.fft.dct(data, norm="ortho", axis=0), atol=1e-12)
    np.testing.assert_allclose(metrics.idct2(coefficients), data, atol=1e-12)


@pytest.mark.parametrize("samples", [9, 10])
def test_the_first_coefficients_are_those_of_all(samples: int) -> None:
    data = np.random.default_rng(samples).normal(size=(samples, 2))
    for count in range(1, samples + 1):
        np.testing.assert_allclose(
            metrics.dct2(data, count), metrics.dct2(data)[:count], atol=1e-14
        )


def test_subsampling_keeps_a_band_limited_signal() -> None:
    n = np.arange(8742)
    fine = 0.4 + np.cos(np.pi * 7 * (n + 0.5) / 8742)
    coarse = 0.4 + np.cos(np.pi * 7 * (np.arange(100) + 0.5) / 100)
    np.testing.assert_allclose(metrics.subsample(fine), coarse, atol=1e-12)


@pytest.mark.parametrize("points", [10, 100, 333])
def test_subsampling_to_any_length_keeps_the_mean_square(points: int) -> None:
    slow = np.sin(2 * np.pi * np.arange(8742) / 8742 + 0.3)
    subsampled = metrics.subsample(slow, points)
    assert subsampled.shape == (points,)
    assert np.mean(subsampled**2) == pytest.approx(np.mean(slow**2), rel=2e-3)


def test_subsampling_refuses_to_invent_samples() -> None:
    with pytest.raises(ValueError, match="cannot subsample 50 samples to 100"):
        metrics.subsample(np.zeros(50))
