"""Stamps that jitter are told from samples that do, by the position."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from edge_ident.signals.recording import AxisRecord, Recording
from edge_ident.signals.time_stamps import with_even_rows

PERIOD_S = 0.01
COUNT_RAD = 2e-5
ROWS = np.arange(4000)


def moved(time_s: NDArray[np.float64]) -> NDArray[np.float64]:
    """Up to 3 rad/s, in counts."""
    exact = np.sin(2.9 * time_s) + 0.1 * np.sin(11.0 * time_s)
    return COUNT_RAD * np.round(exact / COUNT_RAD)


def recorded(stamps_s: NDArray[np.float64], taken_s: NDArray[np.float64]) -> Recording:
    """A recording of samples that were taken at one time and stamped with another."""
    axis = AxisRecord(moved(taken_s), np.cos(2.9 * taken_s), "rad", "N*m")
    return Recording(stamps_s, {"x": axis}, "a test")


def jitter(rms: float) -> NDArray[np.float64]:
    """In seconds, of an rms in sampling periods."""
    return rms * PERIOD_S * np.random.default_rng(3).standard_normal(len(ROWS))


@pytest.mark.parametrize("rms", [0.01, 0.04, 0.15])
def test_even_samples_with_jittering_stamps_get_even_stamps(rms: float) -> None:
    even_s = PERIOD_S * ROWS
    found = with_even_rows(recorded(even_s + jitter(rms), even_s))
    np.testing.assert_allclose(np.diff(found.time_s), PERIOD_S, rtol=1e-4)
    assert found.stamp_jitter == pytest.approx(rms, rel=0.05)
    assert with_even_rows(found) is found


def test_samples_that_jitter_as_they_are_stamped_keep_their_stamps() -> None:
    taken_s = PERIOD_S * ROWS + jitter(0.04)
    known = recorded(taken_s, taken_s)
    assert with_even_rows(known) is known


def test_missing_rows_leave_whole_periods() -> None:
    kept = np.delete(ROWS, [700, 701, 702, 2500])
    even_s = PERIOD_S * kept
    found = with_even_rows(recorded(even_s + jitter(0.04)[kept], even_s))
    np.testing.assert_allclose(found.time_s - found.time_s[0], even_s, atol=0.01 * PERIOD_S)


def test_one_late_stamp_is_no_missing_row() -> None:
    even_s = PERIOD_S * ROWS
    stamps_s = even_s.copy()
    stamps_s[1234] += 0.9 * PERIOD_S
    found = with_even_rows(recorded(stamps_s, even_s))
    np.testing.assert_allclose(found.time_s, even_s, atol=1e-3 * PERIOD_S)


def test_a_rate_that_changes_is_no_jitter() -> None:
    taken_s = np.cumsum(PERIOD_S * (1.0 + 0.05 * np.sin(2e-3 * ROWS)))
    stamps_s = taken_s + jitter(0.04)
    known = recorded(stamps_s, taken_s)
    assert with_even_rows(known) is known


def test_an_axis_that_contradicts_keeps_the_stamps() -> None:
    even_s = PERIOD_S * ROWS
    stamps_s = even_s + jitter(0.04)
    known = recorded(stamps_s, even_s)
    other = recorded(stamps_s, stamps_s).axes["x"]
    both = replace(known, axes={**known.axes, "z": other})
    assert with_even_rows(both) is both


def test_a_position_without_motion_says_nothing() -> None:
    known = recorded(PERIOD_S * ROWS + jitter(0.04), np.zeros(len(ROWS)))
    assert with_even_rows(known) is known
