"""An ONNX file as nested fields, to read and change a graph without the package onnx.

A message of Protocol Buffers is a row of fields. Each has a number, which its schema names, and a
value: an integer or bytes, which may be a message again. Bytes are read as views, because most of a
file is weights. Source: Protocol Buffers, Encoding; the numbers are those of onnx.proto.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

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
