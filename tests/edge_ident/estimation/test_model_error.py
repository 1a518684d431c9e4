"""Model error by leaving out regimes: none for a right model, large for a wrong one."""

import numpy as np
import pytest

from edge_ident.estimation import least_squares
from edge_ident.estimation.effort_checks import (
    SMALLEST_EXCESS,
    RegimeSpread,
    regime_spread,
    unnoticed_error,
)
from edge_ident.estimation.least_squares import Columns

TIME = 0.01 * np.arange(2000)
POSITION = np.sin(1.7 * TIME) + 0.4 * np.sin(4.3 * TIME + 1.0)
VELOCITY = 1.7 * np.cos(1.7 * TIME) + 1.72 * np.cos(4.3 * TIME + 1.0)
ACCELERATION = -(1.7**2) * np.sin(1.7 * TIME) - 0.4 * 4.3**2 * np.sin(4.3 * TIME + 1.0)
REGRESSOR = np.column_stack([ACCELERATION, VELOCITY, np.sign(VELOCITY), np.ones(2000)])
TRUTH = np.array([0.4, 0.9, 1.4, 0.05])


def spread(effort: np.ndarray) -> RegimeSpread:
    regimes = (np.abs(VELOCITY), POSITION, TIME, ACCELERATION)
    std = least_squares.solve(Columns(REGRESSOR), effort).std
    return regime_spread(REGRESSOR, effort, regimes, std)


def noisy(seed: int) -> np.ndarray:
    return REGRESSOR @ TRUTH + 0.05 * np.random.default_rng(seed).standard_normal(len(TIME))


def test_an_exact_model_does_not_care_which_regime_is_left_out() -> None:
    found = spread(REGRESSOR @ TRUTH)
    assert np.all(found.largest_move < 1e-8)
    assert np.all(found.model_error < 1e-8)


def test_noise_alone_is_hardly_any_model_error() -> None:
    """What noise makes of the moves is taken off: the rest is at most about its own deviation."""
    ratio = []
    for seed in range(20):
        std = least_squares.solve(Columns(REGRESSOR), noisy(seed)).std
        ratio.append(spread(noisy(seed)).model_error / std)
    assert np.median(ratio) < 1.0
    assert np.quantile(ratio, 0.9) < 3.0


@pytest.mark.parametrize(
    ("lacking", "index"),
    [(0.3 * np.exp(-((VELOCITY / 0.3) ** 2)) * np.sign(VELOCITY), 2), (0.2 * VELOCITY**3, 1)],
)
def test_a_wrong_model_has_an_error_as_large_as_its_bias(lacking: np.ndarray, index: int) -> None:
    effort = noisy(1) + lacking
    found = spread(effort)
    bias = abs(least_squares.solve(Columns(REGRESSOR), effort).parameters[index] - TRUTH[index])
    assert found.significance[index] > 4.0
    assert bias < 3.0 * found.model_error[index]


def test_what_one_regime_alone_shows_is_no_model_error() -> None:
    """The inertia shows in one quarter of the record alone: without it, noise decides."""
    regressor = REGRESSOR.copy()
    regressor[500:, 0] *= 1e-3
    effort = regressor @ TRUTH + 0.05 * np.random.default_rng(3).standard_normal(len(TIME))
    std = least_squares.solve(Columns(regressor), effort).std
    found = regime_spread(regressor, effort, (TIME,), std)
    assert found.largest_move[0] > 5.0 * std[0]
    assert found.model_error[0] < 0.5 * found.largest_move[0]


def test_what_is_not_noticed_moves_parameters_as_far_as_is_said() -> None:
    """Structures of every size up to the least that is noticed, along all columns alike."""
    rng = np.random.default_rng(4)
    effort = REGRESSOR @ TRUTH
    basis = np.linalg.qr(REGRESSOR)[0]
    moves = []
    for size in SMALLEST_EXCESS * rng.uniform(size=500):
        lacking = basis @ rng.standard_normal(4) * size * np.linalg.norm(effort)
        moves.append(np.linalg.lstsq(REGRESSOR, lacking, rcond=None)[0])
    said = unnoticed_error(REGRESSOR, effort)
    assert np.sqrt(np.mean(np.square(moves), axis=0)) == pytest.approx(said, rel=0.15)
