"""How long the lead-in of a motion must be, from where the axes stand.

A board blends from the rest position into a motion over its lead-in. The further away the axes
stand, the longer that must take, or the lead-in is faster than the motion itself.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from firmware_interface.board import AxisLimits, Board
from firmware_interface.control_law import exact_effort_nm
from firmware_interface.errors import MotionRefusedError
from firmware_interface.gains import AxisGains
from firmware_interface.motion import (
    Multisine,
    Reference,
    Staircase,
    Trajectory,
    reference,
    stop_duration_s,
)
from firmware_interface.registers import REGISTERS

Array = NDArray[np.float64]

_SHARE: Final = 0.9
"""Share of a limit that the lead-in may use where the motion itself stays below it."""
_EFFORT_SHARE: Final = 0.8
"""The same for the feed-forward effort: feedback needs the rest."""
_ROUNDING: Final = 1.001
_LENGTHEN: Final = 1.1
_LOOKS_PER_S: Final = 100
_MOST_SAMPLES: Final = REGISTERS["trajectory.lead_in_samples"].maximum or 0.0


@dataclass(frozen=True)
class _Use:
    """The most of everything that an axis is asked for."""

    position_rad: float
    speed_rad_s: float
    acceleration_rad_s2: float
    effort_nm: float


class UnreachableError(MotionRefusedError):
    """However long it takes, a motion cannot be begun from where the axes stand."""


def with_lead_in(board: Board, trajectory: Trajectory) -> Trajectory:
    """Lengthen the lead-in as far as the distance from where the axes stand asks for.

    Never shorter than it was. Over the lead-in every axis keeps nine tenths of the limits of speed,
    acceleration and travel, the way to a stop included, and eight tenths of the effort by
    feed-forward, or what the motion itself takes where that is more.

    Raises
    ------
    BoardError
        However long it takes, the motion cannot be reached from there.
    """
    rest, limits, gains = board.status().position_rad, board.limits(), board.active_gains()
    captured = _captured(trajectory, rest)
    allowed = {
        axis: _allowed(_use(axis, captured, None, gains[axis]), rest[axis], limits[axis])
        for axis in trajectory.axes
    }
    longest_s = _MOST_SAMPLES * board.identity.sample_period_s
    lead_in_s = trajectory.lead_in_s
    while lead_in_s <= longest_s:
        if _fits(trajectory.axes, lead_in_s, rest, gains, allowed):
            return replace(trajectory, lead_in_s=lead_in_s)
        lead_in_s *= _LENGTHEN
    where = ", ".join(f"{axis} {rest[axis]:.3g} rad" for axis in trajectory.axes)
    raise UnreachableError(
        f"the motion cannot be reached from the present position of the axes ({where})",
        "move the axes closer with edge-ident home",
    )


def _fits(
    axes: Mapping[str, Multisine] | Mapping[str, Staircase],
    lead_in_s: float,
    rest: Mapping[str, float],
    gains: Mapping[str, AxisGains],
    allowed: Mapping[str, _Use],
) -> bool:
    times = np.linspace(-lead_in_s, 0.0, max(int(lead_in_s * _LOOKS_PER_S), 200))
    references = _references(axes, times, lead_in_s, rest)
    fastest = np.max([np.abs(of_axis.velocity_rad_s) for of_axis in references.values()], axis=0)
    stop_s = np.array([stop_duration_s(speed) for speed in fastest.tolist()])
    return all(_within(_use(axis, references, stop_s, gains[axis]), allowed[axis]) for axis in axes)


def _captured(trajectory: Trajectory, rest: Mapping[str, float]) -> dict[str, Reference]:
    """The motion itself, by axis; then any lead-in is over, however long it was."""
    count = max(int(trajectory.duration_s * _LOOKS_PER_S), 2)
    times = np.linspace(0.0, trajectory.duration_s, count)
    return _references(trajectory.axes, times, 1.0, rest)


def _references(
    axes: Mapping[str, Multisine] | Mapping[str, Staircase],
    times: Array,
    lead_in_s: float,
    rest: Mapping[str, float],
) -> dict[str, Reference]:
    return {axis: reference(motion, times, lead_in_s, rest[axis]) for axis, motion in axes.items()}


def _use(
    axis: str, references: Mapping[str, Reference], stop_s: Array | None, gains: AxisGains
) -> _Use:
    """Use of its limits by one axis; `stop_s` None stops it from its own top speed."""
    own = references[axis]
    other = next((of for name, of in references.items() if name != axis), None)
    speed = _most(own.velocity_rad_s)
    end = own.position_rad + own.velocity_rad_s / 2.0 * (
        stop_duration_s(speed) if stop_s is None else stop_s
    )
    return _Use(
        max(_most(own.position_rad), _most(end)),
        speed,
        _most(own.acceleration_rad_s2),
        _most(exact_effort_nm(gains, own, other)[0]),
    )


def _allowed(own: _Use, rest_rad: float, limits: AxisLimits) -> _Use:
    """What the lead-in may ask for: a share of each limit, or what the captured motion does."""
    return _Use(
        min(
            max(_SHARE * limits.travel_rad, _ROUNDING * max(own.position_rad, abs(rest_rad))),
            limits.travel_rad,  # near it the rounding must not lead beyond what the board allows
        ),
        max(_SHARE * limits.speed_rad_s, _ROUNDING * own.speed_rad_s),
        max(_SHARE * limits.acceleration_rad_s2, _ROUNDING * own.acceleration_rad_s2),
        max(_EFFORT_SHARE * limits.effort_nm, _ROUNDING * own.effort_nm),
    )


def _within(use: _Use, allowed: _Use) -> bool:
    return (
        use.position_rad <= allowed.position_rad
        and use.speed_rad_s <= allowed.speed_rad_s
        and use.acceleration_rad_s2 <= allowed.acceleration_rad_s2
        and use.effort_nm <= allowed.effort_nm
    )


def _most(values: Array) -> float:
    return float(np.max(np.abs(values)))
