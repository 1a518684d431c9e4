"""How long the way into a motion must be, from where the axes stand.

A board blends from the rest position into a motion over its lead-in. The further away the axes
stand, the longer that must take, or the way into the motion is faster than the motion itself.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from edge_ident.errors import BoardError
from firmware_interface.board import AxisLimits, Board
from firmware_interface.control_law import feedforward_nm
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
"""Of a limit, that the lead-in may use where the motion itself stays below it."""
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
    allowed = {
        axis: _allowed(motion, trajectory, rest[axis], limits[axis], gains[axis])
        for axis, motion in trajectory.axes.items()
    }
    longest_s = _MOST_SAMPLES * board.identity.sample_period_s
    lead_in_s = trajectory.lead_in_s
    while lead_in_s <= longest_s:
        if _fits(trajectory.axes, lead_in_s, rest, gains, allowed):
            return replace(trajectory, lead_in_s=lead_in_s)
        lead_in_s *= _LENGTHEN
    where = ", ".join(f"{axis} {rest[axis]:.3g} rad" for axis in trajectory.axes)
    raise BoardError(
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
    ways = {axis: reference(motion, times, lead_in_s, rest[axis]) for axis, motion in axes.items()}
    fastest = np.max([np.abs(way.velocity_rad_s) for way in ways.values()], axis=0)
    stop_s = np.array([stop_duration_s(speed) for speed in fastest.tolist()])
    return all(_within(_use(way, stop_s, gains[axis]), allowed[axis]) for axis, way in ways.items())


def _use(way: Reference, stop_s: Array | float, gains: AxisGains) -> _Use:
    end = way.position_rad + way.velocity_rad_s * stop_s / 2.0
    return _Use(
        max(_most(way.position_rad), _most(end)),
        _most(way.velocity_rad_s),
        _most(way.acceleration_rad_s2),
        _most(feedforward_nm(gains, way, np)),
    )


def _allowed(
    motion: Multisine | Staircase,
    trajectory: Trajectory,
    rest_rad: float,
    limits: AxisLimits,
    gains: AxisGains,
) -> _Use:
    """What the way may ask for: a share of each limit, or what the captured motion does."""
    count = max(int(trajectory.duration_s * _LOOKS_PER_S), 2)
    times = np.linspace(0.0, trajectory.duration_s, count)
    captured = reference(motion, times, trajectory.lead_in_s, rest_rad)
    own = _use(captured, stop_duration_s(_most(captured.velocity_rad_s)), gains)
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
