"""Rounding a dense layer so that its outputs stay."""

import numpy as np

from export.rounding import round_to_grid


def test_rounding_keeps_outputs_where_rounding_each_weight_does_not() -> None:
    """Inputs of low rank: errors of one weight can be made up for by others."""
    rng = np.random.default_rng(0)
    features = rng.normal(size=(400, 8)) @ rng.normal(size=(8, 120))
    weights = rng.normal(size=(5, 120))
    scales = np.max(np.abs(weights), axis=1) / 7.0
    nearest = np.clip(np.round(weights / scales[:, None]), -127, 127)
    rounded = round_to_grid(weights, scales, features, 1e-2)

    def error(grid: np.ndarray) -> float:
        return float(np.linalg.norm(features @ (grid * scales[:, None] - weights).T))

    assert rounded.dtype == np.int8
    assert error(rounded) < 0.3 * error(nearest)


def test_weights_on_the_grid_stay_as_they_are() -> None:
    rng = np.random.default_rng(0)
    grid = rng.integers(-127, 128, size=(3, 40))
    rounded = round_to_grid(0.01 * grid, np.full(3, 0.01), rng.normal(size=(100, 40)), 1e-2)
    np.testing.assert_array_equal(rounded, grid)
