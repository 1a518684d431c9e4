"""A machine that changed between two recordings of a motion is told from one that did not."""

import numpy as np
import pytest
import scipy.stats
from numpy.typing import NDArray

from edge_ident.commissioning import verification
from edge_ident.commissioning.verification import changed_share
from edge_ident.signals.metrics import rms
from edge_ident.signals.recording import AxisRecord

Array = NDArray[np.float64]

TIME_S: Array = np.asarray(0.0025 * np.arange(4000))
LINES = np.array([2.0, 3.1, 5.3])
ANGLE = np.outer(TIME_S, LINES)


def acceleration() -> Array:
    return np.asarray(-(LINES**2 * np.sin(ANGLE)).sum(axis=-1))


def axis(seed: int, inertia: float = 1.0, amplitude: float = 1.0) -> AxisRecord:
    """A multisine on an axis with friction; disturbances last for a quarter of a second."""
    rng = np.random.default_rng(seed)
    position = amplitude * np.sin(ANGLE).sum(axis=-1)
    speed = amplitude * (LINES * np.cos(ANGLE)).sum(axis=-1)
    pushed = np.repeat(0.5 * rng.standard_normal(40), 100)
    effort = inertia * amplitude * acceleration() + 2.0 * speed + 3.0 * np.sign(speed) + pushed
    shown = np.round(position / 1e-4) * 1e-4
    return AxisRecord(shown, effort + 0.1 * rng.standard_normal(len(TIME_S)), "rad", "N*m")


def share(before: AxisRecord, after: AxisRecord) -> float:
    return changed_share((TIME_S, TIME_S), (before, after))


def test_disturbances_are_no_change() -> None:
    """They last nearly as long as the parts that are taken for independent: of 1,000 other seeds,
    27 are a change, of less than 2 % of the effort."""
    found = [share(axis(seed), axis(500 + seed)) for seed in range(40)]
    assert sum(changed > 0.0 for changed in found) <= 3
    assert max(found) < 0.02


def test_the_probability_is_that_of_f() -> None:
    for wald in (1.0, 10.0, 30.0):
        expected = scipy.stats.f.sf(wald / 4.0, 4, 62)
        assert verification._by_chance(wald) == pytest.approx(expected, rel=1e-9)


@pytest.mark.parametrize("inertia", [0.7, 1.25])
def test_another_load_is_a_change(inertia: float) -> None:
    before, after = axis(1), axis(2, inertia)
    expected = abs(inertia - 1.0) * rms(acceleration()) / rms(after.effort)
    assert share(before, after) == pytest.approx(expected, rel=0.1)


def test_a_motion_that_is_followed_otherwise_is_no_change() -> None:
    assert share(axis(1), axis(2, amplitude=0.9)) == 0.0


def test_an_axis_that_stands_still_has_no_change() -> None:
    still = AxisRecord(np.zeros(4000), np.zeros(4000), "rad", "N*m")
    assert share(still, still) == 0.0
