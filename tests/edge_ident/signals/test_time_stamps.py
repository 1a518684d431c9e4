"""Time stamps: even rows, lost rows, pauses and clipped samples."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

import edge_ident
from edge_ident.signals.conditioning import condition
from edge_ident.signals.recording import AxisRecord, Recording
from edge_ident.signals.time_stamps import EvenGrid, clipped, stale, with_even_rows, with_lost_rows

Array = NDArray[np.float64]


# Stamps that jitter are told from samples that do, by the position.

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


# Rows that are missing although the time stamps do not say so.

LOST_PERIOD_S, COUNT = 0.004, 1e-4
TIME_S = LOST_PERIOD_S * np.arange(4000)
SWING = np.sin(2.0 * TIME_S) + 0.2 * np.sin(7.0 * TIME_S)
FAST = (300, 301, 1200, 2750)
"""Rows at which the axis moves by a good many counts."""


def recording(*positions: Array) -> Recording:
    axes = {
        name: AxisRecord(COUNT * np.round(position / COUNT), np.cos(position), "rad", "N*m")
        for name, position in zip("xz", positions, strict=False)
    }
    return Recording(LOST_PERIOD_S * np.arange(len(positions[0])), axes, "by hand")


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
    assert with_lost_rows(recording(np.cumsum(velocity) * LOST_PERIOD_S)).lost_rows == 0


def test_rows_that_are_read_at_uneven_times_are_not_lost() -> None:
    rng = np.random.default_rng(1)
    times_s = TIME_S + LOST_PERIOD_S * rng.uniform(-0.7, 0.7, len(TIME_S))
    assert with_lost_rows(recording(np.interp(times_s, TIME_S, SWING))).lost_rows == 0


# Samples that say nothing: stamped after a pause, inside a gap, or clipped.

PAUSED_PERIOD_S = 0.001


def stalled() -> tuple[np.ndarray, np.ndarray]:
    """Stamps and positions of a recorder that pauses for 7 ms holding a position already read."""
    time_s = PAUSED_PERIOD_S * np.arange(3000)
    position = 8.0 * np.sin(2.0 * np.pi * time_s)
    held = np.delete(np.arange(3000), np.arange(1501, 1507))
    time_s, position = time_s[held], position[held]
    position[1501] = 8.0 * np.sin(2.0 * np.pi * 1.501)  # stamped 6 ms later
    return time_s, position


def test_the_row_that_ends_a_pause_is_stale() -> None:
    time_s, _ = stalled()
    assert np.flatnonzero(stale(time_s)).tolist() == [1501]
    assert not np.any(stale(PAUSED_PERIOD_S * np.arange(100)))
    uneven = np.cumsum(np.random.default_rng(1).exponential(PAUSED_PERIOD_S, 3000))
    assert not np.any(stale(uneven)), "uneven by nature"


def test_a_stall_is_bridged_without_its_stale_position() -> None:
    time_s, position = stalled()
    grid = EvenGrid.of(time_s)
    error = grid.resampled(position) - 8.0 * np.sin(2.0 * np.pi * grid.time_s)
    assert np.max(np.abs(error)) < 0.01
    unknown = np.flatnonzero(grid.unknown(position))
    assert 1.499 < grid.time_s[unknown[0]] < grid.time_s[unknown[-1]] < 1.509


def test_clipped_samples_are_at_the_highest_or_lowest_effort() -> None:
    effort = 3.0 * np.sin(np.linspace(0.0, 30.0, 4000)) + 0.5
    assert not np.any(clipped(effort))
    assert not np.any(clipped(0.01 * np.round(effort / 0.01))), "a sinusoid in counts"
    one_side = np.minimum(effort, 3.0)
    assert np.array_equal(clipped(one_side), effort >= 3.0)
    assert np.array_equal(clipped(np.clip(effort, -2.0, 3.0)), (effort >= 3.0) | (effort <= -2.0))
    assert not np.any(clipped(np.sign(effort))), "a command of two levels"


def test_clipped_samples_and_what_the_filter_mixes_with_them_do_not_count() -> None:
    time_s = 0.0025 * np.arange(4000)
    effort = 3.0 * np.sin(2.0 * time_s)
    full = condition(time_s, np.cos(2.0 * time_s), effort)
    cut = condition(time_s, np.cos(2.0 * time_s), np.minimum(effort, 2.5))
    assert full.unknown_share == 0.0
    assert cut.unknown_share == pytest.approx(np.mean(effort > 2.5), abs=1e-3)
    assert not np.any(cut.moving[effort > 2.5])
    assert np.max(np.abs(cut.effort - full.effort)[cut.moving]) < 0.02


def test_gaps_leave_the_rest_trusted() -> None:
    recording = edge_ident.simulate(edge_ident.reduced_model(), "multisine", cycles=1)
    samples = len(recording.time_s)
    there = np.ones(samples, np.bool_)
    there[samples // 4 : samples // 3] = False
    gaps = edge_ident.Recording(
        recording.time_s[there],
        {
            name: edge_ident.AxisRecord(axis.position[there], axis.effort[there], "rad", "N*m")
            for name, axis in recording.axes.items()
        },
        "gaps",
    )
    for axis in edge_ident.identify(gaps, diagnose=False).axes.values():
        (found,) = [one for one in axis.findings if one.code == "clipped_or_missing"]
        assert "% of the recording lies in gaps" in found.message
        assert axis.trusted
