"""A pendulum that a hand moves while its controller compensates gravity: no inertia is recorded."""

import numpy as np
import pytest

from edge_ident.diagnosis.diagnose import diagnose
from edge_ident.diagnosis.result import AxisDiagnosis
from edge_ident.signals.recording import AxisRecord, Recording

WEIGHT_NM = 3.3


@pytest.fixture(scope="module", params=[125.0, 250.0])
def found(request: pytest.FixtureRequest) -> AxisDiagnosis:
    """Slow swings over a turn, sampled at either rate; effort in steps of 2 mN·m."""
    rng = np.random.default_rng(4)
    time_s = np.arange(0.0, 24.0, 1.0 / request.param)
    angle = 2.4 * np.sin(0.5 * time_s) + 0.7 * np.sin(1.3 * time_s + 1.0)
    effort = WEIGHT_NM * np.sin(angle) + 0.005 * rng.standard_normal(len(time_s))
    step = 2.0 * np.pi / 4096
    axis = AxisRecord(step * np.round(angle / step), 0.002 * np.round(effort / 0.002), "rad", "N*m")
    return diagnose([Recording(time_s, {"x": axis}, "by hand", 0.0)]).axes["x"]


def test_the_law_is_the_same_at_any_sampling(found: AxisDiagnosis) -> None:
    load = next(c.term for c in found.causes if c.term.effect == "position_dependent_load")
    assert load.values["sine"] == pytest.approx(WEIGHT_NM, rel=0.02)
    assert found.budget.share("position") > 0.95


def test_it_says_that_inertia_is_not_in_the_recording(found: AxisDiagnosis) -> None:
    finding = next(f for f in found.findings if f.code == "effort_of_position")
    assert "inertia is not in this recording" in finding.message
    assert not finding.blocks
