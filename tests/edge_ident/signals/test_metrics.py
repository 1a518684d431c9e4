"""Measures of signals against numpy's own."""

import numpy as np
import pytest

from edge_ident.signals.metrics import quantile


@pytest.mark.parametrize("share", [0.0, 0.25, 0.5, 0.99, 1.0])
@pytest.mark.parametrize("size", [1, 2, 7, 100])
def test_a_quantile_is_numpys(size: int, share: float) -> None:
    values = np.random.default_rng(size).normal(size=size)
    before = values.copy()
    assert quantile(values, share) == pytest.approx(np.quantile(values, share), rel=1e-12)
    np.testing.assert_array_equal(values, before)
