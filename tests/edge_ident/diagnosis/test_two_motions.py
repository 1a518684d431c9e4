"""One drive on two motions, a multisine and moves from point to point with rests.

The base model misses a little of the moves, too little to name: they are up to a sample shorter
than their effort says. What differs between the recordings is named for what it is all the same.
"""

import numpy as np
import pytest
from numpy.typing import NDArray

from edge_ident.diagnosis.diagnose import diagnose
from edge_ident.diagnosis.result import AxisDiagnosis
from edge_ident.signals.recording import AxisRecord, Recording
from tests.repetitions import a_few

Array = NDArray[np.float64]

TIME_S = np.arange(0.0, 20.0, 2e-3)
COUNT = 2.0 * np.pi / 2**18
DRIVE = {"inertia": 0.4, "viscous": 1.5, "coulomb": 2.0, "offset": 0.3, "square": 0.0}
HZ = np.array([0.1, 0.3, 0.5, 0.7, 1.1, 1.3, 1.7])


def multisine(rng: np.random.Generator) -> Array:
    """Position, velocity and acceleration (3, N)."""
    w = 2.0 * np.pi * HZ
    angle = w * TIME_S[:, None] + rng.uniform(0.0, 2.0 * np.pi, len(HZ))
    sizes = 1.5 / np.sqrt(len(HZ)) / (1.0 + HZ)
    return np.array(
        [np.sin(angle) @ sizes, np.cos(angle) @ (sizes * w), -np.sin(angle) @ (sizes * w**2)]
    )


def moves(rng: np.random.Generator) -> Array:
    """The same of moves of least jerk, each with a rest after it."""
    found, here, begin_s = np.zeros((3, len(TIME_S))), 0.0, 0.0
    while begin_s < TIME_S[-1]:
        way, took_s = rng.uniform(-2.2, 2.2) - here, rng.uniform(0.4, 0.9)
        s = np.clip((TIME_S - begin_s) / (took_s - took_s % 2e-3), 0.0, 1.0)
        found[0] += way * (10.0 * s**3 - 15.0 * s**4 + 6.0 * s**5)
        found[1] += way * (30.0 * s**2 - 60.0 * s**3 + 30.0 * s**4) / took_s
        found[2] += way * (60.0 * s - 180.0 * s**2 + 120.0 * s**3) / took_s**2
        here, begin_s = here + way, begin_s + took_s + rng.uniform(0.1, 0.5)
    return found


def recorded(seed: int, name: str, scale: float = 1.0, **changed: float) -> Recording:
    """The drive, with what was changed of it, on a motion of this name."""
    rng, p = np.random.default_rng(seed), {**DRIVE, **changed}
    q, v, a = multisine(rng) if name == "multisine" else moves(rng)
    moving = np.abs(v) > 1e-9
    rest = np.cumsum(np.diff(moving, prepend=False) != 0)
    held = rng.uniform(-0.7, 0.7, rest[-1] + 1)[rest]
    effort = p["inertia"] * a + p["viscous"] * v + p["square"] * v * np.abs(v) + p["offset"]
    effort += p["coulomb"] * np.where(moving, np.sign(v), held)
    effort += 0.03 * rng.standard_normal(len(TIME_S))
    axis = AxisRecord(COUNT * np.round(q / COUNT), scale * effort, "rad", "N*m")
    return Recording(TIME_S, {"x": axis}, f"{name}.csv")


def diagnosed(*recordings: Recording) -> AxisDiagnosis:
    return diagnose(recordings).axes["x"]


def codes(axis: AxisDiagnosis) -> set[str]:
    return {finding.code for finding in axis.findings}


@pytest.mark.parametrize("seed", a_few([1, 2], [2]))
def test_a_twentieth_of_all_is_another_scale_and_no_payload(seed: int) -> None:
    axis = diagnosed(recorded(seed, "multisine"), recorded(10 + seed, "moves", scale=1.05))
    assert axis.causes == ()
    (finding,) = [finding for finding in axis.findings if finding.code == "scale_differs"]
    assert "the effort of moves.csv is 1.05 times" in finding.message


def test_a_twentieth_more_of_inertia_is_a_payload() -> None:
    axis = diagnosed(recorded(1, "multisine"), recorded(11, "moves", inertia=0.42))
    assert [cause.term.effect for cause in axis.causes] == ["payload_change"]
    assert "scale_differs" not in codes(axis)


@pytest.mark.parametrize("seed", a_few([1, 2], [1]))
def test_dry_friction_that_changed_alone_is_no_payload(seed: int) -> None:
    axis = diagnosed(recorded(seed, "multisine"), recorded(10 + seed, "moves", coulomb=1.4))
    assert axis.causes == ()
    assert "friction_differs" in codes(axis)


@pytest.mark.thorough
def test_a_friction_that_a_curve_shares_may_differ() -> None:
    """Beside the curve the viscous friction of one may be negative: only the sum takes power."""
    axis = diagnosed(
        recorded(4, "multisine", square=0.5), recorded(14, "moves", square=0.5, viscous=0.9)
    )
    assert [cause.term.effect for cause in axis.causes] == ["nonlinear_viscous"]
    assert "friction_differs" in codes(axis)
    assert "scale_differs" not in codes(axis)
