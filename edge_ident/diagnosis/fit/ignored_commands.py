"""What it costs a model that its actuator ignores commands."""

import math
from typing import Final

import numpy as np
from numpy.typing import NDArray

from edge_ident.diagnosis.prepare.axis_data import AxisData
from edge_ident.model.effect import Effect, Values
from edge_ident.model.effects import named
from edge_ident.model.inverse import along_motion
from edge_ident.model.model import Term

Array = NDArray[np.float64]

_SLIGHT: Final = 1e-6
"""Relative change of a command that tells whether the actuator follows it."""
_MOST_IGNORED: Final = 0.4
"""Share of ignored samples from which the actuator follows no command at all."""
_TINY: Final = float(np.finfo(float).tiny)
_ROUNDING: Final = float(np.finfo(float).eps)


def ignored_command_penalty(data: AxisData, added: Term) -> Array:
    """Factor (D,) on the error of a model whose actuator ignores commands; one for all others.

    The effort that the actuator withholds is read from the effort itself. No motion predicts it.
    So each such sample is a free parameter and is penalized like one; or it may be anything in the
    range of those that are ignored, where any other command has the density of noise. The shorter
    description counts: a narrow deadband leaves little free.

    What is left for the motion to explain is the effort that arrives. The error counts as a share
    of that: a deadband as wide as an effort of two levels would leave nothing, and explain nothing.
    """
    effect = named(added.effect)
    if not effect.overrides("withheld"):
        return np.ones(1)
    share, width, arriving = _ignored(data, effect, along_motion(added))
    noise = min(s.effort_noise for s in data.segments)
    as_wide = math.sqrt(2.0 * math.pi * math.e) * max(noise, _TINY)  # as entropic as noise
    in_range = 2.0 * np.log(np.maximum(width / as_wide, 1.0))
    each = np.minimum(np.log(np.count_nonzero(data.valid)), in_range)
    factor = np.exp(share * each) / np.maximum(arriving, _ROUNDING)
    return np.asarray(np.where(share < _MOST_IGNORED, factor, np.inf))


def _ignored(data: AxisData, effect: Effect, values: Values) -> tuple[Array, Array, Array]:
    """Share (D,) of the samples at which an actuator ignores commands, the width (D,) of the range
    of what it withholds there, and the share (D,) of the variance that arrives, computed once."""
    key = (effect.name, *(value.tobytes() for value in values.values()))
    if key not in data.cache:
        parts = [_ignored_in(s.raw_effort, effect, values) for s in data.segments]
        ignores, withheld = (np.concatenate(part, axis=-1) for part in zip(*parts, strict=True))
        low = np.min(np.where(ignores, withheld, np.inf), axis=-1)
        high = np.max(np.where(ignores, withheld, -np.inf), axis=-1)
        commanded = np.concatenate([s.raw_effort for s in data.segments])
        arriving = np.var(commanded - withheld, axis=-1) / max(float(np.var(commanded)), _TINY)
        data.cache[key] = np.array(
            [np.mean(ignores, axis=-1), np.maximum(high - low, 0.0), np.minimum(arriving, 1.0)]
        )
    share, width, arriving = data.cache[key]
    return share, width, arriving


def _ignored_in(raw: Array, effect: Effect, values: Values) -> tuple[NDArray[np.bool_], Array]:
    """Where an actuator ignores a command (M,), and what it withholds, (D, M) each."""
    more = _SLIGHT * raw
    withheld = np.atleast_2d(effect.withheld(raw, values))
    change = effect.withheld(raw + more, values) - withheld
    return np.abs(change) > 0.5 * np.abs(more), withheld
