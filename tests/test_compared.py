"""How much of a fault the benchmark counts as compared."""

import numpy as np
import pytest

from edge_ident.diagnosis.prepare.preparation import prepare_axis
from tests.edge_ident.diagnosis.select.test_search_parts import recorded, rigid, swing
from tools.diagnosis_benchmark.compared import compared_shares


def test_what_the_base_model_expresses_or_the_filter_stops_does_not_count() -> None:
    """Of a wave in the band all counts, but for turning points; of one above it nothing does."""
    t, x, v, a = swing()
    record = recorded(t, x, rigid(v, a), noise=0.02)
    cutoff_hz = prepare_axis([record], "x").segments[0].cutoff_hz
    below, above = (np.sin(2 * np.pi * hz * t) for hz in (2.7, 3.0 * cutoff_hz))
    shares = compared_shares(record, "x", np.stack([below, above, 0.3 * v - 0.1, 0.2 * a]))
    effort = np.sqrt(np.mean(rigid(v, a) ** 2))
    assert shares[0] * effort == pytest.approx(np.sqrt(0.5), rel=0.1)
    assert max(shares[1:]) < 0.01 * shares[0]
