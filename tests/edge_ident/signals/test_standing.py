"""Standstills and what is near them, against windows that are looked at one by one."""

import numpy as np
import pytest

from edge_ident.signals.conditioning import at_rest, bridge, widened


@pytest.mark.parametrize("by", [1, 4, 31, 300])
def test_a_mask_is_widened_to_both_sides(by: int) -> None:
    mask = np.random.default_rng(by).random(200) < 0.01
    marked = np.flatnonzero(mask)
    expected = [np.any(np.abs(marked - sample) <= by) for sample in range(len(mask))]
    np.testing.assert_array_equal(widened(mask, by), expected)


@pytest.mark.parametrize(("width", "margin"), [(1, 0), (7, 0), (8, 5), (25, 12)])
def test_a_rest_is_a_window_in_which_the_position_hardly_changes(width: int, margin: int) -> None:
    rng = np.random.default_rng(width)
    position = np.cumsum(rng.integers(0, 2, 300) * (np.arange(300) % 60 < 30))
    expected = np.zeros(300, dtype=bool)
    for begin in range(300 - width + 1):
        if np.ptp(position[begin : begin + width]) <= 0.5:
            expected[max(0, begin - margin) : begin + width + margin] = True
    assert 0 < np.count_nonzero(expected) < 300 or width == 1
    np.testing.assert_array_equal(at_rest(position, 0.5, width, margin), expected)


def test_straight_lines_lead_over_a_rest() -> None:
    moving = np.array([True, True, False, False, True, False])
    signals = np.array([[0.0, 1.0, 9.0, 9.0, 4.0, 9.0], [0.0, 2.0, 9.0, 9.0, 8.0, 9.0]])
    bridged = bridge(signals, moving)
    np.testing.assert_allclose(bridged, [[0, 1, 2, 3, 4, 4], [0, 2, 4, 6, 8, 8]])
