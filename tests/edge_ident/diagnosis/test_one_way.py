"""Several recordings: each in one direction, and one that shows nothing."""

import numpy as np
import pytest

from edge_ident.diagnosis.diagnose import diagnose
from edge_ident.diagnosis.result import Diagnosis
from edge_ident.signals.recording import AxisRecord, Recording

COULOMB_NM = 2.0
PERIOD_S = 0.008


def one_way(name: str, way: float, duration_s: float = 14.0) -> Recording:
    """Inertia 0.5, viscous friction 1.0, offset 0.1; the speed varies and keeps its sign."""
    rng = np.random.default_rng(len(name))
    time_s = np.arange(0.0, duration_s, PERIOD_S)
    swings = ((0.7, 1.1), (0.4, 2.3))
    velocity = way * (1.6 + sum(size * np.sin(rate * time_s) for size, rate in swings))
    acceleration = way * sum(size * rate * np.cos(rate * time_s) for size, rate in swings)
    position = np.cumsum(velocity) * PERIOD_S
    effort = 0.5 * acceleration + velocity + COULOMB_NM * way + 0.1
    effort = effort + 0.02 * rng.standard_normal(len(time_s))
    step = 2.0 * np.pi / 2**16
    axis = AxisRecord(step * np.round(position / step), effort, "rad", "N*m")
    return Recording(time_s, {"x": axis}, name, 0.0)


def shaken(name: str) -> Recording:
    """So short, and turning so often, that no sample lies away from reversals."""
    time_s = np.arange(0.0, 1.8, PERIOD_S)
    velocity, rate = 0.1 * np.cos(30.0 * time_s), 30.0
    position = 0.1 / rate * np.sin(rate * time_s)
    effort = COULOMB_NM * np.sign(velocity) + velocity + 0.1
    step = 2.0 * np.pi / 2**16
    axis = AxisRecord(step * np.round(position / step), effort, "rad", "N*m")
    return Recording(time_s, {"x": axis}, name, 0.0)


@pytest.fixture(scope="module")
def found() -> Diagnosis:
    recordings = [one_way("forward", 1.0), one_way("backward", -1.0), shaken("short")]
    return diagnose(recordings)


def test_an_own_offset_does_not_swallow_the_dry_friction(found: Diagnosis) -> None:
    """With an offset of its own in each, half of it would be enough."""
    coulomb = found.axes["x"].extended.estimate.parameters[2]
    assert coulomb == pytest.approx(COULOMB_NM, abs=0.05)
    assert "offset_shared" in {finding.code for finding in found.axes["x"].findings}


def test_a_recording_that_shows_nothing_is_named_and_left_out(found: Diagnosis) -> None:
    (left_out,) = [f for f in found.axes["x"].findings if f.code == "recording_left_out"]
    assert left_out.message.startswith("short:")
    assert not left_out.blocks
    assert set(found.axes["x"].traces.recording) == {0, 1}
