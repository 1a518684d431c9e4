"""Motions to choose from: the description's own sinusoid, and richer ones that excite more."""

import math
from itertools import pairwise
from typing import Final, Literal

from edge_ident.drive.description import Drive, DriveAxis
from edge_ident.errors import ModelError
from edge_ident.support.words import listed
from firmware_interface.motion import Multisine, SineComponent, Staircase, Trajectory

MotionName = Literal["sinusoid", "multisine", "staircase"]
MOTIONS: Final[tuple[MotionName, ...]] = ("sinusoid", "multisine", "staircase")

_HARMONICS: Final = (1, 3, 7, 11, 17, 23)
"""Multiples of the description's frequency; high ones give the acceleration inertia needs."""
LIMIT_SHARE: Final = 0.7
"""Part of the speed and travel limits that a motion may use."""
_LEVELS: Final = (0.05, 0.1, 0.2, 0.35, 0.5)
"""Speeds of the staircase as shares of the limit, each both ways."""


def named_trajectory(drive: Drive, name: MotionName, cycles: int | None = None) -> Trajectory:
    """Trajectory of a named motion within the drive's limits.

    Parameters
    ----------
    drive : Drive
    name : {"sinusoid", "multisine", "staircase"}
    cycles : int, optional
        Periods of a sinusoid or multisine; default from the description.

    Raises
    ------
    ModelError
        There is no such motion.
    """
    if name not in MOTIONS:
        raise ModelError(f"there is no motion {name}", f"choose one of {listed(MOTIONS)}")
    sinusoid = drive.trajectory(cycles)
    if name == "sinusoid":
        return sinusoid
    if name == "multisine":
        rate = drive.angular_frequency_rad_s
        axes = {
            axis: _multisine(described, rate, shift)
            for shift, (axis, described) in enumerate(drive.axes.items())
        }
        return Trajectory(axes, sinusoid.duration_s, drive.lead_in_s)
    stairs = {axis: _staircase(described) for axis, described in drive.axes.items()}
    longest = max(_duration_s(motion) for motion in stairs.values())
    return Trajectory(stairs, longest, drive.lead_in_s)


def _multisine(axis: DriveAxis, rate: float, shift: int) -> Multisine:
    """Sines of equal speed; Schroeder's phases keep the crest low, the shift parts the axes."""
    count = len(_HARMONICS)
    speed = min(
        LIMIT_SHARE * axis.speed_limit_rad_s / count,
        LIMIT_SHARE * axis.travel_limit_rad / sum(1.0 / (k * rate) for k in _HARMONICS),
    )
    return Multisine(
        tuple(
            SineComponent(speed / (k * rate), k * rate, -math.pi * i * (i + 1 + 2 * shift) / count)
            for i, k in enumerate(_HARMONICS)
        )
    )


def _staircase(axis: DriveAxis) -> Staircase:
    """Each level forth and back for the same time, so that the axis returns."""
    top = _LEVELS[-1] * axis.speed_limit_rad_s
    dwell_s = min(2.0, LIMIT_SHARE * axis.travel_limit_rad / top)
    speeds = tuple(sign * level * axis.speed_limit_rad_s for level in _LEVELS for sign in (1, -1))
    return Staircase(speeds, dwell_s, acceleration_rad_s2=4.0 * top)


def _duration_s(motion: Staircase) -> float:
    speeds = (*motion.speeds_rad_s, 0.0)
    ramps = sum(abs(b - a) / motion.acceleration_rad_s2 for a, b in pairwise(speeds))
    return len(motion.speeds_rad_s) * motion.dwell_s + ramps
