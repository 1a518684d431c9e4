"""Two links that turn in one plane: each joint has the weights and inertia of its place.

The efforts come from Newton's law for two masses, whose accelerations are differences of their
places.
"""

from collections.abc import Mapping
from dataclasses import replace
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

LENGTHS_M = 0.4, 0.3
MASSES_KG = 3.0, 2.0
INERTIAS = 0.4, 0.2
FRICTIONS = (2.0, 1.5), (1.0, 0.8)
GRAVITY = 9.81
ZEROS = 0.4, -0.7
SHARED = MASSES_KG[1] * LENGTHS_M[0] * LENGTHS_M[1]


def swung(joint: int, t: Array) -> Array:
    rng = np.random.default_rng(joint)
    rates = 2.0 * np.pi * np.array([0.11, 0.23, 0.41, 0.67]) * (1.0 + 0.13 * joint)
    angle = rates * t[:, None] + rng.uniform(0.0, 2.0 * np.pi, len(rates))
    return np.asarray(0.6 * np.sin(angle).sum(axis=1))


def recorded(gravity: float) -> Recording:
    t = np.arange(0.0, 20.0, PERIOD_S)
    angles = swung(0, t), swung(1, t)
    inner = LENGTHS_M[0] * np.exp(1j * angles[0])
    lever = LENGTHS_M[1] * np.exp(1j * (angles[0] + angles[1]))
    places = inner, inner + lever
    forces = [
        mass * (twice_differentiated(place) + 1j * gravity)
        for mass, place in zip(MASSES_KG, places, strict=True)
    ]
    moments = (
        sum((place.conj() * force).imag for place, force in zip(places, forces, strict=True)),
        (lever.conj() * forces[1]).imag,
    )
    rng = np.random.default_rng(7)
    axes = {
        f"j{k + 1}": joint(angle, moment, INERTIAS[k], FRICTIONS[k], ZEROS[k], rng)
        for k, (angle, moment) in enumerate(zip(angles, moments, strict=True))
    }
    return Recording(t, axes, "two links")


@cache
def diagnosed(gravity: float) -> Mapping[str, AxisDiagnosis]:
    return diagnose([recorded(gravity)]).axes


def amplitude(values: Mapping[str, float], name: str) -> float:
    return float(np.hypot(values[f"{name}cosine"], values[f"{name}sine"]))


@pytest.mark.parametrize("gravity", a_few([0.0, GRAVITY], [GRAVITY]))
def test_both_joints_show_the_inertia_that_they_share(gravity: float) -> None:
    axes = diagnosed(gravity)
    for name, place, other in (("j1", "inner_", "outer_"), ("j2", "outer_", "inner_")):
        assert axes[name].verdict is Verdict.EXPLAINED
        terms = {cause.term.effect: cause.term.values for cause in axes[name].causes}
        weighs = {"position_dependent_load"} if gravity else set()
        assert set(terms) == {"cross_axis_coupling", *weighs}
        coupling = terms["cross_axis_coupling"]
        assert amplitude(coupling, place) == pytest.approx(SHARED, rel=0.03)
        assert amplitude(coupling, other) == 0.0
        along = MASSES_KG[1] * LENGTHS_M[1] ** 2
        assert coupling["inertia"] == pytest.approx(along, rel=0.05)


def test_the_inner_joint_bears_both_weights_and_the_outer_one_that_of_its_link() -> None:
    loads = {
        name: next(c.term.values for c in axis.causes if c.term.effect == "position_dependent_load")
        for name, axis in diagnosed(GRAVITY).items()
    }
    outer = MASSES_KG[1] * LENGTHS_M[1] * GRAVITY
    inner = sum(MASSES_KG) * LENGTHS_M[0] * GRAVITY
    assert amplitude(loads["j1"], "") == pytest.approx(inner, rel=0.01)
    assert amplitude(loads["j1"], "sum_") == pytest.approx(outer, rel=0.01)
    assert amplitude(loads["j2"], "") == 0.0
    assert amplitude(loads["j2"], "sum_") == pytest.approx(outer, rel=0.01)


def test_a_joint_that_counts_the_other_way_round_has_the_same_weight_and_inertia() -> None:
    """Which way an encoder counts, and which effort is positive, are conventions."""
    recording = recorded(GRAVITY)
    j2 = recording.axes["j2"]
    turned = replace(j2, position=-j2.position, effort=-j2.effort)
    turned_recording = replace(recording, axes={**recording.axes, "j2": turned})
    (axis,) = diagnose([turned_recording], only=["j2"]).axes.values()
    assert axis.verdict is Verdict.EXPLAINED
    terms = {cause.term.effect: cause.term for cause in axis.causes}
    assert set(terms) == {"cross_axis_coupling", "position_dependent_load"}
    assert {term.source_axis for term in terms.values()} == {"-j1"}
    weight = MASSES_KG[1] * LENGTHS_M[1] * GRAVITY
    assert amplitude(terms["position_dependent_load"].values, "sum_") == pytest.approx(
        weight, rel=0.01
    )
    assert amplitude(terms["cross_axis_coupling"].values, "outer_") == pytest.approx(
        SHARED, rel=0.03
    )
