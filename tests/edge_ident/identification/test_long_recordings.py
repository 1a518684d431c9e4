"""Long recordings: decimated before they are identified, with the same answer."""

import numpy as np
import pytest

import edge_ident
from edge_ident.identification.identify import at_needed_rate
from edge_ident.signals.recording import AxisRecord, Recording

PERIOD_S, SAMPLES = 0.001, 300_000
TRUTH = np.array([0.43, 2.4, 3.1, 0.3])
COUNT_RAD = 2.0 * np.pi / 1e5


@pytest.fixture(scope="module")
def recording() -> Recording:
    """Five minutes of three incommensurate sinusoids, with encoder counts and effort noise."""
    time_s = PERIOD_S * np.arange(SAMPLES)
    rate = 2.0 * np.pi * np.array([0.11, 0.53, 2.1])[:, None]
    amplitude = np.array([8.0, 1.0, 0.3])[:, None]
    position = np.sum(amplitude * np.sin(rate * time_s), axis=0)
    velocity = np.sum(amplitude * rate * np.cos(rate * time_s), axis=0)
    acceleration = np.sum(-amplitude * rate**2 * np.sin(rate * time_s), axis=0)
    columns = acceleration, velocity, np.sign(velocity), np.ones(SAMPLES)
    effort = TRUTH @ np.array(columns) + 0.05 * np.random.default_rng(3).standard_normal(SAMPLES)
    axis = AxisRecord(COUNT_RAD * np.round(position / COUNT_RAD), effort, "rad", "N*m")
    return Recording(time_s, {"x": axis}, "a test")


def part(recording: Recording, rows: slice) -> Recording:
    axis = recording.axes["x"]
    cut = AxisRecord(axis.position[rows], axis.effort[rows], "rad", "N*m")
    return Recording(recording.time_s[rows], {"x": cut}, recording.source)


def test_a_long_recording_agrees_with_its_parts_and_with_the_truth(recording: Recording) -> None:
    """The whole is decimated, the parts are not: both intervals hold."""
    whole = edge_ident.identify(recording, diagnose=False).axes["x"]
    assert whole.trusted
    assert np.all(np.abs(whole.estimate.parameters - TRUTH) < 3.0 * whole.estimate.std)
    for begin in (0, 100_000, 250_000):
        cut = part(recording, slice(begin, begin + 50_000))
        found = edge_ident.identify(cut, diagnose=False).axes["x"]
        apart = np.abs(found.estimate.parameters - whole.estimate.parameters)
        assert np.all(apart < 3.0 * np.hypot(found.estimate.std, whole.estimate.std))
        assert found.cutoff_hz == pytest.approx(whole.cutoff_hz, rel=0.1)


def test_a_long_recording_is_known_better_than_its_parts(recording: Recording) -> None:
    whole, beginning = (
        edge_ident.identify(r, diagnose=False).axes["x"].least_squares.std
        for r in (recording, part(recording, slice(0, 50_000)))
    )
    assert np.all(whole < beginning)


def test_decimation_keeps_the_motion_and_what_the_samples_told(recording: Recording) -> None:
    decimated = at_needed_rate(recording)
    axis, sampling = decimated.axes["x"], decimated.axes["x"].sampling
    assert sampling is not None
    stride = round(np.diff(decimated.time_s[:2])[0] / PERIOD_S)
    first = round(sampling.begin_s / PERIOD_S)
    as_recorded = recording.axes["x"].position[first::stride][: len(axis.position)]
    np.testing.assert_allclose(axis.position, as_recorded, atol=COUNT_RAD)
    assert stride == 4  # five samples in a period of the 50 Hz that the filter passes
    assert sampling.period_s == pytest.approx(PERIOD_S)
    assert sampling.count == pytest.approx(COUNT_RAD)
    assert sampling.effort_noise == pytest.approx(0.05, rel=0.05)


def test_a_short_recording_is_not_touched(recording: Recording) -> None:
    short = part(recording, slice(0, 44_000))
    assert at_needed_rate(short) is short


def test_a_gap_is_still_left_out(recording: Recording) -> None:
    """Samples inside a pause of a long recording are bridged, not interpolated."""
    rows = np.r_[0:120_000, 150_000:SAMPLES]
    axis = recording.axes["x"]
    cut = AxisRecord(axis.position[rows], axis.effort[rows], "rad", "N*m")
    found = edge_ident.identify(
        Recording(recording.time_s[rows], {"x": cut}, "a test"), diagnose=False
    )
    assert "clipped_or_missing" in {finding.code for finding in found.axes["x"].findings}
