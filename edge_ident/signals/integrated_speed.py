"""The position of an axis of which only the speed was recorded."""

from collections.abc import Mapping
from typing import Final

import numpy as np
from numpy.typing import NDArray

from edge_ident.signals.conditioning import condition, unit_length
from edge_ident.signals.contract_columns import EFFORTS, TIME, parse_name
from edge_ident.signals.timing import vertex

Array = NDArray[np.float64]

_STANDS: Final = 0.02
"""Of the highest speed, up to which an axis may stand: more than the drift of a tachometer."""
_LONG: Final = 20
"""Samples of a standstill."""
_REACH: Final = 0.05
"""Of the highest speed, up to which a zero is looked for by the friction."""
_TRIED: Final = 21
_MOST: Final = 1 << 15
"""Samples by which it is looked for."""
_CERTAIN: Final = 3.0
"""Standard deviations from which a zero is off: the usual three-sigma rule."""
_TINY: Final = float(np.finfo(float).tiny)


def with_integrated_speed(columns: Mapping[str, Array]) -> tuple[dict[str, Array], list[str]]:
    """Add the position of each axis that has an effort and a speed, and no position.

    The zero of a speed drifts, and the position with it. It shows where the axis stands, against a
    reference, and by the speed at which dry friction changes its direction. Elsewhere nothing tells
    it from a motion.

    Parameters
    ----------
    columns : mapping of name in the contract to (N,) array

    Returns
    -------
    columns : dict
    said : list of str
        What was done, one line for each axis.
    """
    made, said = dict(columns), []
    parsed = {name: parse_name(name) or ("", "", "") for name in columns}
    held = {(axis, quantity) for axis, quantity, _ in parsed.values()}
    for name, (axis, quantity, unit) in parsed.items():
        driven = any((axis, effort) in held for effort in EFFORTS)
        if (
            quantity != "velocity"
            or not driven
            or (axis, "position") in held
            or TIME not in columns
        ):
            continue
        length = unit.removesuffix("_s")
        speed, time_s = columns[name], columns[TIME]
        reference = columns.get(f"{axis}_reference_{length}")
        effort = next(columns[n] for n, p in parsed.items() if p[0] == axis and p[1] in EFFORTS)
        zero, because = _zero(time_s, speed, reference, effort)
        position = _integral(time_s, speed - zero)
        position += 0.0 if reference is None else float(reference[0])
        made[f"{axis}_position_{length}"] = position
        drift = "no drift of its zero shows, and none was removed"
        if because:
            drift = f"the drift of its zero, {zero:.3g} {length}/s, was removed ({because})"
        said.append(f"the position of {axis} is the integral of its speed; {drift}")
    return made, said


def _zero(time_s: Array, speed: Array, reference: Array | None, effort: Array) -> tuple[float, str]:
    """What a speed (N,) reads at rest, and how that shows; nothing where it does not."""
    if len(speed) < _LONG or not np.all(np.diff(time_s) > 0.0):
        return 0.0, ""
    if reference is not None:
        slope = np.polyfit(time_s - time_s[0], _integral(time_s, speed) - reference, 1)[0]
        return float(slope), "the position then follows its reference"
    around = np.convolve(np.abs(speed) > _STANDS * np.max(np.abs(speed)), np.ones(_LONG), "same")
    if np.count_nonzero(around == 0.0) >= _LONG:
        return float(np.mean(speed[around == 0.0])), "what it reads where the axis stands"
    zero, std = _zero_of_friction(time_s[:_MOST], speed[:_MOST], effort[:_MOST])
    if abs(zero) > _CERTAIN * std:
        return zero, "there dry friction changes its direction"
    return 0.0, ""


def _zero_of_friction(time_s: Array, speed: Array, effort: Array) -> tuple[float, float]:
    """The zero with which the base model leaves least of an effort (N,), with its deviation."""
    zeros = _REACH * float(np.max(np.abs(speed))) * np.linspace(-1.0, 1.0, _TRIED)
    left, independent = np.empty(_TRIED), 0.0
    for i, zero in enumerate(zeros):
        signals = condition(time_s, _integral(time_s, speed - zero), effort)
        columns, _ = unit_length(signals.regressor)
        fitted = columns @ np.linalg.lstsq(columns, signals.effort, rcond=None)[0]
        left[i] = np.sum((signals.effort - fitted) ** 2)
        independent = 2.0 * signals.cutoff_hz * signals.period_s * len(columns)
    best, step = int(np.argmin(left)), zeros[1] - zeros[0]
    if not 0 < best < _TRIED - 1:
        return 0.0, np.inf
    place, bend = vertex(left[best - 1 : best + 2].tolist())
    std = step * np.sqrt(2.0 * left[best] / (independent * max(bend, _TINY)))
    return float(zeros[best] + step * place), float(std)


def _integral(time_s: Array, speed: Array) -> Array:
    """From zero, by the trapezoidal rule."""
    steps = 0.5 * (speed[1:] + speed[:-1]) * np.diff(time_s)
    return np.concatenate([[0.0], np.cumsum(steps)])
