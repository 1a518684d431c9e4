"""Scales of a chart: where a value stands between both ends, and the ticks in between."""

import math
from dataclasses import dataclass
from typing import Final, Literal

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

_STEPS: Final = (1.0, 2.0, 2.5, 5.0, 10.0)
_SUPERSCRIPTS: Final = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")
_PLAIN: Final = (1e-2, 1e5)
"""Largest values between these are written without a power of ten."""


@dataclass(frozen=True)
class Scale:
    """From `low` to `high`; `root` stretches what is near zero, as half of a logarithm would."""

    low: float
    high: float
    kind: Literal["linear", "root", "log"] = "linear"

    def fraction(self, values: Array) -> Array:
        """Places between both ends, from 0 to 1; beyond them outside."""
        low, high, at = (
            self._on_paper(np.asarray(v, float)) for v in (self.low, self.high, values)
        )
        return np.asarray((at - low) / (high - low))

    def _on_paper(self, values: Array) -> Array:
        if self.kind == "root":
            return np.sqrt(np.maximum(values, 0.0))
        if self.kind == "log":
            return np.log10(np.maximum(values, 1e-300))
        return values

    @property
    def exponent(self) -> int:
        """Power of ten, a multiple of three, that the labels leave to the title of the scale."""
        largest = max(abs(self.low), abs(self.high))
        if self.kind == "log" or _PLAIN[0] <= largest < _PLAIN[1] or largest == 0.0:
            return 0
        return 3 * math.floor(math.log10(largest) / 3)

    def unit(self, unit: str) -> str:
        """The unit with that power of ten."""
        if not self.exponent:
            return unit
        return f"10{str(self.exponent).translate(_SUPERSCRIPTS)} {unit}"

    def ticks(self, count: int) -> list[tuple[float, str]]:
        """Places and labels of round values, about `count` of them."""
        if self.kind == "log":
            first, last = math.ceil(math.log10(self.low)), math.floor(math.log10(self.high))
            stride = max(1, math.ceil((last - first + 1) / count))
            tens = range(first, last + 1, stride)
            labels = {10.0**ten: f"10{str(ten).translate(_SUPERSCRIPTS)}" for ten in tens}
        else:
            labels = self._linear_ticks(count)
        return [(float(self.fraction(np.array(value))), text) for value, text in labels.items()]

    def _linear_ticks(self, count: int) -> dict[float, str]:
        unit = 10.0**self.exponent
        low, high = self.low / unit, self.high / unit
        rough = (high - low) / count
        ten = 10.0 ** math.floor(math.log10(rough))
        step = next(ten * factor for factor in _STEPS if ten * factor >= rough * (1.0 - 1e-9))
        decimals = next(d for d in range(15) if abs(step - round(step, d)) < 1e-9 * step)
        numbers = range(math.ceil(low / step - 1e-9), math.floor(high / step + 1e-9) + 1)
        return {n * step * unit: f"{n * step:.{decimals}f}".replace("-", "−") for n in numbers}


def around(values: Array, margin: float = 0.06) -> Scale:
    """A scale that shows all finite values, with a margin."""
    finite = values[np.isfinite(values)]
    low, high = (float(np.min(finite)), float(np.max(finite))) if len(finite) else (0.0, 1.0)
    room = margin * (high - low) or 0.5 * abs(high) or 1.0
    return Scale(low - room, high + room)


def across(values: Array, kind: Literal["linear", "root", "log"] = "linear") -> Scale:
    """A scale from the lowest to the highest value, without a margin."""
    low, high = (float(np.min(values)), float(np.max(values))) if len(values) else (0.0, 1.0)
    return Scale(low, high if high > low else low + 1.0, kind)
