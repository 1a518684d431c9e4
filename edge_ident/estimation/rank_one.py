"""A network that takes both efforts in place of their image.

The image is an outer product, scale·ψαᵀ + offset, and the first layer is linear. So the layer is a
product of one-dimensional convolutions, exactly:

layer[k, i, j] = Σ_q (Σ_p K[k, p, q]·scale·ψ[i+p])·α[j+q] + offset·ΣK[k] + bias[k]

The inner sum needs ψ alone, and α takes part as it is, moved by q. So each map is a product of two
small matrices, and the maximum over squares of 2x2 that follows is taken at once. Kernels may come
in opposite pairs, as in a network that started 'looks-linear' (Balduzzi et al. 2017). Then one
product serves both: the maximum of the second is the minimum of the first, negative. The rest of
the graph runs as it is: it is cut behind that maximum when the network is loaded. There is one file
of weights.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
import onnxruntime
from numpy.typing import NDArray

from edge_ident.errors import ModelError
from edge_ident.estimation.image import Normalization, scale_and_offset
from edge_ident.model.model import PARAMETERS, Array
from edge_ident.signals.metrics import POINTS

Floats = NDArray[np.float32]

BATCH: Final = 8
"""Pairs of efforts that go through the graph at once. All that its layers make of more of them does
not stay in a processor's cache."""
_EVERY_PIXEL: Final = {"group": (1,), "pads": (0,) * 4, "strides": (1, 1), "dilations": (1, 1)}
_SQUARES: Final = {
    "kernel_shape": (2, 2),
    "pads": (0,) * 4,
    "strides": (2, 2),
    "dilations": (1, 1),
    "ceil_mode": (0,),
}


# An ONNX file as nested fields, to read and change a graph without the package onnx.
#
# A message of Protocol Buffers is a row of fields. Each has a number, which its schema names, and a
# value: an integer or bytes, which may be a message again. Bytes are read as views, because most of
# a file is weights. Source: Protocol Buffers, Encoding; the numbers are those of onnx.proto.

Field = tuple[int, int | bytes | memoryview]

GRAPH: Final = 7
"""Number of a field of the model; those below are of the graph."""
NODE: Final = 1
INITIALIZER: Final = 5
INPUT: Final = 11
FLOAT: Final = 1
"""Type of an element."""

_VARINT, _EIGHT_BYTES, _SIZED, _FOUR_BYTES = 0, 1, 2, 5
_FIXED: Final = {_EIGHT_BYTES: 8, _FOUR_BYTES: 4}


@dataclass(frozen=True)
class Node:
    """One operator of a graph, as far as its surroundings matter.

    Attributes
    ----------
    operator : str
    inputs, outputs : tuple of str
    attributes : mapping of name to tuple of int
        Those that hold integers.
    """

    operator: str
    inputs: tuple[str, ...]
    outputs: tuple[str, ...]
    attributes: Mapping[str, tuple[int, ...]]

    @classmethod
    def of(cls, content: bytes | memoryview) -> "Node":
        """Read a node's message."""
        found = fields(content)
        return cls(
            operator=_text(found, 4),
            inputs=tuple(str(value, "utf-8") for value in messages(found, 1)),
            outputs=tuple(str(value, "utf-8") for value in messages(found, 2)),
            attributes=dict(_integers(fields(content)) for content in messages(found, 5)),
        )


def fields(message: bytes | memoryview) -> list[Field]:
    """Fields of a message in their order; those of a fixed width as bytes.

    Raises
    ------
    ValueError
        It is no message.
    """
    found: list[Field] = []
    message, at = memoryview(message), 0
    while at < len(message):
        key, at = _varint(message, at)
        number, kind = key >> 3, key & 7
        if kind == _VARINT:
            value, at = _varint(message, at)
            found.append((number, value))
            continue
        size = _FIXED.get(kind, 0)
        if kind == _SIZED:
            size, at = _varint(message, at)
        elif not size:
            raise ValueError(f"unknown kind {kind} of a field")
        if at + size > len(message):
            raise ValueError("a field is longer than its message")
        found.append((number, message[at : at + size]))
        at += size
    return found


def messages(found: Iterable[Field], number: int) -> list[bytes | memoryview]:
    """Values of all fields with that number that are bytes."""
    return [value for which, value in found if which == number and not isinstance(value, int)]


def message(*parts: tuple[int, int | bytes | memoryview | str]) -> bytes:
    """The bytes of a message; none of its fields may have a fixed width."""
    pieces: list[bytes | memoryview] = []
    for number, value in parts:
        if isinstance(value, int):
            pieces += [_encoded(number << 3 | _VARINT), _encoded(value)]
        else:
            content = value.encode() if isinstance(value, str) else value
            pieces += [_encoded(number << 3 | _SIZED), _encoded(len(content)), content]
    return b"".join(pieces)


def float_input(name: str, *shape: int | str) -> Field:
    """A field of a graph: an input of floats; a name stands for any size."""
    sizes = [(1, message((1 if isinstance(size, int) else 2, size))) for size in shape]
    tensor = message((1, FLOAT), (2, message(*sizes)))
    return INPUT, message((1, name), (2, message((1, tensor))))


def float_arrays(graph: Iterable[Field]) -> dict[str, NDArray[np.float32]]:
    """Initializers that hold floats, by name."""
    arrays = {}
    for content in messages(graph, INITIALIZER):
        found = fields(content)
        raw = messages(found, 9)
        if (2, FLOAT) in found and raw:
            shape = [value for number, value in found if number == 1 and isinstance(value, int)]
            arrays[_text(found, 8)] = np.frombuffer(raw[0], "<f4").reshape(shape)
    return arrays


def _integers(attribute: list[Field]) -> tuple[str, tuple[int, ...]]:
    """Name and integers of an attribute."""
    return _text(attribute, 1), tuple(
        value for number, value in attribute if number in (3, 8) and isinstance(value, int)
    )


def _text(found: Iterable[Field], number: int) -> str:
    return "".join(str(value, "utf-8") for value in messages(found, number))


def _varint(content: memoryview, at: int) -> tuple[int, int]:
    value = shift = 0
    while True:
        if at >= len(content) or shift > 63:
            raise ValueError("a number has no end")
        byte = content[at]
        value |= (byte & 127) << shift
        at, shift = at + 1, shift + 7
        if byte < 128:
            return value, at


def _encoded(value: int) -> bytes:
    parts = bytearray()
    while value > 127:
        parts.append(value & 127 | 128)
        value >>= 7
    parts.append(value)
    return bytes(parts)


class FirstLayer:
    """A convolution of the image, and the maximum over squares of 2x2 that follows.

    Parameters
    ----------
    kernels : (maps, height, width) array
    bias : (maps,) array

    Attributes
    ----------
    shape : tuple of int
        Maps, rows and columns of its output.
    """

    def __init__(self, kernels: Array, bias: Array) -> None:
        maps, height, width = kernels.shape
        rows, columns = (_even_and_odd(POINTS - length + 1) for length in (height, width))
        self.shape = maps, rows.shape[1], columns.shape[1]
        self._rows = rows[:, :, None] + np.arange(height)
        self._columns = np.arange(width)[:, None] + columns[:, None, :]
        self._opposite = np.array_equal(kernels[1::2], -kernels[::2])
        own = kernels[::2] if self._opposite else kernels
        flat = own.transpose(1, 0, 2).reshape(height, len(own) * width)
        self._kernels = flat.astype(np.float32)
        self._bias, self._sums = bias, kernels.sum(axis=(1, 2))

    def of_model(self, scaled: Array) -> Floats:
        """The convolutions of ψ, at even rows and at odd ones.

        Parameters
        ----------
        scaled : (n, points) array
            scale·ψ.

        Returns
        -------
        (n, 2, maps, rows, width) array
            Of opposite kernels, the first alone.
        """
        rows = self.shape[1]
        sums = scaled.astype(np.float32)[:, self._rows] @ self._kernels
        width = self._columns.shape[1]
        return np.ascontiguousarray(sums.reshape(len(scaled), 2, rows, -1, width).swapaxes(2, 3))

    def of_measured(self, measured: Array) -> Floats:
        """α, moved by each column of a kernel, to even columns and to odd ones.

        Parameters
        ----------
        measured : (m, points) array

        Returns
        -------
        (m, 2, width, columns) array
        """
        return measured.astype(np.float32)[:, self._columns]

    def output(self, model: Floats, measured: Floats, offset: Array) -> Floats:
        """What the layer makes of the image.

        Parameters
        ----------
        model : (n, 2, maps, rows, width) array
        measured : (1, 2, width, columns) or (n, 2, width, columns) array
        offset : (n,) array

        Returns
        -------
        (n, maps, rows, columns) array
        """
        _, rows, columns = self.shape
        own = model.shape[2]
        flat = model.reshape(len(model), 2, 1, own * rows, -1)  # one product for all maps
        product = np.empty((2, 2, own * rows, columns), dtype=np.float32)
        quarters = product.reshape(4, -1)  # one image after the other stays in the cache
        extremes = (np.maximum, np.minimum) if self._opposite else (np.maximum,)
        found = np.empty((len(extremes), len(model), own * rows * columns), dtype=np.float32)
        for number, left in enumerate(flat):
            np.matmul(left, measured[number if len(measured) > 1 else 0], out=product)
            for extreme, of_kernels in zip(extremes, found, strict=True):
                extreme.reduce(quarters, axis=0, out=of_kernels[number])
        np.negative(found[1:], out=found[1:])  # the largest of the opposite kernels
        by_kernel = found.reshape(len(extremes), len(model), own, -1).transpose(1, 2, 0, 3)
        maximum = by_kernel.reshape(-1, *self.shape)
        constants = self._bias + offset[:, None] * self._sums
        if constants.any():
            maximum += constants[:, :, None, None].astype(np.float32)
        return maximum


class RankOneGraph:
    """A network's graph, ready to read efforts.

    Parameters
    ----------
    layer : FirstLayer
    rest : bytes
        ONNX file of the graph behind it.

    Raises
    ------
    ModelError
        If onnxruntime refuses the graph, or it does not take the layer to four outputs.
    """

    def __init__(self, layer: FirstLayer, rest: bytes) -> None:
        self._layer = layer
        self._session = open_session(rest, layer.shape)
        self._input = self._session.get_inputs()[0].name
        self._of_model = _Kept(layer.of_model)
        self._of_measured = _Kept(layer.of_measured)

    def run(
        self, model_effort: Array, measured_effort: Array, normalization: Normalization
    ) -> Floats:
        """The network's outputs.

        Parameters
        ----------
        model_effort : (n, points) array
        measured_effort : (1, points) or (n, points) array
        normalization : {"effort-scale", "min-max"}

        Returns
        -------
        (n, 4) array
        """
        scale, offset = scale_and_offset(model_effort, measured_effort, normalization)
        scaled, measured = scale[:, None] * model_effort, self._of_measured(measured_effort)
        outputs = []
        for at in range(0, len(scaled), BATCH):
            part = slice(at, at + BATCH)
            own = measured[part] if len(measured) > 1 else measured
            maps = self._layer.output(self._of_model(scaled[part]), own, offset[part])
            outputs += self._session.run(None, {self._input: maps})
        return np.concatenate(outputs)


class _Kept:
    """A function that keeps its last value: in most loops one of both efforts stays as it is."""

    def __init__(self, function: Callable[[Array], Floats]) -> None:
        self._function = function
        self._last: tuple[bytes, Floats | None] = b"", None

    def __call__(self, effort: Array) -> Floats:
        key = effort.tobytes()
        last, value = self._last
        if value is None or last != key:
            value = self._function(effort)
            self._last = key, value
        return value


def divided(content: bytes) -> tuple[FirstLayer, bytes] | None:
    """The first layer of a network that takes images, and the file of the graph behind it.

    None where the network does not begin with a convolution of the image, of one channel, stride
    one and no padding, and a maximum over squares of 2x2.

    Parameters
    ----------
    content : bytes
        ONNX file.
    """
    try:
        model = fields(content)
        graph = [field for part in messages(model, GRAPH) for field in fields(part)]
        found = _first_nodes(graph)
        layer = None if found is None else _layer(found[0], float_arrays(graph))
    except ValueError:  # no ONNX file: onnxruntime says so
        return None
    if found is None or layer is None:
        return None
    rest = message(*_behind(graph, found, layer))
    return layer, message(*((GRAPH, rest) if field[0] == GRAPH else field for field in model))


def _first_nodes(graph: list[Field]) -> tuple[Node, Node] | None:
    """The convolution that alone reads the image, and the maximum that alone reads its output."""
    nodes = [Node.of(part) for part in messages(graph, NODE)]
    inputs = messages(graph, INPUT)
    if len(inputs) != 1:
        return None
    (image,) = messages(fields(inputs[0]), 1)
    convolution = [node for node in nodes if str(image, "utf-8") in node.inputs]
    if not _are(convolution, "Conv", _EVERY_PIXEL):
        return None
    pooling = [node for node in nodes if convolution[0].outputs[0] in node.inputs]
    return (convolution[0], pooling[0]) if _are(pooling, "MaxPool", _SQUARES) else None


def _are(nodes: list[Node], operator: str, attributes: Mapping[str, tuple[int, ...]]) -> bool:
    """Whether they are one node of that kind."""
    if len(nodes) != 1 or nodes[0].operator != operator:
        return False
    return all(nodes[0].attributes.get(name) == value for name, value in attributes.items())


def _layer(convolution: Node, arrays: Mapping[str, Floats]) -> FirstLayer | None:
    """The layer, if its weights are in the file."""
    weights = [arrays[name].astype(float) for name in convolution.inputs[1:] if name in arrays]
    if not weights or len(weights) < len(convolution.inputs) - 1 or weights[0].shape[1:2] != (1,):
        return None
    kernels = weights[0][:, 0]
    return FirstLayer(kernels, weights[1] if len(weights) > 1 else np.zeros(len(kernels)))


def _behind(graph: list[Field], first: tuple[Node, Node], layer: FirstLayer) -> list[Field]:
    """The graph without its first nodes, with what they give as its input."""
    gone = [node.outputs for node in first]
    kept = [
        (number, value)
        for number, value in graph
        if number != INPUT
        and not (number == NODE and not isinstance(value, int) and Node.of(value).outputs in gone)
    ]
    return [*kept, float_input(first[1].outputs[0], "n", *layer.shape)]


def _even_and_odd(places: int) -> NDArray[np.intp]:
    """Places (2, n), as many even ones as odd ones."""
    return np.arange(places // 2 * 2).reshape(-1, 2).T


# Sessions of onnxruntime, as every network gets one.


def open_session(content: bytes, input_shape: Sequence[int]) -> onnxruntime.InferenceSession:
    """A session on one thread; bytes, so that a file cannot refer to others beside it.

    Parameters
    ----------
    content : bytes
        ONNX file.
    input_shape : sequence of int
        Of its only input, behind the first dimension.

    Raises
    ------
    ModelError
        If onnxruntime refuses the network, or it does not take such inputs to four outputs.
    """
    options = onnxruntime.SessionOptions()
    options.intra_op_num_threads = 1
    options.inter_op_num_threads = 1
    options.execution_mode = onnxruntime.ExecutionMode.ORT_SEQUENTIAL
    options.graph_optimization_level = onnxruntime.GraphOptimizationLevel.ORT_ENABLE_ALL
    options.log_severity_level = 4
    try:
        session = onnxruntime.InferenceSession(content, options, ["CPUExecutionProvider"])
    except Exception as error:  # onnxruntime's exceptions have no common base
        first_line = (str(error).splitlines() or [type(error).__name__])[0]
        raise ModelError(
            f"onnxruntime refuses the network: {first_line}", "export the network again"
        ) from error
    inputs, outputs = session.get_inputs(), session.get_outputs()
    signature = [(len(inputs), len(outputs)), *(list(i.shape[1:]) for i in (*inputs, *outputs))]
    if signature != [(1, 1), list(input_shape), [len(PARAMETERS)]]:
        sizes = ", ".join(str(size) for size in input_shape)
        raise ModelError(
            f"the network maps {inputs[0].shape} to {outputs[0].shape}, "
            f"not (n, {sizes}) to (n, {len(PARAMETERS)})",
            "give a network made by edge-ident export",
        )
    return session
