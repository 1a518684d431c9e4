"""Speeds of a whole number of counts per sample, as round set values often are."""

import numpy as np
import pytest

from edge_ident.diagnosis.prepare.bandwidth import tone_count
from edge_ident.identification.identify import identify
from edge_ident.signals.recording import AxisRecord, Recording

PERIOD_S = 0.004
COUNT = 1e-6
TRUTH = np.array([0.6, 2.5, 0.2, -0.01])


def steady_strokes(shaken_counts: float) -> Recording:
    """Strokes with rests between, at 200, 400 and 800 counts per sample, of an axis that shakes."""
    rng = np.random.default_rng(16)
    ways = [way * 0.05 * 2**k for k in (0, 1, 2) * 3 for way in (1, -1)]
    v = np.concatenate([np.r_[np.full(250, way), np.zeros(60)] for way in ways])
    v = np.convolve(v, np.hanning(20) / np.hanning(20).sum(), "same")
    a = np.gradient(v, PERIOD_S)
    fast = np.diff(rng.standard_normal(len(v) + 2), n=2) / np.sqrt(6.0)
    x = np.cumsum(v) * PERIOD_S + shaken_counts * COUNT * fast
    effort = np.stack([a, v, np.sign(v), np.ones_like(v)], axis=1) @ TRUTH
    effort += 0.01 * np.sqrt(np.mean(effort**2)) * rng.standard_normal(len(v))
    time_s = np.arange(len(v)) * PERIOD_S
    read = np.floor(x / COUNT) * COUNT
    return Recording(time_s, {"x": AxisRecord(read, effort, "m", "A")}, "by hand")


def test_an_encoder_that_is_shaken_by_more_than_half_a_count_has_no_tone() -> None:
    rounding = COUNT / np.sqrt(12.0)
    assert tone_count(COUNT, rounding) == COUNT
    assert tone_count(COUNT, np.hypot(rounding, 0.4 * COUNT)) == COUNT
    assert tone_count(COUNT, np.hypot(rounding, 0.6 * COUNT)) == 0.0


def test_steady_speeds_count_where_the_rounding_is_white() -> None:
    axis = identify(steady_strokes(0.7), None).axes["x"]
    assert axis.adequacy.adequate
    assert axis.estimate.parameters[1:] == pytest.approx(TRUTH[1:], rel=0.05, abs=0.003)
