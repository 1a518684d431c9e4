"""A joint that turns a link which another one lifts: its inertia follows the link's angle.

The efforts come from Newton's law for a mass, whose acceleration is differences of its place.
"""

from collections.abc import Mapping
from functools import cache

import numpy as np
import pytest
from numpy.typing import NDArray

from edge_ident.diagnosis.diagnose import diagnose
from edge_ident.diagnosis.measures import Verdict
from edge_ident.diagnosis.result import AxisDiagnosis
from edge_ident.signals.recording import Recording
from tests.edge_ident.diagnosis.joints import PERIOD_S, joint, twice_differentiated
from tests.repetitions import a_few

Array = NDArray[np.float64]

AXIS_TO_AXIS_M = 0.25
LENGTH_M = 0.4
MASS_KG = 2.5
INERTIAS = 0.6, 0.3
FRICTIONS = (1.5, 2.0), (1.0, 1.2)
ZEROS = 0.8, -0.5
ONCE = 2.0 * MASS_KG * AXIS_TO_AXIS_M * LENGTH_M
TWICE = 0.5 * MASS_KG * LENGTH_M**2
MEAN = MASS_KG * (AXIS_TO_AXIS_M**2 + 0.5 * LENGTH_M**2)


def swung(joint: int, t: Array) -> Array:
    rng = np.random.default_rng(10 + joint)
    rates = 2.0 * np.pi * np.array([0.13, 0.22, 0.43, 0.71]) * (1.0 + 0.17 * joint)
    return np.asarray(0.6 * np.sin(rates * t[:, None] + rng.uniform(0, 6, 4)).sum(axis=1))


def recorded(gravity: float) -> Recording:
    t = np.arange(0.0, 24.0, PERIOD_S)
    turned, lifted = swung(0, t), swung(1, t)
    outwards = np.stack([np.cos(turned), np.sin(turned), 0.0 * t], axis=1)
    up = np.array([0.0, 0.0, 1.0])
    lever = LENGTH_M * (np.cos(lifted)[:, None] * outwards + np.sin(lifted)[:, None] * up)
    place = AXIS_TO_AXIS_M * outwards + lever
    force = MASS_KG * (twice_differentiated(place) + gravity * up)
    moments = (
        np.cross(place, force) @ up,
        np.sum(np.cross(lever, force) * np.cross(outwards, up), axis=1),
    )
    rng = np.random.default_rng(3)
    axes = {
        f"j{k + 1}": joint(angle, moment, INERTIAS[k], FRICTIONS[k], ZEROS[k], rng)
        for k, (angle, moment) in enumerate(zip((turned, lifted), moments, strict=True))
    }
    return Recording(t, axes, "a turned link")


@cache
def diagnosed(gravity: float) -> Mapping[str, AxisDiagnosis]:
    return diagnose([recorded(gravity)]).axes


@pytest.mark.parametrize("gravity", a_few([0.0, 9.81], [9.81]))
@pytest.mark.parametrize(("joint", "place"), [("j1", "turning"), ("j2", "lifted")])
def test_both_joints_show_the_inertia_that_is_turned(
    gravity: float, joint: str, place: str
) -> None:
    axis = diagnosed(gravity)[joint]
    assert axis.verdict is Verdict.EXPLAINED
    terms = {cause.term.effect: cause.term.values for cause in axis.causes}
    weighs = {"position_dependent_load"} if gravity and joint == "j2" else set()
    assert set(terms) == {"pose_dependent_inertia", *weighs}
    values = terms["pose_dependent_inertia"]
    for suffix, amplitude in (("", ONCE), ("_2", TWICE)):
        found = np.hypot(values[f"{place}_cosine{suffix}"], values[f"{place}_sine{suffix}"])
        assert found == pytest.approx(amplitude, rel=0.03)
    own = MEAN if joint == "j1" else MASS_KG * LENGTH_M**2
    inertia, viscous, coulomb, _ = axis.extended.estimate.parameters
    k = int(joint[1]) - 1
    assert inertia == pytest.approx(INERTIAS[k] + own, rel=0.02)
    assert (viscous, coulomb) == pytest.approx(FRICTIONS[k], rel=0.02)
