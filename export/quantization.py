"""Static int8 quantization of an exported network."""

import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any, Final

import numpy as np
import onnx
from numpy.typing import NDArray
from onnx import numpy_helper
from onnxruntime.quantization import CalibrationDataReader, QuantFormat, QuantType, quantize_static

from export.rounding import round_to_grid

DAMPING: Final = 1e-2
"""Damping of the rounding: larger values rely less on the images it is fitted to."""


class _Images(CalibrationDataReader):  # type: ignore[misc]
    """Real images, one after the other."""

    def __init__(self, name: str, images: NDArray[np.float32]) -> None:
        self._feeds: Iterator[dict[str, Any]] = iter([{name: image[None]} for image in images])

    def get_next(self) -> dict[str, Any] | None:
        return next(self._feeds, None)


def quantize(
    model: onnx.ModelProto, images: NDArray[np.float32], features: NDArray[np.float64]
) -> onnx.ModelProto:
    """Quantize from the second convolution to the first dense layer, 97 % of all weights.

    What stays in floating point costs accuracy and saves little: the first convolution would
    see the image in 256 levels (which moves the parameters by 5 %), the second dense layer
    brings another 0.3 %, and behind the last one outputs become a staircase.

    Parameters
    ----------
    model : onnx.ModelProto
    images : (n, 1, 100, 100) float32 array
        Real ones, for the ranges of activations.
    features : (m, 3610) array
        What the convolutions put out for real images, for the rounding of the first dense layer.
    """
    with tempfile.TemporaryDirectory() as folder:
        source, target = Path(folder) / "fp32.onnx", Path(folder) / "int8.onnx"
        onnx.save(model, source)
        quantize_static(
            source,
            target,
            _Images(model.graph.input[0].name, images),
            quant_format=QuantFormat.QDQ,
            per_channel=True,
            activation_type=QuantType.QInt8,
            weight_type=QuantType.QInt8,
            nodes_to_exclude=_kept_in_float(model),
        )
        quantized = onnx.load(target)
    _round_first_dense(model, quantized, features)
    return quantized


def _kept_in_float(model: onnx.ModelProto) -> list[str]:
    """All before the second convolution and behind the first dense layer's ReLU."""
    nodes = list(model.graph.node)
    convolutions = [index for index, node in enumerate(nodes) if node.op_type == "Conv"]
    dense = [index for index, node in enumerate(nodes) if node.op_type == "Gemm"]
    return [node.name for node in nodes[: convolutions[1]] + nodes[dense[0] + 2 :]]


def _round_first_dense(
    model: onnx.ModelProto, quantized: onnx.ModelProto, features: NDArray[np.float64]
) -> None:
    """Round the first dense layer's weights again, on the grid that was chosen for them."""
    name = next(node.input[1] for node in model.graph.node if node.op_type == "Gemm")
    weights = {item.name: item for item in model.graph.initializer}[name]
    parts = {item.name: item for item in quantized.graph.initializer}
    scales = numpy_helper.to_array(parts[f"{name}_scale"]).astype(np.float64)
    exact = numpy_helper.to_array(weights).astype(np.float64)
    rounded = round_to_grid(exact, scales, features, DAMPING)
    parts[f"{name}_quantized"].CopyFrom(numpy_helper.from_array(rounded, f"{name}_quantized"))
