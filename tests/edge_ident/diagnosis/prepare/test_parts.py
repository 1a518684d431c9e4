"""A recording that is too long for its motion is looked at in parts."""

import numpy as np
import pytest

from edge_ident.diagnosis.diagnose import diagnose
from edge_ident.diagnosis.prepare.parts import in_parts, part_findings
from edge_ident.diagnosis.verdict import Verdict
from edge_ident.signals.recording import AxisRecord, Recording

PERIOD_S = 0.002
COUNT_RAD = 2 * np.pi / 131072
TRUTH = {"inertia": 0.02, "viscous": 0.05, "coulomb": 0.3, "offset": 0.04}
RATES_HZ = (0.15, 0.35, 0.7, 1.1, 1.7, 2.3, 3.1)


def recording(duration_s: float, *, fastest_hz: float = 9.0, warm_up: float = 0.0) -> Recording:
    """A rigid drive that follows sinusoids exactly; its friction may fall in the first minute."""
    rng = np.random.default_rng(4)
    time = PERIOD_S * np.arange(round(duration_s / PERIOD_S))
    position, velocity, acceleration = (np.zeros(len(time)) for _ in range(3))
    for rate_hz in (rate for rate in RATES_HZ if rate < fastest_hz):
        w, phase = 2 * np.pi * rate_hz, rng.uniform(0, 2 * np.pi)
        size = 1.2 / (1 + 3 * rate_hz)
        position += size * np.sin(w * time + phase)
        velocity += size * w * np.cos(w * time + phase)
        acceleration -= size * w**2 * np.sin(w * time + phase)
    friction = TRUTH["coulomb"] * np.sign(velocity) + TRUTH["viscous"] * velocity
    friction *= 1.0 + warm_up * np.exp(-time / 60.0)
    effort = TRUTH["inertia"] * acceleration + friction + TRUTH["offset"]
    effort += 0.01 * np.std(effort) * rng.standard_normal(len(time))
    position = COUNT_RAD * np.round(position / COUNT_RAD)
    return Recording(time, {"x": AxisRecord(position, effort, "rad", "N*m")}, "a test")


@pytest.mark.parametrize(("duration_s", "fastest_hz"), [(40.0, 9.0), (300.0, 0.3)])
def test_short_or_slow_recordings_stay_whole(duration_s: float, fastest_hz: float) -> None:
    known = [recording(duration_s, fastest_hz=fastest_hz)]
    parts = in_parts(known, "x")
    assert parts == known
    assert not part_findings(known, parts)


def test_parts_are_from_the_beginning_the_middle_and_the_end_of_one_clock() -> None:
    known = [recording(300.0)]
    first, middle, last = in_parts(known, "x")
    assert first.begin_s == 0.0
    assert middle.begin_s == pytest.approx(150.0 - 0.5 * np.ptp(middle.time_s), abs=0.1)
    assert last.time_s[-1] == pytest.approx(known[0].time_s[-1], abs=0.01)
    assert last.begin_s == pytest.approx(last.time_s[0])
    (finding,) = part_findings(known, [first, middle, last])
    assert "300 s" in finding.message
    assert not finding.blocks


def test_a_long_recording_of_a_sound_drive_is_adequate_and_its_parameters_are_right() -> None:
    """A band of 3 Hz hid what reverses faster, and called it a play."""
    axis = diagnose([recording(200.0)], stability=False).axes["x"]
    assert axis.verdict is Verdict.ADEQUATE
    assert not axis.lines
    found = axis.base.estimate
    truth = np.array(list(TRUTH.values()))
    assert np.all(np.abs(found.parameters - truth) < 3.5 * found.std)
    assert [finding.code for finding in axis.findings] == ["in_parts"]


def test_what_changes_in_the_course_of_time_shows_in_the_parts() -> None:
    axis = diagnose([recording(200.0, warm_up=0.5)], stability=False).axes["x"]
    assert [cause.term.effect for cause in axis.causes] == ["warm_up"]
    (cause,) = axis.causes
    assert float(cause.term.values["time_constant"]) == pytest.approx(60.0, rel=0.15)
