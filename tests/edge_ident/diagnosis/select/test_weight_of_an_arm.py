"""The weight of an arm is found as such, also where it swings through a part of a turn."""

import numpy as np
import pytest

from edge_ident.model.effects.position_dependent_load import EFFECT as LOAD
from tests.edge_ident.diagnosis.select.test_search_parts import (
    COARSE_S,
    diagnosed,
    recorded,
    rigid,
    swing,
)

WEIGHT_NM = 6.0
FROM_HANGING_RAD = 0.7


@pytest.mark.parametrize("share", [0.3, 0.5, 2.0])
def test_the_period_of_a_weight_is_a_turn(share: float) -> None:
    """A wave of any period and a parabola describe a part of a turn as well, and nothing beyond.

    From a fifth of a turn on (0.3), the data tell.
    """
    t, x, v, a = swing(period_s=COARSE_S)
    x, v, a = (share * signal for signal in (x, v, a))
    weight = WEIGHT_NM * np.sin(x + FROM_HANGING_RAD)
    axis = diagnosed(recorded(t, x, rigid(v, a) + weight, noise=0.02))
    (cause,) = axis.causes
    values = cause.term.values
    assert cause.term.effect == LOAD.name
    assert values["period"] == pytest.approx(2.0 * np.pi, rel=0.01)
    found = np.array([values["cosine"], values["sine"]])
    true = WEIGHT_NM * np.array([np.sin(FROM_HANGING_RAD), np.cos(FROM_HANGING_RAD)])
    assert found == pytest.approx(true, abs=0.05 * WEIGHT_NM)


def test_a_wave_that_repeats_with_every_turn_of_many_is_a_ripple() -> None:
    t, x, v, a = swing(period_s=COARSE_S)
    x, v, a = (20.0 * signal for signal in (x, v, a))
    axis = diagnosed(recorded(t, x, rigid(v, a) + 3.0 * np.sin(x), noise=0.1))
    assert [cause.term.effect for cause in axis.causes] == ["torque_ripple"]
