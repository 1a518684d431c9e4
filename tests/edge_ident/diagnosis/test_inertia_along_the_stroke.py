"""Mechanisms that move more here than there: what they carry costs effort by Newton's law.

A mass is moved by a yoke on a crank, or by a rope from a conical drum. Its acceleration is
differences of its place, and the moment is force times the ratio of the speeds.
"""

from functools import cache

import numpy as np
import pytest
from numpy.typing import NDArray

from edge_ident.diagnosis.diagnose import diagnose
from edge_ident.diagnosis.measures import Verdict
from edge_ident.diagnosis.result import AxisDiagnosis
from edge_ident.model.inverse import left_by_terms
from edge_ident.signals.recording import Recording
from tests.edge_ident.diagnosis.joints import PERIOD_S, joint, twice_differentiated

Array = NDArray[np.float64]

MASS_KG, INERTIA, FRICTION = 4.0, 0.5, (1.0, 1.4)
RADIUS_M, CONE = 0.3, 0.02
"""Of the crank or of the drum in the middle of the travel; m, and m for each rad."""
ZERO = 0.7
"""Reading of the encoder there."""


def turned(t: Array, seed: int) -> Array:
    """Four sines; one of seed 0."""
    if seed == 0:
        return np.asarray(2.0 * np.sin(2.0 * np.pi * 0.31 * t))
    rng = np.random.default_rng(seed)
    rates = 2.0 * np.pi * np.array([0.11, 0.23, 0.41, 0.67])
    return np.asarray(1.1 * np.sin(rates * t[:, None] + rng.uniform(0, 6, 4)).sum(axis=1))


def recorded(mechanism: str, seed: int) -> Recording:
    t = np.arange(0.0, 24.0, PERIOD_S)
    angle = turned(t, seed)
    if mechanism == "yoke":
        place, ratio = RADIUS_M * np.sin(angle), RADIUS_M * np.cos(angle)
    else:
        place, ratio = (RADIUS_M + 0.5 * CONE * angle) * angle, RADIUS_M + CONE * angle
    moment = MASS_KG * twice_differentiated(place) * ratio
    axis = joint(angle, moment, INERTIA, FRICTION, ZERO, np.random.default_rng(seed))
    return Recording(t, {"x": axis}, f"{mechanism} {seed}")


@cache
def diagnosed(mechanism: str) -> AxisDiagnosis:
    other = recorded(mechanism, 5)
    found = diagnose([recorded(mechanism, 4)], validate=other)
    scored = found.validation["x"]
    assert scored.extended < 0.2 * scored.base
    return found.axes["x"]


@pytest.mark.parametrize("mechanism", ["yoke", "drum"])
def test_the_inertia_is_named_and_carries_over(mechanism: str) -> None:
    axis = diagnosed(mechanism)
    assert axis.verdict is Verdict.EXPLAINED
    assert [cause.term.effect for cause in axis.causes] == ["position_dependent_inertia"]
    assert axis.extended.estimate.parameters[1:3] == pytest.approx(FRICTION, rel=0.02)
    assert left_by_terms(axis.model).physical


def test_that_of_a_yoke_repeats_twice_a_turn() -> None:
    axis = diagnosed("yoke")
    (cause,) = axis.causes
    half = 0.5 * MASS_KG * RADIUS_M**2
    values = cause.term.values
    assert values["period"] == pytest.approx(np.pi, rel=0.01)
    assert np.hypot(values["cosine"], values["sine"]) == pytest.approx(half, rel=0.03)
    assert axis.extended.estimate.parameters[0] == pytest.approx(INERTIA + half, rel=0.01)


def test_that_of_a_drum_is_that_in_the_middle_and_a_slope() -> None:
    axis = diagnosed("drum")
    (cause,) = axis.causes
    middle = cause.term.values["centre"] - ZERO
    radius_m = RADIUS_M + CONE * middle
    slope = 2.0 * MASS_KG * CONE * radius_m
    assert cause.term.values["slope"] == pytest.approx(slope, rel=0.05)
    inertia = INERTIA + MASS_KG * radius_m**2
    assert axis.extended.estimate.parameters[0] == pytest.approx(inertia, rel=0.02)


def test_along_one_sinusoid_it_is_noticed_and_has_no_name() -> None:
    """A load along the stroke has the same effort there."""
    axis = diagnose([recorded("yoke", 0)]).axes["x"]
    assert axis.verdict is not Verdict.ADEQUATE
    assert "position_dependent_inertia" not in [cause.term.effect for cause in axis.causes]
