"""Random drives: scaled alike, physical, and guesses at them from near and far."""

import numpy as np
import pytest

from edge_ident.estimation.image import effort_scale
from export.drives import FAMILIES, PROPORTIONS, as_shares, efforts, guesses, mixture
from export.motion import paper_motion

SHAPES = paper_motion().scaled_regressor(100)


@pytest.mark.parametrize("name", FAMILIES)
def test_shares_give_efforts_of_scale_one_with_physical_signs(name: str) -> None:
    rng = np.random.default_rng(2)
    shares = as_shares(SHAPES, FAMILIES[name](rng, 200), "effort-scale")
    np.testing.assert_allclose(effort_scale(efforts(SHAPES, shares), "effort-scale"), 1.0)
    assert np.all(shares[:, :3] > 0.0)
    assert np.any(shares[:, 3] > 0.0)
    assert np.any(shares[:, 3] < 0.0)


def test_efforts_are_columns_times_shares_one_motion_or_one_each() -> None:
    rng = np.random.default_rng(2)
    shares, columns = rng.normal(size=(3, 4)), rng.normal(size=(3, 100, 4))
    for number, effort in enumerate(efforts(columns, shares)):
        np.testing.assert_allclose(effort, columns[number] @ shares[number])
    np.testing.assert_allclose(efforts(columns[0], shares), shares @ columns[0].T)


def test_the_mixture_holds_every_family() -> None:
    """Real feed drives have little inertia, corners most of one term."""
    assert sum(PROPORTIONS.values()) == pytest.approx(1.0)
    raw = mixture(np.random.default_rng(2), 4000)
    shares = np.abs(raw) / np.abs(raw).sum(axis=1, keepdims=True)
    for parameter in range(4):
        assert np.mean(shares[:, parameter] > 0.9) > 0.005
    assert np.mean(shares[:, 0] < 0.1) > 0.2


def test_guesses_are_near_and_far_and_unphysical_too() -> None:
    rng = np.random.default_rng(2)
    truth = as_shares(SHAPES, mixture(rng, 3000), "effort-scale")
    guess = guesses(rng, truth)
    distance = np.linalg.norm(guess - truth, axis=1)
    assert np.mean(distance < 0.01) > 0.1
    assert np.mean(distance > 0.5) > 0.2
    assert np.any(guess[:, :3] < 0.0)
