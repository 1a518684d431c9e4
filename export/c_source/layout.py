"""What the C source says of each layer: its constants in the form in which they are used."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from export.c_source.arrays import Array
from export.c_source.graph import refused
from export.c_source.layers import Layer

_MANTISSA_BITS: Final = 24
# Scales of sums are mantissa / 2^shift: below one, and not so small that all sums vanish.
_SHIFTS: Final = (_MANTISSA_BITS, 62)
_INDEX_LIMIT: Final = 2**16
# Largest float weight: far above any trained one, far below where sums overflow.
_LARGEST_WEIGHT: Final = 1e6


@dataclass(frozen=True)
class SourceLayer:
    """A layer as the templates write it.

    Attributes
    ----------
    name : str
        Of its function, and the beginning of its arrays' names.
    layer : Layer
    arrays : tuple of Array
    """

    name: str
    layer: Layer
    arrays: tuple[Array, ...]

    def size(self, part: str) -> int:
        """Entries of the array of that name; 0 if there is none."""
        sizes = {array.name: len(array.values) for array in self.arrays}
        return sizes.get(f"{self.name}_{part}", 0)

    @property
    def constants_bytes(self) -> int:
        """Size of all arrays."""
        return sum(array.values.nbytes for array in self.arrays)


def lay_out(layers: Sequence[Layer]) -> tuple[SourceLayer, ...]:
    """The layers with their arrays.

    Raises
    ------
    ModelError
        If the network is not one convolution in float, then int8 layers, then dense layers in
        float, or a number in it is out of range.
    """
    kinds = "".join("i" if one.integer else "c" if one.convolution else "d" for one in layers)
    integers = kinds.count("i")
    if not integers or kinds != "c" + "i" * integers + "d" * (len(kinds) - 1 - integers):
        raise refused("it is not a convolution in float, int8 layers, and dense layers in float")
    if layers[0].output is None or layers[0].table is not None:
        raise refused(f"what follows {layers[0].source} is not quantized once")
    return tuple(
        SourceLayer(name, one, tuple(Array(f"{name}_{part}", v) for part, v in _parts(one)))
        for name, one in ((f"layer_{number}", one) for number, one in enumerate(layers, start=1))
    )


def _parts(layer: Layer) -> Iterator[tuple[str, NDArray[np.generic]]]:
    if not layer.integer:
        yield from _float_parts(layer)
        return
    assert layer.input is not None
    weights = layer.weights.reshape(len(layer.weights), -1)
    # Σ(level − zero)·weight = Σ level·weight − zero·Σ weight
    bias = -layer.input.zero_point * weights.sum(axis=1, dtype=np.int64)
    bias += 0 if layer.bias is None else layer.bias
    used = np.flatnonzero(np.any(weights, axis=0))
    if not layer.convolution and 2 * len(used) < weights.size - weights[:, used].size:
        if weights.shape[1] > _INDEX_LIMIT:
            raise refused(f"{layer.source} has more than {_INDEX_LIMIT} inputs")
        yield "inputs_used", used.astype(np.uint16)
        weights = weights[:, used]
    yield "weights", weights
    yield "bias", bias.astype(np.int32)
    mantissas, shifts = _scales_of_sums(layer)
    yield "mantissas", mantissas
    yield "shifts", shifts
    if layer.table is not None:
        yield "table", layer.table


def _scales_of_sums(layer: Layer) -> tuple[NDArray[np.uint32], NDArray[np.uint8]]:
    """From sums to levels of the output: mantissa / 2^shift is the float that onnxruntime takes."""
    assert layer.input is not None
    assert layer.weight_scales is not None
    assert layer.output is not None
    scales = layer.input.scale * layer.weight_scales / layer.output.scale
    fractions, exponents = np.frexp(scales)
    shifts = _MANTISSA_BITS - exponents
    if not np.all(np.isfinite(scales) & (shifts >= _SHIFTS[0]) & (shifts <= _SHIFTS[1])):
        raise refused(f"the scales of {layer.source} are out of range")
    mantissas = np.ldexp(fractions.astype(np.float64), _MANTISSA_BITS)
    return mantissas.astype(np.uint32), shifts.astype(np.uint8)


def _float_parts(layer: Layer) -> Iterator[tuple[str, NDArray[np.generic]]]:
    weights = layer.weights.reshape(len(layer.weights), -1)
    bias = np.zeros(len(weights), np.float32) if layer.bias is None else layer.bias
    if not np.all(np.abs(weights) <= _LARGEST_WEIGHT) or not np.all(np.abs(bias) < np.inf):
        raise refused(f"the weights of {layer.source} are out of range")
    if not layer.convolution:
        yield "weights", weights
        return
    maps, mirrored = _mirrored(np.column_stack([weights, bias]))
    yield "weights", weights[maps]
    if layer.bias is not None:
        yield "bias", bias[maps]
    yield "maps", np.array(maps, np.uint16)
    if any(index < len(weights) for index in mirrored):
        yield "mirrored_maps", np.array(mirrored, np.uint16)


def _mirrored(kernels: NDArray[np.float32]) -> tuple[list[int], list[int]]:
    """Kernels that are to be applied, and for each the map that is its negative.

    A network has such pairs where its training began with them, and left the first layer alone.
    The map is the number of kernels where there is none.
    """
    maps: list[int] = []
    mirrored: list[int] = []
    for index, kernel in enumerate(kernels):
        if index in mirrored:
            continue
        negatives = [
            later for later in range(index + 1, len(kernels))
            if later not in mirrored and np.array_equal(kernels[later], -kernel)
        ]  # fmt: skip
        maps.append(index)
        mirrored.append(negatives[0] if negatives else len(kernels))
    return maps, mirrored
