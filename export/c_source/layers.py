"""What a network consists of, as the C source needs it."""

from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

LOWEST: Final = -128
HIGHEST: Final = 127
POOL: Final = 2
"""Rows and columns of which maximum pooling keeps the largest value."""


@dataclass(frozen=True)
class Quantization:
    """value = scale · (level − zero_point), with levels of int8."""

    scale: np.float32
    zero_point: int

    def levels(self, values: NDArray[np.float32]) -> NDArray[np.int8]:
        """As QuantizeLinear: the quotient rounded half to even, and limited."""
        levels = np.rint(values / self.scale) + self.zero_point
        return np.asarray(np.clip(levels, LOWEST, HIGHEST), dtype=np.int8)

    def values(self, levels: NDArray[np.int8]) -> NDArray[np.float32]:
        """As DequantizeLinear."""
        return (levels.astype(np.int32) - self.zero_point).astype(np.float32) * self.scale


@dataclass(frozen=True)
class Layer:
    """A convolution or a dense layer, and what is done to its sums.

    Attributes
    ----------
    source : str
        Name of the weights in the network's file.
    weights : (maps, channels, rows, columns) or (outputs, inputs) array
        int8, or float32 where the layer computes in float.
    weight_scales : (maps,) or (outputs,) float32 array, or None
        Of int8 weights.
    bias : (maps,) array or None
        int32 in units of a sum of levels, or float32.
    input_shape : tuple of int
        (channels, rows, columns), or (inputs,).
    input : Quantization or None
        Of the input; None: it is float.
    pooled, rectified : bool
        Whether 2x2 maximum pooling and ReLU follow.
    output : Quantization or None
        Of the output; None: it stays float.
    table : (256,) int8 array or None
        What later quantizations make of each level from -128 on.
    """

    source: str
    weights: NDArray[Any]
    weight_scales: NDArray[np.float32] | None
    bias: NDArray[Any] | None
    input_shape: tuple[int, ...]
    input: Quantization | None
    pooled: bool = False
    rectified: bool = False
    output: Quantization | None = None
    table: NDArray[np.int8] | None = None

    @property
    def convolution(self) -> bool:
        """Whether it is a convolution, not a dense layer."""
        return self.weights.ndim == 4

    @property
    def integer(self) -> bool:
        """Whether it adds up integers."""
        return self.weight_scales is not None

    @property
    def output_shape(self) -> tuple[int, ...]:
        """(maps, rows, columns), or (outputs,)."""
        if not self.convolution:
            return (self.weights.shape[0],)
        sizes = zip(self.input_shape[1:], self.weights.shape[2:], strict=True)
        step = POOL if self.pooled else 1
        return (self.weights.shape[0], *((size - kernel + 1) // step for size, kernel in sizes))
