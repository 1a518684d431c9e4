"""Questions about the scale of a recording, which it raises and cannot answer: wrong units.

Nothing here is impossible, only unlikely of a machine. `edge_ident.signals.data_checks` refuses
what is impossible.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import chain
from typing import Final

import numpy as np

from edge_ident.signals.metrics import quantile
from edge_ident.signals.recording import Array, AxisRecord, Recording

TURNS: Final = 30.0
"""Turns of an axis from which its angle may be one in degrees. A whole turn and a half in degrees,
read as rad, is 86 turns."""
SMALL_RAD: Final = np.pi / 180.0
"""Travel up to which an angle may have been converted twice, or be one in turns: one degree. An
axis hardly leaves presliding there."""
LONG_M: Final = 10.0
"""Travel from which metres may be millimetres: ball screws end near that length."""
_SLOW_S: Final = 0.1  # sampling period from which time may be in milliseconds
# Inertia from which a unit is likelier wrong: a hundred tonnes.
_HEAVY: Final = {"kg": 1e5, "kg*m^2": 1e5}
_ALIKE: Final = 0.9  # correlation of two signals, from which their ratio tells of their units
# Relative distance to a factor between two units, up to which it is that factor.
_NEAR: Final = 0.05
_FACTORS: Final = {
    "degrees and rad": 180.0 / np.pi,
    "mm and m": 1e3,
    "turns and rad": 2.0 * np.pi,
    "1/min and rad/s": 30.0 / np.pi,
}
# Position and effort whose product is no work, and what to do.
_CROSSED: Final = {
    ("m", "N*m"): "if the position is an angle, say so: --unit NAME=rad (of {axis}_position_m, "
    "with --column {axis}_position_m={axis}_position_rad); of a screw with 5 mm a turn, mm are an "
    "angle: --unit 'NAME=1/5 turn'",
    ("rad", "N"): "if the position is a length, say so: --unit NAME=mm; if the effort is a "
    "torque: --unit NAME=Nm (of {axis}_force_n, with --column {axis}_force_n={axis}_torque_nm)",
}  # fmt: skip


@dataclass(frozen=True)
class ScaleQuestion:
    """One question.

    Attributes
    ----------
    code, axis : str
    message, next_step : str
        One line each.
    """

    code: str
    axis: str
    message: str
    next_step: str


def check_scales(recording: Recording) -> list[ScaleQuestion]:
    """Ask about travels, sampling periods, and signals of one axis in different units."""
    return [question for name in recording.axes for question in check_scale(recording, name)]


def check_scale(recording: Recording, name: str) -> list[ScaleQuestion]:
    """Questions about the scale of one axis."""
    axis, time_s = recording.axes[name], recording.time_s
    asked = _kinds(name, axis), _travel(name, axis), _sampling(name, axis, time_s)
    return [*chain(*asked), *_within_axis(name, axis, time_s)]


def check_inertia(name: str, inertia: float, unit: str) -> list[ScaleQuestion]:
    """Ask about an inertia that no axis has."""
    if inertia < _HEAVY.get(unit, np.inf):
        return []
    return [
        ScaleQuestion(
            "implausible_inertia",
            name,
            f"an inertia of {inertia:.2g} {unit} is that of no axis: are all units right?",
            "check the units of time, position and effort: edge-ident import FILE shows them",
        )
    ]


def _kinds(name: str, axis: AxisRecord) -> Iterator[ScaleQuestion]:
    """A length beside a torque, or an angle beside a force."""
    if axis.units not in _CROSSED:
        return
    position, effort = axis.units
    yield ScaleQuestion(
        "crossed_units",
        name,
        f"the position is in {position} and the effort in {effort}, so that the inertia is in "
        f"{axis.parameter_units[0]}: are both units right?",
        _CROSSED[axis.units].format(axis=name),
    )


def _travel(name: str, axis: AxisRecord) -> Iterator[ScaleQuestion]:
    travel = float(np.ptp(axis.position))
    turns = travel / (2.0 * np.pi)
    if axis.position_unit == "m":
        if travel >= LONG_M:
            yield ScaleQuestion(
                "long_travel",
                name,
                f"the axis travels {travel:.4g} m: is its position in m?",
                "if it is in millimetres, say so: --unit NAME=mm",
            )
    elif turns > TURNS:
        yield ScaleQuestion(
            "many_turns",
            name,
            f"the axis goes through {turns:.0f} turns: is its position in rad?",
            "if it is in degrees, say so: --unit NAME=deg",
        )
    elif travel <= SMALL_RAD:
        yield ScaleQuestion(
            "small_travel",
            name,
            f"the axis turns by {np.degrees(travel):.2g} degrees in all: is its position in rad?",
            "if it is in turns, give --unit NAME=turn; if the file says deg, and means rad: "
            "--unit NAME=rad",
        )


def _sampling(name: str, axis: AxisRecord, time_s: Array) -> Iterator[ScaleQuestion]:
    if axis.sampling:
        period_s = axis.sampling.period_s
    else:
        steps = np.diff(time_s)
        if 2 * np.count_nonzero(steps > _SLOW_S) < len(steps):  # as a rule; a median takes longer
            return
        period_s = quantile(steps, 0.5)
    if period_s <= _SLOW_S:
        return
    yield ScaleQuestion(
        "slow_sampling",
        name,
        f"the sampling period is {period_s:.3g} s: is the time in seconds?",
        "if it is in milliseconds, say so: --unit NAME=ms",
    )


def _within_axis(name: str, axis: AxisRecord, time_s: Array) -> Iterator[ScaleQuestion]:
    """Position against reference and velocity: between them no machine has a factor of units."""
    if axis.reference is not None:
        yield from _ratio(name, "reference", axis.position, axis.reference)
    if axis.velocity is not None:
        moved = 0.5 * (axis.velocity[1:] + axis.velocity[:-1]) * np.diff(time_s)
        yield from _ratio(name, "velocity", axis.position, np.append(0.0, np.cumsum(moved)))


def _ratio(name: str, what: str, position: Array, other: Array) -> Iterator[ScaleQuestion]:
    centred = [signal - np.mean(signal) for signal in (position, other)]
    size = [float(np.linalg.norm(signal)) for signal in centred]
    if min(size) == 0.0 or float(centred[0] @ centred[1]) < _ALIKE * size[0] * size[1]:
        return
    ratio = size[0] / size[1]
    for units, factor in _FACTORS.items():
        if abs(np.log(ratio)) > 1.0 and abs(max(ratio, 1.0 / ratio) / factor - 1.0) < _NEAR:
            yield ScaleQuestion(
                f"{what}_scale",
                name,
                f"the position is {ratio:.4g} times what the {what} says, as between {units}: "
                "have both the unit that their columns state?",
                "correct one of them with --unit NAME=UNIT",
            )
            return
