"""Constant arrays of the C source: their declaration, their text, their size."""

import textwrap
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

WIDTH: Final = 100
_C_TYPES: Final = {
    "float32": "float",
    "float64": "double",
    "int8": "int8_t",
    "int32": "int32_t",
    "uint8": "uint8_t",
    "uint16": "uint16_t",
    "uint32": "uint32_t",
}


@dataclass(frozen=True)
class Array:
    """A constant array of one or two dimensions."""

    name: str
    values: NDArray[Any]

    @property
    def declaration(self) -> str:
        """Type, name and sizes."""
        sizes = "".join(f"[{size}]" for size in self.values.shape)
        return f"static const {_C_TYPES[self.values.dtype.name]} {self.name}{sizes}"

    @property
    def text(self) -> str:
        """The initializer, in lines of at most 100 columns."""
        if self.values.ndim == 1:
            return f"{{\n{_lines(self.values)}\n}}"
        return "{\n" + "\n".join(f"  {{\n{_lines(row)}\n  }}," for row in self.values) + "\n}"


def _lines(values: NDArray[Any]) -> str:
    text = ", ".join(literal(value) for value in values)
    return textwrap.fill(text, WIDTH, initial_indent="    ", subsequent_indent="    ")


def literal(value: Any) -> str:
    """One number as C99; a float in base 16, which every compiler reads to the last bit."""
    if isinstance(value, np.floating):
        digits, exponent = float(value).hex().split("p")
        digits = digits.rstrip("0").rstrip(".") if "." in digits else digits
        return f"{digits}p{exponent}{'' if value.dtype == np.float64 else 'f'}"
    return str(int(value)) + ("u" if value.dtype.kind == "u" and value.itemsize == 4 else "")
