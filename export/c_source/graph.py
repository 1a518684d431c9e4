"""The ONNX graph as a chain of operators, each with its constants; anything else is refused."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
import onnx
from numpy.typing import NDArray
from onnx import helper, numpy_helper

from edge_ident.errors import ModelError

NEXT_STEP: Final = "give an int8 network made by edge-ident export"
# Known operators, and how many constants each takes at least.
_CONSTANTS: Final = {
    "Conv": 1, "MaxPool": 0, "Relu": 0, "QuantizeLinear": 2, "DequantizeLinear": 2, "Reshape": 1,
    "Gemm": 1, "Sigmoid": 0,
}  # fmt: skip


@dataclass(frozen=True)
class Constant:
    """Numbers of the file.

    Attributes
    ----------
    name : str
    values : array
    scales : array or None
        Of values that a DequantizeLinear takes to float: one, or one for each along the first axis.
    """

    name: str
    values: NDArray[Any]
    scales: NDArray[np.float32] | None = None


@dataclass(frozen=True)
class Operator:
    """One node of the chain, without its input and output."""

    kind: str
    name: str
    attributes: Mapping[str, Any]
    constants: tuple[Constant, ...]

    def require(self, **wanted: Any) -> None:
        """Refuse attributes that differ from those, which are the defaults of missing ones.

        Raises
        ------
        ModelError
        """
        for attribute, value in wanted.items():
            found = self.attributes.get(attribute, value)
            if found != value:
                raise refused(f"{self.kind} {self.name} has {attribute} {found}, not {value}")


def refused(cause: str) -> ModelError:
    """The error for a graph that this package cannot write as C."""
    return ModelError(f"the network cannot be written as C: {cause}", NEXT_STEP)


def read_chain(content: bytes) -> tuple[tuple[int, ...], tuple[Operator, ...]]:
    """Shape of one input, without the number of images, and what is done to it.

    Raises
    ------
    ModelError
        The graph is no chain of known operators.
    """
    graph = onnx.load_from_string(content).graph
    constants = _constants(graph)
    if len(graph.input) != 1 or len(graph.output) != 1:
        raise refused(f"it has {len(graph.input)} inputs and {len(graph.output)} outputs")
    dimensions = graph.input[0].type.tensor_type.shape.dim
    shape = tuple(int(dimension.dim_value) for dimension in dimensions[1:])
    if not shape or not all(shape):
        raise refused("its input has no fixed size")
    return shape, tuple(_chain(graph, constants))


def _constants(graph: onnx.GraphProto) -> dict[str, Constant]:
    """All constants by the name under which operators take them."""
    constants = {}
    for item in graph.initializer:
        if item.external_data:
            raise refused(f"{item.name} is in another file")
        constants[item.name] = Constant(item.name, numpy_helper.to_array(item))
    for node in graph.node:
        if node.op_type == "DequantizeLinear" and node.input[0] in constants:
            constants[node.output[0]] = _dequantized(node, constants)
    return constants


def _dequantized(node: onnx.NodeProto, constants: Mapping[str, Constant]) -> Constant:
    name = node.input[0]
    if not constants.keys() >= set(node.input):
        raise refused(f"the quantization of {name} is not constant")
    scales = constants[node.input[1]].values
    if len(node.input) > 2 and np.any(constants[node.input[2]].values != 0):
        raise refused(f"{name} has a zero point other than 0")
    if scales.ndim and _attributes(node).get("axis", 1) != 0:
        raise refused(f"{name} has no scale for each output")
    return Constant(name, constants[name].values, scales)


def _chain(graph: onnx.GraphProto, constants: Mapping[str, Constant]) -> Iterator[Operator]:
    """The nodes from the input to the output; each takes what the one before puts out."""
    at = graph.input[0].name
    for node in graph.node:
        if node.output[0] in constants:
            continue
        if node.op_type not in _CONSTANTS or node.domain:
            raise refused(f"it has the operator {node.op_type}")
        takes, *others = node.input
        if takes != at or len(node.output) != 1 or not constants.keys() >= set(others):
            raise refused(
                f"{node.op_type} {node.name} takes more than what the one before puts out"
            )
        found = tuple(constants[name] for name in others)
        if len(found) < _CONSTANTS[node.op_type]:
            raise refused(f"{node.op_type} {node.name} has {len(found)} constants")
        yield Operator(node.op_type, node.name, _attributes(node), found)
        at = node.output[0]
    if at != graph.output[0].name:
        raise refused("its output is not that of the last operator")


def _attributes(node: onnx.NodeProto) -> dict[str, Any]:
    return {item.name: helper.get_attribute_value(item) for item in node.attribute}
