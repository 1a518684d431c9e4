"""The paper's loop with the package's network, and with stand-ins whose answers are known."""

import numpy as np
import pytest
from numpy.typing import NDArray

from edge_ident.cnn import identify, motion_mismatch
from edge_ident.errors import DataError
from edge_ident.image import effort_scale
from edge_ident.network import VARIANTS, Variant, load_network

Array = NDArray[np.float64]

FEED_DRIVE = np.array([0.12, 0.27, 0.45, 0.03])
"""N·m·s²/rad, N·m·s/rad, N·m, N·m: friction about even, little inertia, as on a slow screw."""
NETWORK = load_network("fp32")
COLUMNS = NETWORK.manifest.motion.columns
SCALES = NETWORK.manifest.motion.column_scales


class StandIn:
    """Answers with a function of the guess instead of a network; counts its passes."""

    def __init__(self, truth_nm: Array, answer: str) -> None:
        self.manifest, self.variant = NETWORK.manifest, NETWORK.variant
        effort = COLUMNS @ truth_nm
        self._measured = effort / effort_scale(effort, "effort-scale")
        self._truth = truth_nm * SCALES / effort_scale(effort, "effort-scale")
        self._answer = answer
        self.passes = 0

    def residual_shares(self, images: NDArray[np.float32]) -> Array:
        self.passes += len(images)
        if self._answer == "nothing":
            return np.zeros((1, 4))
        model = images[0, 0] @ self._measured / (self._measured @ self._measured)
        guess = np.linalg.lstsq(COLUMNS / SCALES, model, rcond=None)[0]
        residual = guess - self._truth
        return (3.0 * residual if self._answer == "too much" else residual)[None]


@pytest.mark.parametrize("variant", VARIANTS)
@pytest.mark.parametrize("unit", [1e-3, 1.0, 1e3])
def test_identifies_a_feed_drive_at_any_scale(variant: Variant, unit: float) -> None:
    truth = unit * FEED_DRIVE
    found = identify(COLUMNS, COLUMNS @ truth, load_network(variant))
    assert found.trusted
    assert found.passes <= 8
    assert found.relative_residual < 0.02
    assert found.time_spectral > 0.99
    np.testing.assert_allclose(found.parameters / unit, FEED_DRIVE, atol=0.02)


def test_errors_agree_with_the_stated_deviations() -> None:
    rng = np.random.default_rng(11)
    ratios = []
    for seed in range(40):
        truth = rng.uniform([0.05, 0.1, 0.1, -0.2], [1.0, 1.0, 1.0, 0.2])
        effort = COLUMNS @ truth
        found = identify(COLUMNS, effort + 0.002 * rng.normal(size=100), NETWORK, seed=seed)
        ratios.append((found.parameters - truth) / found.std)
    assert 0.2 < np.sqrt(np.mean(np.square(ratios))) < 2.0


def test_a_perfect_answer_takes_one_pass() -> None:
    stand_in = StandIn(FEED_DRIVE, "exact")
    found = identify(COLUMNS, COLUMNS @ FEED_DRIVE, stand_in)  # type: ignore[arg-type]
    assert found.passes == stand_in.passes == 1
    np.testing.assert_allclose(found.parameters, FEED_DRIVE, atol=1e-4)


def test_a_step_that_goes_too_far_is_halved() -> None:
    stand_in = StandIn(FEED_DRIVE, "too much")
    found = identify(COLUMNS, COLUMNS @ FEED_DRIVE, stand_in)  # type: ignore[arg-type]
    assert found.relative_residual < 0.02


def test_a_useless_network_is_not_trusted_and_gets_no_more_passes_than_allowed() -> None:
    stand_in = StandIn(FEED_DRIVE, "nothing")
    found = identify(COLUMNS, COLUMNS @ FEED_DRIVE, stand_in, passes=5)  # type: ignore[arg-type]
    assert stand_in.passes == found.passes == 5
    assert not found.trusted
    assert "misses" in found.reason


def test_what_physics_forbids_never_comes_out() -> None:
    negative_friction = FEED_DRIVE * np.array([1.0, -1.0, 1.0, 1.0])
    found = identify(COLUMNS, COLUMNS @ negative_friction, NETWORK)
    assert np.all(found.parameters[:3] > 0.0)
    assert not found.trusted


def test_the_seed_alone_decides() -> None:
    effort = COLUMNS @ FEED_DRIVE
    first, again, other = (identify(COLUMNS, effort, NETWORK, seed=s) for s in (4, 4, 5))
    np.testing.assert_array_equal(first.parameters, again.parameters)
    assert not np.array_equal(first.parameters, other.parameters)


def test_no_effort_is_an_error() -> None:
    with pytest.raises(DataError, match="zero throughout"):
        identify(COLUMNS, np.zeros(100), NETWORK)


def test_mismatch_is_zero_for_its_own_motion_and_large_for_another() -> None:
    limit = NETWORK.manifest.mismatch_limit
    assert motion_mismatch(COLUMNS, NETWORK) == 0.0
    assert motion_mismatch(COLUMNS * [1.02, 1.02, 1.0, 1.0], NETWORK) < limit
    quarter_period_late = np.roll(COLUMNS, 25, axis=0)
    assert motion_mismatch(quarter_period_late, NETWORK) > limit
