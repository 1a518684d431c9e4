"""Static int8 quantization of a trained network, from the second convolution to the first dense
layer: 97 % of all weights.

What stays in floating point costs accuracy and saves little: the first convolution would see the
image in 256 levels (which moves the parameters by 5 %), the second dense layer brings another
0.3 %, and behind the last one outputs become a staircase.
"""

import copy
import tempfile
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any, Final

import numpy as np
import onnx
import torch
from numpy.typing import NDArray
from onnx import numpy_helper
from onnxruntime.quantization import CalibrationDataReader, QuantFormat, QuantType, quantize_static
from torch import Tensor
from torch.nn import functional

from export.data import Batch
from export.network import ResidualNetwork, bias_of
from export.rounding import round_to_grid

Array = NDArray[np.float64]

DAMPING: Final = 1e-2
"""Damping of the rounding: larger values rely less on the images it is fitted to."""
EQUALIZED_IMAGES: Final = 1024
"""Whose maps are made of one range."""
PATCHES_OF: Final = 4
"""Images of a batch that give inputs of the convolutions: more than a thousand each."""


class _Images(CalibrationDataReader):  # type: ignore[misc]
    """Real images, one after the other."""

    def __init__(self, name: str, images: NDArray[np.float32]) -> None:
        self._feeds: Iterator[dict[str, Any]] = iter([{name: image[None]} for image in images])

    def get_next(self) -> dict[str, Any] | None:
        return next(self._feeds, None)


def equalized(network: ResidualNetwork, batches: Iterable[Batch]) -> ResidualNetwork:
    """The same function, with maps of one range behind the second and the third convolution.

    All maps of a layer share one grid of 256 levels, and the largest of them decides its width. A
    factor on a map passes through ReLU and pooling, and the next layer's weights take it back
    (Nagel et al., Data-free quantization, 2019).

    Parameters
    ----------
    network : ResidualNetwork
    batches : iterable of Batch
        Real examples.
    """
    result = copy.deepcopy(network)
    with torch.no_grad():
        largest = [
            [maps.amax(dim=(0, 2, 3)) for maps in network.maps(*batch.factors)[1:]]
            for batch in batches
        ]
        two, three = (_factors(torch.stack(of).amax(dim=0)) for of in zip(*largest, strict=True))
        each = result.dense_layer(0).in_features // len(three)
        for layer, factors in ((result.second, two), (result.third, three)):
            layer.weight.mul_(factors[:, None, None, None])
            bias_of(layer).mul_(factors)
        result.third.weight.div_(two[:, None, None])
        result.dense_layer(0).weight.div_(three.repeat_interleave(each))
    return result


def _factors(largest: Tensor) -> Tensor:
    """What gives every map the largest one's range; a map without values stays."""
    return torch.where(largest > 0.0, largest.max() / largest, torch.ones(()))


def input_moments(network: ResidualNetwork, batches: Iterable[Batch]) -> dict[str, Array]:
    """X'X of the inputs X of each layer that is quantized, by the name of its weights.

    Parameters
    ----------
    network : ResidualNetwork
    batches : iterable of Batch
        Real examples; the first dense layer needs more of them than its 3610 inputs.

    Returns
    -------
    dict of (inputs, inputs) arrays
    """
    patches: dict[str, list[Tensor]] = {"second.weight": [], "third.weight": []}
    features = []
    with torch.no_grad():
        for batch in batches:
            *inputs, last = network.maps(*batch.factors)
            features.append(last.flatten(1))
            for of, maps, layer in zip(
                patches.values(), inputs, (network.second, network.third), strict=True
            ):
                size = layer.kernel_size
                seen = functional.unfold(maps[:PATCHES_OF], size).transpose(1, 2).flatten(0, 1)
                of.append(seen.T @ seen)
        every = torch.cat(features)
        moments = {name: torch.stack(of).sum(dim=0) for name, of in patches.items()}
        moments["dense.0.weight"] = every.T @ every
    return {name: moment.numpy().astype(np.float64) for name, moment in moments.items()}


def quantize(
    model: onnx.ModelProto, images: NDArray[np.float32], moments: Mapping[str, Array]
) -> onnx.ModelProto:
    """Quantize an exported network.

    Parameters
    ----------
    model : onnx.ModelProto
        Of a network with equalized maps.
    images : (n, 1, 100, 100) float32 array
        Real ones, for the ranges of activations.
    moments : mapping of (inputs, inputs) arrays
        Of the network's `input_moments`, for the rounding of the weights.
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
    _round_again(model, quantized, moments)
    return quantized


def _kept_in_float(model: onnx.ModelProto) -> list[str]:
    """All before the second convolution and behind the first dense layer's ReLU."""
    nodes = list(model.graph.node)
    convolutions = [index for index, node in enumerate(nodes) if node.op_type == "Conv"]
    dense = [index for index, node in enumerate(nodes) if node.op_type == "Gemm"]
    return [node.name for node in nodes[: convolutions[1]] + nodes[dense[0] + 2 :]]


def _round_again(
    model: onnx.ModelProto, quantized: onnx.ModelProto, moments: Mapping[str, Array]
) -> None:
    """Round weights again, on the grids that were chosen for them."""
    weights = {item.name: item for item in model.graph.initializer}
    parts = {item.name: item for item in quantized.graph.initializer}
    for name, moment in moments.items():
        scales = numpy_helper.to_array(parts[f"{name}_scale"]).astype(np.float64)
        exact = numpy_helper.to_array(weights[name]).astype(np.float64)
        flat = exact.reshape(len(exact), -1)
        rounded = round_to_grid(flat, scales, moment, DAMPING).reshape(exact.shape)
        parts[f"{name}_quantized"].CopyFrom(numpy_helper.from_array(rounded, f"{name}_quantized"))
