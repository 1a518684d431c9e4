"""Rounding a dense layer so that its outputs stay."""

import numpy as np
import onnx

from edge_ident.estimation.manifest import BUILT_IN
from export.rounding import SPARED_BITS, round_to_grid, with_spared_bits


def test_rounding_keeps_outputs_where_rounding_each_weight_does_not() -> None:
    """Inputs of low rank: errors of one weight can be made up for by others."""
    rng = np.random.default_rng(0)
    features = rng.normal(size=(400, 8)) @ rng.normal(size=(8, 120))
    weights = rng.normal(size=(5, 120))
    scales = np.max(np.abs(weights), axis=1) / 7.0
    nearest = np.clip(np.round(weights / scales[:, None]), -127, 127)
    rounded = round_to_grid(weights, scales, features.T @ features, 1e-2)

    def error(grid: np.ndarray) -> float:
        return float(np.linalg.norm(features @ (grid * scales[:, None] - weights).T))

    assert rounded.dtype == np.int8
    assert error(rounded) < 0.3 * error(nearest)


def test_weights_on_the_grid_stay_as_they_are() -> None:
    rng = np.random.default_rng(0)
    grid = rng.integers(-127, 128, size=(3, 40))
    features = rng.normal(size=(100, 40))
    rounded = round_to_grid(0.01 * grid, np.full(3, 0.01), features.T @ features, 1e-2)
    np.testing.assert_array_equal(rounded, grid)


def test_spared_bits_are_zero_and_change_no_weight_by_more_than_half_of_one() -> None:
    weights = np.random.default_rng(3).normal(size=(7, 11)).astype(np.float32)
    graph = onnx.helper.make_graph([], "one", [], [], [onnx.numpy_helper.from_array(weights, "w")])
    rounded = with_spared_bits(onnx.helper.make_model(graph))
    found = onnx.numpy_helper.to_array(rounded.graph.initializer[0])
    assert not np.any(found.view(np.uint32) % (1 << SPARED_BITS))
    assert np.max(np.abs(found / weights - 1.0)) <= 2.0 ** (SPARED_BITS - 24)
    assert with_spared_bits(rounded) == rounded


def test_the_built_in_network_is_rounded_so() -> None:
    model = onnx.load(BUILT_IN.with_name("feed_drive_fp32.onnx"))
    assert with_spared_bits(model).SerializeToString() == model.SerializeToString()
