"""Rows that are missing although the time stamps do not say so."""

import numpy as np
import pytest
from numpy.typing import NDArray

from edge_ident.signals.recording import AxisRecord, Recording
from edge_ident.signals.time_stamps import with_lost_rows

Array = NDArray[np.float64]

PERIOD_S, COUNT = 0.004, 1e-4
TIME_S = PERIOD_S * np.arange(4000)
SWING = np.sin(2.0 * TIME_S) + 0.2 * np.sin(7.0 * TIME_S)
FAST = (300, 301, 1200, 2750)
"""Rows at which the axis moves by a good many counts."""


def recording(*positions: Array) -> Recording:
    axes = {
        name: AxisRecord(COUNT * np.round(position / COUNT), np.cos(position), "rad", "N*m")
        for name, position in zip("xz", positions, strict=False)
    }
    return Recording(PERIOD_S * np.arange(len(positions[0])), axes, "by hand")


def test_the_time_of_lost_rows_is_put_in() -> None:
    kept = np.delete(np.arange(len(TIME_S)), FAST)
    found = with_lost_rows(recording(SWING[kept], 0.5 * SWING[kept]))
    assert found.lost_rows == len(FAST)
    assert found.time_s == pytest.approx(TIME_S[kept])


def test_a_position_without_losses_stays_as_it_is() -> None:
    sound = recording(SWING)
    assert with_lost_rows(sound) is sound


def test_an_axis_that_moves_on_evenly_says_that_no_row_is_missing() -> None:
    """The other axis jumps by as much as it moves in one sample: that is its encoder."""
    jumped = SWING.copy()
    jumped[300:] += jumped[300] - jumped[299]
    together = recording(jumped, np.sin(2.0 * TIME_S + 0.3))
    assert with_lost_rows(recording(jumped)).lost_rows == 1
    assert with_lost_rows(together) is together


@pytest.mark.parametrize("share", [0.4, 1.6, -2.0])
def test_a_jump_by_another_number_of_steps_is_none(share: float) -> None:
    jumped = SWING.copy()
    jumped[300:] += share * (jumped[300] - jumped[299])
    assert with_lost_rows(recording(jumped)).lost_rows == 0


@pytest.mark.parametrize("speeds", [(0.0, 1.0), (1.0, -0.5), (1.0, 0.1)])
def test_an_axis_that_starts_stops_or_bounces_has_lost_no_row(speeds: tuple[float, float]) -> None:
    velocity = np.where(np.arange(4000) % 400 < 200, *speeds)
    assert with_lost_rows(recording(np.cumsum(velocity) * PERIOD_S)).lost_rows == 0


def test_rows_that_are_read_at_uneven_times_are_not_lost() -> None:
    rng = np.random.default_rng(1)
    times_s = TIME_S + PERIOD_S * rng.uniform(-0.7, 0.7, len(TIME_S))
    assert with_lost_rows(recording(np.interp(times_s, TIME_S, SWING))).lost_rows == 0
