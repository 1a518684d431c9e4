"""From the chain of operators to layers: each product of weights with what follows it."""

from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from export.c_source.graph import Constant, Operator, read_chain, refused
from export.c_source.layers import HIGHEST, LOWEST, POOL, Layer, Quantization

_ALL_LEVELS: Final = np.arange(LOWEST, HIGHEST + 1).astype(np.int8)
_LARGEST_SUM: Final = 2**31 - 1
# Tolerance of a bias' scale: the quantizer multiplies two other scales in float.
_SCALE_TOLERANCE: Final = 1e-5


def read_layers(content: bytes) -> tuple[Layer, ...]:
    """The layers of a network that ends with a dense layer and its sigmoid.

    Raises
    ------
    ModelError
        If the network is not of the kind that edge-ident exports.
    """
    shape, operators = read_chain(content)
    if not operators or operators[-1].kind != "Sigmoid":
        raise refused("its last operator is not Sigmoid")
    layers = []
    tensor = _Tensor(shape)
    for group in _groups(operators[:-1]):
        layer, tensor = _layer(group, tensor)
        layers.append(layer)
    if layers[-1].output is not None or layers[-1].convolution:
        raise refused("its sigmoid does not follow a dense layer in float")
    return tuple(layers)


@dataclass(frozen=True)
class _Tensor:
    """What one layer hands to the next: its shape, and its quantization where it has one."""

    shape: tuple[int, ...]
    quantization: Quantization | None = None


def _groups(operators: Iterable[Operator]) -> list[list[Operator]]:
    """Operators by layer; the first of each multiplies by weights."""
    groups: list[list[Operator]] = []
    for operator in operators:
        if operator.kind in ("Conv", "Gemm"):
            groups.append([operator])
        elif groups:
            groups[-1].append(operator)
        else:
            raise refused(f"it begins with {operator.kind}")
    if not groups:
        raise refused("it has no weights")
    return groups


def _layer(group: list[Operator], tensor: _Tensor) -> tuple[Layer, _Tensor]:
    product, *rest = group
    layer = _product(product, tensor)
    following = _Following(layer)
    for operator in rest:
        following.add(operator)
    return following.layer, following.end()


def _product(operator: Operator, tensor: _Tensor) -> Layer:
    """A layer before anything follows it."""
    weights, *bias = operator.constants
    values = weights.values
    if operator.kind == "Conv":
        operator.require(
            group=1, auto_pad=b"NOTSET", pads=[0] * 4, strides=[1, 1], dilations=[1, 1],
            kernel_shape=list(values.shape[2:]),
        )  # fmt: skip
        fits = values.ndim == 4 and len(tensor.shape) == 3 and values.shape[1] == tensor.shape[0]
        fits = fits and all(np.less_equal(values.shape[2:], tensor.shape[1:]))
    else:
        operator.require(alpha=1.0, beta=1.0, transA=0)
        fits = values.ndim == 2 and tensor.shape == values.shape[1:] and not bias
        fits = fits and operator.attributes.get("transB") == 1
    if not fits:
        raise refused(f"{weights.name} does not fit what it multiplies")
    layer = Layer(
        source=weights.name,
        weights=values,
        weight_scales=None,
        bias=bias[0].values if bias else None,
        input_shape=tensor.shape,
        input=tensor.quantization,
    )
    return _checked(layer, weights, bias[0] if bias else None)


def _checked(layer: Layer, weights: Constant, bias: Constant | None) -> Layer:
    """A layer whose numbers are all float, or all integers that fit 32 bits."""
    if weights.scales is None:
        _require_float(layer, bias)
        return layer
    if layer.input is None or layer.weights.dtype != np.int8:
        raise refused(f"{layer.source} does not multiply int8 by int8")
    scales = np.broadcast_to(weights.scales, layer.weights.shape[:1])
    if bias is not None:
        wanted = layer.input.scale * scales
        if bias.scales is None or not np.allclose(bias.scales, wanted, _SCALE_TOLERANCE, 0.0):
            raise refused(f"{bias.name} is not quantized as the sums that it is added to")
    span = abs(layer.input.zero_point) - LOWEST  # the zero point's share is added for itself
    largest = np.abs(layer.weights.astype(np.int64)).reshape(len(scales), -1).sum(axis=1) * span
    if bias is not None:
        largest += np.abs(bias.values.astype(np.int64))
    if np.max(largest) > _LARGEST_SUM:
        raise refused(f"the sums of {layer.source} do not fit 32 bits")
    return replace(layer, weight_scales=scales)


def _require_float(layer: Layer, bias: Constant | None) -> None:
    if layer.weights.dtype != np.float32 or (bias is not None and bias.values.dtype != np.float32):
        raise refused(f"{layer.source} is {layer.weights.dtype}, neither int8 nor float32")
    if layer.convolution and (layer.input is not None or layer.input_shape[0] != 1):
        raise refused(f"{layer.source} is a convolution of several maps in float")


class _Following:
    """Takes up what follows a product until the next one.

    Once there are levels, what follows changes each level for itself: a table holds what becomes
    of it. Maximum pooling may come before such steps or after them, since none of them changes
    the order.
    """

    def __init__(self, layer: Layer) -> None:
        self.layer = layer
        self.shape = layer.output_shape
        self.quantization: Quantization | None = None
        self._levels = _ALL_LEVELS
        self._values: NDArray[np.float32] | None = None
        """Values of the levels, between DequantizeLinear and QuantizeLinear."""

    def add(self, operator: Operator) -> None:
        """Take up the next operator.

        Raises
        ------
        ModelError
            If the C source has no form for it there.
        """
        {
            "MaxPool": self._pool,
            "Relu": self._rectify,
            "QuantizeLinear": self._quantize,
            "DequantizeLinear": self._dequantize,
            "Reshape": self._reshape,
        }.get(operator.kind, self._refuse)(operator)

    def _refuse(self, operator: Operator) -> None:
        raise refused(f"{operator.kind} {operator.name} follows {self.layer.source}")

    def _pool(self, operator: Operator) -> None:
        size = [POOL, POOL]
        operator.require(
            kernel_shape=size, strides=size, pads=[0] * 4, dilations=[1, 1], ceil_mode=0,
            auto_pad=b"NOTSET",
        )  # fmt: skip
        once = self.layer.convolution and not self.layer.pooled and len(self.shape) == 3
        if not once or "strides" not in operator.attributes:  # whose default is 1
            self._refuse(operator)
        self.layer = replace(self.layer, pooled=True)
        self.shape = self.layer.output_shape

    def _rectify(self, operator: Operator) -> None:
        if self._values is not None:
            self._values = np.maximum(self._values, np.float32(0.0))
        elif self.layer.output is None and not self.layer.integer:
            self.layer = replace(self.layer, rectified=True)
        else:
            self._refuse(operator)

    def _quantize(self, operator: Operator) -> None:
        quantization = _quantization(operator)
        if self.layer.output is None:
            self.layer = replace(self.layer, output=quantization)
        elif self._values is not None:
            self._levels = quantization.levels(self._values)
            table = None if np.array_equal(self._levels, _ALL_LEVELS) else self._levels
            self.layer = replace(self.layer, table=table)
        else:
            self._refuse(operator)
        self.quantization, self._values = quantization, None

    def _dequantize(self, operator: Operator) -> None:
        if self.quantization != _quantization(operator) or self._values is not None:
            self._refuse(operator)
        assert self.quantization is not None
        self._values = self.quantization.values(self._levels)

    def _reshape(self, operator: Operator) -> None:
        size = int(np.prod(self.shape))
        if operator.constants[0].values.tolist() != [-1, size]:
            self._refuse(operator)
        self.shape = (size,)

    def end(self) -> _Tensor:
        """What the next layer takes.

        Raises
        ------
        ModelError
            If sums of levels stay float, or levels do not reach the next layer as they are.
        """
        if self.quantization is None:
            if self.layer.integer:
                raise refused(f"what follows {self.layer.source} is not quantized")
        elif self._values is None or not np.array_equal(
            self._values, self.quantization.values(self._levels)
        ):
            raise refused(f"what follows {self.layer.source} does not end with DequantizeLinear")
        return _Tensor(self.shape, self.quantization)


def _quantization(operator: Operator) -> Quantization:
    scale, zero_point = operator.constants
    zero = zero_point.values
    if scale.values.size != 1 or scale.values.dtype != np.float32 or zero.dtype != np.int8:
        raise refused(f"{operator.kind} {operator.name} does not have one scale and int8 levels")
    if not 0.0 < scale.values.item() < np.inf:
        raise refused(f"{operator.kind} {operator.name} has the scale {scale.values.item()}")
    return Quantization(np.float32(scale.values.item()), int(zero.item()))
