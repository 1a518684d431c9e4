"""Samples that say nothing: stamped after a pause, inside a gap, or clipped."""

import numpy as np
import pytest

import edge_ident
from edge_ident.signals.conditioning import condition
from edge_ident.signals.time_stamps import EvenGrid, clipped, stale

PERIOD_S = 0.001


def stalled() -> tuple[np.ndarray, np.ndarray]:
    """Stamps and positions of a recorder that pauses for 7 ms holding a position already read."""
    time_s = PERIOD_S * np.arange(3000)
    position = 8.0 * np.sin(2.0 * np.pi * time_s)
    held = np.delete(np.arange(3000), np.arange(1501, 1507))
    time_s, position = time_s[held], position[held]
    position[1501] = 8.0 * np.sin(2.0 * np.pi * 1.501)  # stamped 6 ms later
    return time_s, position


def test_the_row_that_ends_a_pause_is_stale() -> None:
    time_s, _ = stalled()
    assert np.flatnonzero(stale(time_s)).tolist() == [1501]
    assert not np.any(stale(PERIOD_S * np.arange(100)))
    uneven = np.cumsum(np.random.default_rng(1).exponential(PERIOD_S, 3000))
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
