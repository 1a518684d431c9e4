"""Friction over speed: the two curves that are in use for the Stribeck effect are told apart."""

import numpy as np
import pytest

from edge_ident.diagnosis.measures import Verdict
from tests.edge_ident.diagnosis.select.test_search_parts import (
    COARSE_S,
    diagnosed,
    recorded,
    rigid,
    swing,
)


@pytest.mark.parametrize("exponent", [1.0, 2.0])
def test_the_curve_of_the_stribeck_effect_is_found_with_the_rest_of_the_friction(
    exponent: float,
) -> None:
    t, x, v, a = swing(seconds=25.0, period_s=COARSE_S)
    bump = 0.6 * np.exp(-((np.abs(v) / 0.4) ** exponent)) * np.sign(v)
    axis = diagnosed(recorded(t, x, rigid(v, a) + bump, noise=0.02))
    assert axis.verdict is Verdict.EXPLAINED
    (cause,) = axis.causes
    assert cause.term.effect == "stribeck_friction"
    assert cause.term.values["exponent"] == exponent
    assert cause.term.values["level"] == pytest.approx(0.6, rel=0.05)
    assert cause.term.values["speed"] == pytest.approx(0.4, rel=0.1)
    assert axis.extended.estimate.parameters == pytest.approx([0.5, 0.8, 1.1, 0.2], rel=0.03)
