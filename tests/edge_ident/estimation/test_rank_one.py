"""From both efforts, the network answers what it answers from their image."""

from dataclasses import replace
from functools import partial

import numpy as np
import pytest
from numpy.typing import NDArray

from edge_ident.estimation.image import Normalization, effort_image, effort_scale
from edge_ident.estimation.manifest import BUILT_IN, VARIANTS, Variant, load_manifest
from edge_ident.estimation.network import Network
from edge_ident.estimation.rank_one import BATCH, GRAPH, FirstLayer, divided, fields, messages
from edge_ident.signals.metrics import rms

Array = NDArray[np.float64]

PARITY = 32 * np.finfo(np.float32).eps
"""Of the sigmoid's outputs, 4e-6: single precision, summed in another order. Without AVX-512 they
are up to 2.1e-6 apart, and either network is as near to sums in double precision."""
TYPICAL = 1e-6
"""Root of the mean square of the same."""


def content(variant: Variant = "fp32") -> bytes:
    return BUILT_IN.with_name(f"feed_drive_{variant}.onnx").read_bytes()


def network(variant: Variant, normalization: Normalization = "effort-scale") -> Network:
    manifest = replace(load_manifest(BUILT_IN), normalization=normalization)
    return Network(partial(content, variant), manifest, variant, "rank_one")


def efforts(seed: int, starts: int, measured: int) -> tuple[Array, Array]:
    """Of models on the network's motion, and of drives with noise, over their scales."""
    rng = np.random.default_rng(seed)
    motion = load_manifest(BUILT_IN).motion
    columns = (motion.regressor / motion.column_scales).T
    model = rng.uniform([0.0, 0.0, 0.0, -1.0], 1.0, (starts, 4)) @ columns
    effort = rng.uniform(-1.0, 1.0, (measured, 4)) @ columns
    effort += 0.05 * rng.normal(size=effort.shape)
    return model, effort / effort_scale(effort, "effort-scale")[:, None]


def outputs(residuals: Array) -> Array:
    return np.asarray(1.0 / (1.0 + np.exp(-residuals)))


def assert_alike(found: Array, wanted: Array) -> None:
    np.testing.assert_allclose(found, wanted, rtol=0.0, atol=PARITY)
    assert rms(found - wanted) < TYPICAL


@pytest.mark.parametrize("normalization", ["effort-scale", "min-max"])
@pytest.mark.parametrize(("starts", "measured"), [(1, 1), (2, 2), (3 * BATCH + 1, 3 * BATCH + 1)])
def test_pairs_of_efforts_give_what_their_images_give(
    starts: int, measured: int, normalization: Normalization
) -> None:
    read = network("fp32", normalization)
    model, effort = efforts(1, starts, measured)
    images = effort_image(model, effort, normalization)
    assert_alike(outputs(read.residuals_of(model, effort)), outputs(read.residual_shares(images)))


def test_a_network_that_gave_its_memory_back_is_loaded_again() -> None:
    read = network("fp32")
    before = read.residuals_of(*efforts(1, 2, 2))
    read.unload()
    np.testing.assert_array_equal(read.residuals_of(*efforts(1, 2, 2)), before)


def test_many_starts_share_one_measurement() -> None:
    read = network("fp32")
    model, effort = efforts(2, 64, 1)
    found = outputs(read.residuals_of(model, effort))
    images = effort_image(model, effort, "effort-scale")
    assert_alike(found, outputs(read.residual_shares(images)))
    np.testing.assert_array_equal(
        read.residuals_of(model, effort[0]), read.residuals_of(model, effort)
    )


def test_the_next_efforts_are_not_taken_for_the_last() -> None:
    """A factor is kept while its effort stays the same, also where the array is written anew."""
    read = network("fp32")
    model, effort = efforts(3, 2, 2)
    first = read.residuals_of(model, effort)
    again = effort.copy()
    again[1] *= -1.0
    other = read.residuals_of(model, again)
    np.testing.assert_array_equal(other[0], first[0])
    assert np.max(np.abs(other[1] - first[1])) > 0.1
    again[1] *= -1.0
    np.testing.assert_array_equal(read.residuals_of(model, again), first)


@pytest.mark.parametrize("variant", VARIANTS)
def test_int8_and_fp32_begin_with_the_same_layer(variant: Variant) -> None:
    """The first convolution stays in floating point, so both have the graph."""
    parts = divided(content(variant))
    assert parts is not None
    layer, rest = parts
    assert layer.shape == (10, 46, 46)
    assert len(rest) < len(content(variant))


@pytest.mark.parametrize("opposite", [False, True])
def test_the_first_layer_is_a_convolution_with_bias_and_a_maximum(opposite: bool) -> None:
    """Against sums over every window of the image; also where kernels come in opposite pairs."""
    rng = np.random.default_rng(4)
    kernels, bias = rng.normal(size=(4, 7, 9)), rng.normal(size=4)
    if opposite:
        kernels[1::2] = -kernels[::2]
    model, measured = rng.normal(size=(2, 100)), rng.normal(size=(2, 100))
    offset = np.array([0.0, 0.7])
    layer = FirstLayer(kernels, bias)
    of_model = layer.of_model(model)
    assert of_model.shape[2] == (2 if opposite else 4)
    found = layer.output(of_model, layer.of_measured(measured), offset)
    images = model[:, :, None] * measured[:, None, :] + offset[:, None, None]
    windows = np.lib.stride_tricks.sliding_window_view(images, (7, 9), axis=(1, 2))
    full = np.einsum("nijpq,kpq->nkij", windows, kernels) + bias[:, None, None]
    squares = full.reshape(2, 4, 47, 2, 46, 2).max(axis=(3, 5))
    np.testing.assert_allclose(found, squares, atol=1e-5)


def test_a_file_that_is_no_onnx_is_not_divided() -> None:
    for other in (b"", b"no protocol buffer", content()[:1000]):
        assert divided(other) is None


def begins_with(
    attributes: dict[str, object], pooling: str = "MaxPool", channels: int = 1
) -> bytes:
    """A graph of a convolution and a pooling."""
    onnx = pytest.importorskip("onnx")
    helper = onnx.helper
    weights = np.zeros((2, channels, 9, 9), np.float32)
    pool = {"kernel_shape": [2, 2], "strides": [2, 2], "pads": [0] * 4, "dilations": [1, 1]}
    if pooling == "MaxPool":
        pool["ceil_mode"] = 0
    graph = helper.make_graph(
        [
            helper.make_node("Conv", ["image", "weights"], ["maps"], **attributes),
            helper.make_node(pooling, ["maps"], ["pooled"], **pool),
        ],
        "begin",
        [helper.make_tensor_value_info("image", 1, ["n", channels, 100, 100])],
        [helper.make_tensor_value_info("pooled", 1, None)],
        [onnx.numpy_helper.from_array(weights, "weights")],
    )
    return bytes(helper.make_model(graph).SerializeToString())


PLAIN = {"group": 1, "pads": [0] * 4, "strides": [1, 1], "dilations": [1, 1]}


def test_only_a_plain_convolution_with_a_maximum_over_squares_is_divided() -> None:
    assert divided(begins_with(PLAIN)) is not None
    for change in ({"strides": [2, 2]}, {"pads": [1] * 4}, {"dilations": [2, 2]}):
        assert divided(begins_with(PLAIN | change)) is None
    assert divided(begins_with(PLAIN, pooling="AveragePool")) is None
    assert divided(begins_with(PLAIN, channels=2)) is None


def test_what_is_left_of_the_graph_is_whole() -> None:
    onnx = pytest.importorskip("onnx")
    parts = divided(content())
    assert parts is not None
    model = onnx.load_from_string(parts[1])
    onnx.checker.check_model(model)
    assert [node.op_type for node in model.graph.node][:2] == ["Relu", "Conv"]
    assert [item.name for item in model.graph.input] == ["max_pool2d"]


def test_a_file_is_read_without_a_copy_of_its_weights() -> None:
    file = content()
    (graph,) = messages(fields(file), GRAPH)
    assert isinstance(graph, memoryview)
    assert graph.obj is file
