"""Friction that falls while the machine warms, and friction that grows."""

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


@pytest.mark.parametrize(("excess", "named"), [(0.6, ["warm_up"]), (-0.6, [])])
def test_only_friction_that_falls_is_warm_up(excess: float, named: list[str]) -> None:
    t, x, v, a = swing(seconds=30.0, period_s=COARSE_S)
    fading = excess * np.exp(-t / 6.0) * np.sign(v)
    axis = diagnosed(recorded(t, x, rigid(v, a) + fading, noise=0.03))
    assert [cause.term.effect for cause in axis.causes] == named
    assert axis.verdict is (Verdict.EXPLAINED if named else Verdict.UNEXPLAINED)
