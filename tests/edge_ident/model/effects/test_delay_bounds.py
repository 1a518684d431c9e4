"""Which delays the search takes for physical."""

from dataclasses import replace

import numpy as np
import pytest

from edge_ident.diagnosis.prepare.preparation import prepare_axis
from edge_ident.model.effects.time_delay import EFFECT as DELAY
from tests.edge_ident.diagnosis.select.test_search_parts import PERIOD_S, recorded, rigid, swing


@pytest.mark.parametrize("faster", [1.0, 5.0])
def test_a_delay_is_as_long_as_half_a_turn_of_the_motion(faster: float) -> None:
    """However wide the band is in which the effort is compared."""
    t, x, v, a = swing()
    data = prepare_axis([recorded(t, x, rigid(v, a), noise=0.02)], "x")
    seen = data.excitation(np.array([0.5, 0.8, 1.1, 0.2]))
    seen = replace(seen, acceleration=faster * seen.acceleration)
    half_s = np.pi * seen.typical_speed / seen.acceleration
    for delay_s, physical in (
        (1.2 * PERIOD_S, False),
        (2.0 * PERIOD_S, True),
        (-0.9 * half_s, True),
        (1.1 * half_s, False),
    ):
        assert DELAY.search.physical({"delay": np.array(delay_s)}, seen) is physical
