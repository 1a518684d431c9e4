"""What is not written as C: graphs of another kind, and networks that do not fit."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytest.importorskip("onnx")

from edge_ident.errors import ModelError
from edge_ident.estimation.manifest import BUILT_IN
from export.c_source import source as c_source_module
from export.c_source.source import c_source, export_c
from tests.export.c_builds import INT8, changed, replace_constants


def _node(graph: Any, kind: str, number: int = 0) -> Any:
    return [node for node in graph.node if node.op_type == kind][number]


def _operator(graph: Any) -> None:
    _node(graph, "Sigmoid").op_type = "Tanh"


def _padding(graph: Any) -> None:
    attributes = _node(graph, "Conv", 1).attribute
    next(item for item in attributes if item.name == "pads").ints[:] = [1, 1, 1, 1]


def _pooling(graph: Any) -> None:
    attributes = _node(graph, "MaxPool").attribute
    next(item for item in attributes if item.name == "kernel_shape").ints[:] = [3, 3]


def _pooling_one_by_one(graph: Any) -> None:
    attributes = _node(graph, "MaxPool").attribute
    attributes.remove(next(item for item in attributes if item.name == "strides"))


def _not_transposed(graph: Any) -> None:
    attributes = _node(graph, "Gemm", 1).attribute
    attributes.remove(next(item for item in attributes if item.name == "transB"))


def _no_weights(graph: Any) -> None:
    del _node(graph, "Gemm", 2).input[1]


def _weights_zero_point(graph: Any) -> None:
    replace_constants(graph, third_weight_zero_point=np.full(10, 3, np.int8))


def _bias_scale(graph: Any) -> None:
    replace_constants(graph, second_bias_quantized_scale=np.full(10, 1e-3, np.float32))


def _branch(graph: Any) -> None:
    _node(graph, "Relu", 1).input[0] = "relu_3"


def _no_pixels(graph: Any) -> None:
    graph.input[0].type.tensor_type.shape.dim[2].dim_param = "rows"


def _scale(graph: Any) -> None:
    replace_constants(graph, conv2d_1_scale=np.array(-0.01, np.float32))


@pytest.mark.parametrize(
    ("spoil", "cause"),
    [
        (_operator, "operator Tanh"),
        (_padding, r"Conv .* has pads \[1, 1, 1, 1\]"),
        (_pooling, r"MaxPool .* has kernel_shape \[3, 3\]"),
        (_pooling_one_by_one, "MaxPool .* follows first.weight"),
        (_not_transposed, "dense.1.weight does not fit"),
        (_no_weights, "Gemm .* has 0 constants"),
        (_weights_zero_point, "third.weight_quantized has a zero point"),
        (_bias_scale, "second.bias_quantized is not quantized as the sums"),
        (_branch, "Relu .* takes more than what the one before puts out"),
        (_no_pixels, "no fixed size"),
        (_scale, "has the scale -0.0"),
    ],
)
def test_a_graph_of_another_kind_is_refused(spoil: Callable[[Any], None], cause: str) -> None:
    with pytest.raises(ModelError, match=cause):
        c_source(changed(spoil), INT8.name)


def test_a_network_in_float_is_refused(tmp_path: Path) -> None:
    fp32 = BUILT_IN.with_name("feed_drive_fp32.onnx")
    with pytest.raises(ModelError, match=r"second\.weight is a convolution of several"):
        c_source(fp32.read_bytes(), fp32.name)
    with pytest.raises(ModelError, match=r"feed_drive_fp32\.onnx: is not an int8 network"):
        export_c(tmp_path / "out", fp32)
    assert not (tmp_path / "out").exists()


# ---- limits


def test_it_leaves_room_on_a_small_microcontroller() -> None:
    source = c_source(INT8.read_bytes(), INT8.name)
    assert source.sizes.constants_bytes <= 400 * 1024
    assert source.sizes.memory_bytes + source.sizes.image_bytes <= 100_000


def test_a_network_that_is_too_large_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    def more_units(graph: Any) -> None:
        weights = np.ones((120, 3610), np.int8)
        replace_constants(
            graph,
            dense_0_weight_quantized=weights,
            dense_0_weight_scale=np.full(120, 1e-4, np.float32),
            dense_0_weight_zero_point=np.zeros(120, np.int8),
            dense_1_weight=np.ones((100, 120), np.float32),
        )

    with pytest.raises(ModelError, match=r"takes 4\d{5} bytes of constants \(limit 425984\)"):
        c_source(changed(more_units), INT8.name)
    monkeypatch.setattr(c_source_module, "MEMORY_LIMIT_BYTES", 50_000)
    with pytest.raises(ModelError, match=r"bytes of memory \(limit 50000\)"):
        c_source(INT8.read_bytes(), INT8.name)
