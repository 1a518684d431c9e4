"""Shares of values, as numpy computes them, without what numpy loads for it."""

import numpy as np
import pytest

from edge_ident.report.page.scale import quantile


@pytest.mark.parametrize("samples", [1, 2, 7, 100])
@pytest.mark.parametrize("share", [0.0, 0.005, 0.5, 0.995, 1.0])
def test_a_share_of_the_values_lies_below(samples: int, share: float) -> None:
    values = np.random.default_rng(samples).normal(size=samples)
    assert quantile(values, share) == pytest.approx(np.quantile(values, share), abs=1e-12)
