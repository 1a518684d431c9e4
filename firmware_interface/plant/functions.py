"""Elementary functions of one number or of an array.

A formula that is made of them holds for one axis, in plain numbers, and for a batch of drives:
numpy takes a microsecond for a single number, `math` a tenth of it.
"""

import math
from typing import Any, TypeAlias

import numpy as np

Value: TypeAlias = Any
"""A float of one axis, or an array over drives and axes."""


def exp(value: Value) -> Value:
    """Exponential."""
    return math.exp(value) if isinstance(value, float) else np.exp(value)


def expm1(value: Value) -> Value:
    """Exponential less one."""
    return math.expm1(value) if isinstance(value, float) else np.expm1(value)


def sin(value: Value) -> Value:
    """Sine of an angle in rad."""
    return math.sin(value) if isinstance(value, float) else np.sin(value)


def sign(value: Value) -> Value:
    """-1, 0 or 1."""
    if isinstance(value, float):
        return math.copysign(1.0, value) if value else 0.0
    return np.sign(value)


def clip(value: Value, limit: Value) -> Value:
    """Nearest value from -limit to limit."""
    if isinstance(value, float):
        return min(max(value, -limit), limit)
    return np.minimum(np.maximum(value, -limit), limit)
