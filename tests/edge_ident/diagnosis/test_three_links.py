"""Three links that turn in one plane: a link's weight follows the sum of all angles up to it.

The efforts come from Newton's law for three masses, whose accelerations are differences of their
places. Two motions show whether what was found in the one holds in the other.
"""

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from edge_ident.diagnosis.diagnose import diagnose
from edge_ident.diagnosis.result import AxisDiagnosis
from edge_ident.model.inverse import inverse_effort
from edge_ident.model.model import Model
from edge_ident.model.model_files import load_model, save_model
from edge_ident.model.motion import Motion
from edge_ident.signals.recording import Recording
from tests.edge_ident.diagnosis.joints import PERIOD_S, joint, twice_differentiated
from tests.repetitions import a_few

Array = NDArray[np.float64]

LENGTHS_M = 0.4, 0.35, 0.15
MASSES_KG = 5.0, 3.0, 2.0
INERTIAS = 0.5, 0.3, 0.1
FRICTIONS = (2.0, 1.5), (1.5, 1.0), (0.5, 0.4)
GRAVITY = 9.81
FREQUENCIES_HZ = np.array([0.11, 0.23, 0.41])


def turned(seed: int, t: Array) -> Array:
    """Angles (3, N) of the joints, each from the link before it."""
    rng = np.random.default_rng(seed)
    rates = 2.0 * np.pi * FREQUENCIES_HZ * (1.0 + 0.13 * np.arange(3)[:, None])
    phases = rng.uniform(0.0, 2.0 * np.pi, rates.shape)
    return 0.5 * np.sin(rates[..., None] * t + phases[..., None]).sum(axis=1)


@cache
def recorded(seed: int) -> Recording:
    t = np.arange(0.0, 12.0, PERIOD_S)
    angles = turned(seed, t)
    links = np.array(LENGTHS_M)[:, None] * np.exp(1j * np.cumsum(angles, axis=0))
    forces = [
        mass * (twice_differentiated(place) + 1j * GRAVITY)
        for mass, place in zip(MASSES_KG, np.cumsum(links, axis=0), strict=True)
    ]
    rng = np.random.default_rng(7)
    axes = {}
    for k in range(3):
        levers = np.cumsum(links[k:], axis=0)
        moment = np.sum((levers.conj() * np.array(forces[k:])).imag, axis=0)
        axes[f"j{k + 1}"] = joint(angles[k], moment, INERTIAS[k], FRICTIONS[k], 0.0, rng)
    return Recording(t, axes, "three links")


@cache
def diagnosed(name: str) -> AxisDiagnosis:
    return diagnose([recorded(1)], only=[name]).axes[name]


def weights(axis: AxisDiagnosis) -> dict[str | None, float]:
    """Moment (N*m) of each weight that was named, by the axes whose angles it follows."""
    terms = (c.term for c in axis.causes if c.term.effect == "position_dependent_load")
    return {
        t.source_axis: float(np.hypot(t.values["sum_cosine"], t.values["sum_sine"])) for t in terms
    }


def test_the_outer_joint_has_the_weight_of_the_outer_link_alone() -> None:
    found = weights(diagnosed("j3"))
    assert list(found) == ["j1 + j2"]
    assert found["j1 + j2"] == pytest.approx(GRAVITY * MASSES_KG[2] * LENGTHS_M[2], rel=0.15)


@pytest.mark.thorough
def test_the_joint_between_has_both_weights() -> None:
    found = weights(diagnosed("j2"))
    assert set(found) == {"j1", "j1 + j3"}
    own = GRAVITY * (MASSES_KG[1] + MASSES_KG[2]) * LENGTHS_M[1]
    assert found["j1"] == pytest.approx(own, rel=0.15)
    assert found["j1 + j3"] == pytest.approx(GRAVITY * MASSES_KG[2] * LENGTHS_M[2], rel=0.15)


@pytest.mark.parametrize("name", a_few(["j1", "j2", "j3"], ["j3"]))
def test_what_is_found_holds_along_another_motion(name: str, tmp_path: Path) -> None:
    """The file that keeps the model, too."""
    found, other = diagnosed(name).model, recorded(2)
    others = {n: found if n == name else replace(found, terms=found.terms[:1]) for n in other.axes}
    save_model(Model(others), tmp_path / "arm.json")
    model = load_model(tmp_path / "arm.json").axes[name]
    t, slides = other.time_s, slice(100, -100)
    motions = {}
    for joint_name, axis in other.axes.items():
        smooth = np.convolve(axis.position, np.hanning(41) / np.hanning(41).sum(), "same")
        speed = np.gradient(smooth, PERIOD_S)
        motions[joint_name] = Motion.known(t, smooth, speed, np.gradient(speed, PERIOD_S))
    along = motions.pop(name)
    effort = other.axes[name].effort[slides]
    left = effort - inverse_effort(model, along, motions)[slides]
    assert np.std(left) < 0.2 * np.std(effort)
