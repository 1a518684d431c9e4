"""The encoder of another recording counts from another zero: what depends on it is elsewhere."""

from dataclasses import replace

import numpy as np
import pytest

from edge_ident.diagnosis.diagnose import diagnose
from edge_ident.diagnosis.measures import Verdict
from edge_ident.signals.recording import AxisRecord, Recording

RATES = 2.0 * np.pi * np.array([0.11, 0.37, 0.89])


def arm(seed: int, *, zero: float = 0.0, weight: float = 4.0) -> Recording:
    """An arm along three sines of random phase, whose angle reads more than it is."""
    rng, t = np.random.default_rng(seed), np.arange(0.0, 12.0, 4e-3)
    angle = RATES * t[:, None] + rng.uniform(0.0, 2.0 * np.pi, len(RATES))
    x, v, a = (np.sin(angle) / RATES).sum(1), np.cos(angle).sum(1), -(RATES * np.sin(angle)).sum(1)
    effort = 0.4 * a + 1.5 * v + 2.0 * np.sign(v) + weight * np.cos(x + 0.3)
    effort += 0.02 * rng.standard_normal(len(t))
    return Recording(t, {"x": AxisRecord(x + zero, effort, "rad", "N*m")}, f"{seed}.csv")


@pytest.mark.parametrize("validates", [False, True])
def test_another_zero_is_named_with_its_shift(validates: bool) -> None:
    first, other = arm(1), arm(2, zero=-0.8)
    pair = ([first], other) if validates else ([first, other], None)
    axis = diagnose(pair[0], validate=pair[1]).axes["x"]
    (said,) = [each for each in axis.findings if each.code == "zero_differs"]
    assert said.message.startswith("the position of 2.csv is -0.8 rad from that of 1.csv")
    assert said.next_step.endswith("add 0.8 rad to the position of 2.csv")
    assert said.blocks is not validates
    assert not axis.causes


def test_another_weight_is_no_other_zero() -> None:
    axis = diagnose([arm(1)], validate=arm(2, weight=3.0)).axes["x"]
    assert "zero_differs" not in {each.code for each in axis.findings}


def test_where_nothing_depends_on_the_position_no_zero_is_another() -> None:
    axis = diagnose([arm(1, weight=0.0)], validate=arm(2, weight=4.0)).axes["x"]
    assert axis.verdict is Verdict.UNEXPLAINED
    assert "zero_differs" not in {each.code for each in axis.findings}


def test_of_recordings_on_one_clock_none_has_another_zero_than_the_other() -> None:
    """The first two are one record in two pieces, so the third is the one that differs."""
    pieces = [arm(1), replace(arm(3), begin_s=20.0)]
    axis = diagnose([*pieces, arm(2, zero=-0.8)]).axes["x"]
    (said,) = [each for each in axis.findings if each.code == "zero_differs"]
    assert said.message.startswith("the position of 2.csv is -0.8 rad from that of 1.csv")
