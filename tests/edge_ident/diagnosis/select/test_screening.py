"""What a candidate needs before any model is fitted with it."""

import numpy as np
import pytest

from edge_ident.diagnosis.select.search import reliable


@pytest.mark.parametrize(("noise", "passes"), [(0.3, True), (0.45, True), (0.55, False)])
def test_a_candidate_is_mostly_motion(noise: float, passes: bool) -> None:
    """Beside a constant; the replica has as much noise once more, and the rest is motion."""
    motion, first, second = np.random.default_rng(3).standard_normal((3, 1, 4000))
    regressor = np.sqrt(1.0 - noise) * motion + np.sqrt(noise) * first
    replica, constant = regressor + np.sqrt(noise) * second, np.ones((4000, 1))
    assert reliable(regressor + 5.0, replica + 5.0, constant, constant) is passes
