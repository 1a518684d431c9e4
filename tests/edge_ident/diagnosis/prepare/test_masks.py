"""From when on a recording counts."""

import numpy as np
import pytest
from numpy.typing import NDArray

from edge_ident.diagnosis.prepare.bandwidth import run_in

Array = NDArray[np.float64]

POSITION = np.cos(np.linspace(-0.4, 12.0, 2000))
"""An axis that begins shortly before a reversal."""


def gap_follows(position: Array, gap: float, at_first: float) -> Array:
    """What a gap passes on: a load that starts somewhere inside it, and is pushed from there."""
    load = np.empty_like(position)
    here = position[0] + at_first * gap
    for k, motor in enumerate(position):
        here = min(max(here, motor - 0.5 * gap), motor + 0.5 * gap)
        load[k] = here
    return load


@pytest.mark.parametrize("mirrored", [1.0, -1.0])
def test_a_gap_has_forgotten_where_it_began(mirrored: float) -> None:
    position = mirrored * POSITION
    first = run_in(position)
    gap = 0.1 * np.ptp(position)
    low, high = (gap_follows(position, gap, at_first) for at_first in (-0.5, 0.5))
    assert np.flatnonzero(low != high)[-1] in (first - 1, first)


def test_a_reversal_just_after_the_start_costs_no_more_than_its_own_way() -> None:
    """The axis need not get far from its start for that."""
    first = run_in(POSITION)
    assert abs(POSITION[first] - POSITION[0]) < 0.1 * np.ptp(POSITION)
