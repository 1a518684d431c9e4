"""What a recording is refused for, and what looks like it."""

import numpy as np
import pytest

from edge_ident.errors import DataError
from edge_ident.signals.data_checks import check_motions
from edge_ident.signals.recording import AxisRecord, Recording

TIME_S = 2e-3 * np.arange(4000)
SWING = 0.5 * np.cos(2.0 * np.pi * 0.5 * TIME_S)


def motion(first: int, last: int, value: float) -> Recording:
    """A motor under a smooth effort and a weight, of which some samples have another value."""
    effort = 3.0 + SWING + 0.01 * np.random.default_rng(1).standard_normal(len(SWING))
    effort[first:last] = value
    position = 1e-3 * np.round(1e3 * np.cumsum(np.cumsum(SWING)) * 4e-4)
    return Recording(TIME_S, {"x": AxisRecord(position, effort, "rad", "A")}, "by hand")


@pytest.mark.parametrize(("first", "last"), [(0, 1), (0, 2), (3999, 4000), (3998, 4000)])
def test_a_drive_that_is_switched_on_or_off_is_no_spike(first: int, last: int) -> None:
    check_motions(motion(first, last, 0.0))


@pytest.mark.parametrize("count", [1, 2, 3])
def test_an_effort_that_rises_steeply_at_the_end_is_no_spike(count: int) -> None:
    cut = motion(0, 0, 0.0)
    cut.axes["x"].effort[-count:] += 4.0 * np.array([1.0, 2.5, 4.5])[:count]
    check_motions(cut)


@pytest.mark.parametrize("row", [1, 2000, 3998])
def test_a_spike_is_one_anywhere(row: int) -> None:
    with pytest.raises(DataError, match=f"row {row}: a spike"):
        check_motions(motion(row, row + 1, 40.0))


def test_many_spikes_are_no_usual_effort() -> None:
    """Where one sample of 150 was another value, that was what is usual, and a motor was said to
    saturate."""
    hit = motion(0, 0, 0.0)
    hit.axes["x"].effort[75::150] += 5.0
    with pytest.raises(DataError, match="27 in all"):
        check_motions(hit)
