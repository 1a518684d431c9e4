"""A recording that is too long for its motion is looked at in parts."""

from itertools import product

import numpy as np
import pytest

from edge_ident.diagnosis.diagnose import diagnose
from edge_ident.diagnosis.measures import Verdict
from edge_ident.diagnosis.prepare.preparation import in_parts
from edge_ident.signals.recording import AxisRecord, Recording
from tests.repetitions import a_few

PERIOD_S = 0.004
COUNT_RAD = 2 * np.pi / 131072
TRUTH = {"inertia": 0.02, "viscous": 0.05, "coulomb": 0.3, "offset": 0.04}
RATES_HZ = (0.15, 0.35, 0.7, 1.1, 1.7, 2.3, 3.1)


def recording(
    duration_s: float,
    *,
    fastest_hz: float = 9.0,
    warm_up: float = 0.0,
    seed: int = 4,
    rest_s: tuple[float, float] = (0.0, 0.0),
) -> Recording:
    """A rigid drive that follows sinusoids exactly; its friction may fall in the first minute, and
    it may rest for a while."""
    rng = np.random.default_rng(seed)
    clock = PERIOD_S * np.arange(round(duration_s / PERIOD_S))
    time = clock - np.clip(clock - rest_s[0], 0.0, rest_s[1] - rest_s[0])
    moving = (clock < rest_s[0]) | (clock >= rest_s[1])
    position, velocity, acceleration = (np.zeros(len(time)) for _ in range(3))
    for rate_hz in (rate for rate in RATES_HZ if rate < fastest_hz):
        w, phase = 2 * np.pi * rate_hz, rng.uniform(0, 2 * np.pi)
        size = 1.2 / (1 + 3 * rate_hz)
        position += size * np.sin(w * time + phase)
        velocity += size * w * np.cos(w * time + phase)
        acceleration -= size * w**2 * np.sin(w * time + phase)
    velocity, acceleration = velocity * moving, acceleration * moving
    friction = TRUTH["coulomb"] * np.sign(velocity) + TRUTH["viscous"] * velocity
    friction *= 1.0 + warm_up * np.exp(-clock / 60.0)
    effort = TRUTH["inertia"] * acceleration + friction + TRUTH["offset"]
    effort += 0.01 * np.std(effort) * rng.standard_normal(len(time))
    position = COUNT_RAD * np.round(position / COUNT_RAD)
    return Recording(clock, {"x": AxisRecord(position, effort, "rad", "N*m")}, "a test")


@pytest.mark.parametrize(("duration_s", "fastest_hz"), [(40.0, 9.0), (300.0, 0.3)])
def test_short_or_slow_recordings_stay_whole(duration_s: float, fastest_hz: float) -> None:
    known = recording(duration_s, fastest_hz=fastest_hz)
    assert in_parts([known], "x") == ([known], [0], [])


def test_parts_are_from_the_beginning_the_middle_and_the_end_of_one_clock() -> None:
    known = recording(300.0)
    (first, middle, last), places, (finding,) = in_parts([known], "x")
    assert places == [0, 0, 0]
    assert first.begin_s < 1.0
    assert middle.begin_s == pytest.approx(150.0 - 0.5 * np.ptp(middle.time_s), abs=3.0)
    assert last.time_s[-1] > known.time_s[-1] - 1.0
    assert last.begin_s == pytest.approx(last.time_s[0])
    assert "300 s" in finding.message
    assert not finding.blocks


RESTS_S = ((0.0, 30.0), (85.0, 115.0), (170.0, 200.0))


@pytest.mark.parametrize(
    ("rest_s", "gap"),
    a_few(product(RESTS_S, (False, True)), [(RESTS_S[0], False), (RESTS_S[1], True)]),
)
def test_no_part_lies_in_a_rest_or_in_a_gap(rest_s: tuple[float, float], gap: bool) -> None:
    """Of a long one the time is spent, not the motion."""
    known = recording(200.0, rest_s=rest_s)
    if gap:
        known = without(known, *rest_s)
    assert len(in_parts([known], "x")[0]) == 3
    axis = diagnose([known]).axes["x"]
    assert axis.verdict is Verdict.ADEQUATE
    far = axis.base.estimate.parameters - np.array(list(TRUTH.values()))
    assert np.all(np.abs(far) < 4.0 * axis.base.estimate.std)


def without(known: Recording, begin_s: float, end_s: float) -> Recording:
    """Without the rows of an interval."""
    kept = (known.time_s < begin_s) | (known.time_s >= end_s)
    axis = known.axes["x"]
    position, effort = axis.position[kept], axis.effort[kept]
    rows = AxisRecord(position, effort, *axis.units)
    return Recording(known.time_s[kept], {"x": rows}, known.source)


def test_another_recording_is_taken_in_parts_too() -> None:
    """A validation recording, and one of several of different lengths."""
    other = recording(200.0, seed=5)
    found = diagnose([recording(40.0)], validate=other).axes["x"]
    assert found.verdict is Verdict.ADEQUATE
    assert [finding.code for finding in found.findings] == ["in_parts"]
    both = diagnose([recording(40.0), other]).axes["x"]
    assert both.verdict is Verdict.ADEQUATE
    assert "in_parts" in [finding.code for finding in both.findings]


@pytest.mark.parametrize("seed", a_few([4, 5, 6], [4]))
def test_a_long_recording_of_a_sound_drive_is_adequate_and_its_parameters_are_right(
    seed: int,
) -> None:
    """A band of 3 Hz hid what reverses faster, and called it a play."""
    axis = diagnose([recording(200.0, seed=seed)]).axes["x"]
    assert axis.verdict is Verdict.ADEQUATE
    found = axis.base.estimate
    truth = np.array(list(TRUTH.values()))
    assert np.all(np.abs(found.parameters - truth) < 4.0 * found.std)
    assert [finding.code for finding in axis.findings] == ["in_parts"]


def test_what_changes_in_the_course_of_time_shows_in_the_parts() -> None:
    axis = diagnose([recording(200.0, warm_up=0.5)]).axes["x"]
    assert [cause.term.effect for cause in axis.causes] == ["warm_up"]
    (cause,) = axis.causes
    assert float(cause.term.values["time_constant"]) == pytest.approx(60.0, rel=0.15)
