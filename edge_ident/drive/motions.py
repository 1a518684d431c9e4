"""A motion as a file: what `plan` designs, and `capture` and `simulate` follow."""

import math
from collections.abc import Mapping
from dataclasses import asdict, replace
from itertools import pairwise
from pathlib import Path
from typing import Any, Final, Literal

from edge_ident.drive.description import Drive, DriveAxis
from edge_ident.errors import DataError, ModelError
from edge_ident.support.documents import no_file, read_json, write_json
from edge_ident.support.given import check_type
from edge_ident.support.given import path as path_of
from edge_ident.support.words import listed
from firmware_interface.motion import (
    MAXIMUM_COMPONENTS,
    MAXIMUM_LEVELS,
    Multisine,
    SineComponent,
    Staircase,
    Trajectory,
)

SCHEMA: Final = "edge-ident/motion/1"
_NEXT: Final = "write the file with edge-ident plan RECORDING --output FILE"
_LONGEST_S: Final = 86_400.0
# Largest path, phase, frequency or speed, in rad and s: beyond any board, and finite squared.
_LARGEST: Final = 1e5


def motion_document(trajectory: Trajectory) -> dict[str, Any]:
    """Schema edge-ident/motion/1: numbers in rad and s, time zero at the first captured sample."""
    return {
        "schema": SCHEMA,
        "duration_s": trajectory.duration_s,
        "lead_in_s": trajectory.lead_in_s,
        "axes": {name: asdict(motion) for name, motion in trajectory.axes.items()},
    }


def save_motion(trajectory: Trajectory, path: str | Path) -> None:
    """Write a motion, whole or not at all.

    Parameters
    ----------
    trajectory : Trajectory
    path : str or Path

    Examples
    --------
    >>> import edge_ident
    >>> trajectory = edge_ident.load_drive().trajectory()
    >>> edge_ident.save_motion(trajectory, "motion.json")
    >>> edge_ident.load_motion("motion.json") == trajectory
    True
    """
    check_type(trajectory, Trajectory, "give what load_motion returned, or a plan's trajectory")
    write_json(motion_document(trajectory), path_of(path, "the file to write (.json)"))


def load_motion(path: str | Path) -> Trajectory:
    """Read a motion.

    Parameters
    ----------
    path : str or Path

    Returns
    -------
    Trajectory

    Raises
    ------
    DataError
        There is no such file, it is no motion, or a number is missing, not finite, or none that
        a board takes.

    Examples
    --------
    >>> import edge_ident
    >>> edge_ident.save_motion(edge_ident.load_drive().trajectory(), "motion.json")
    >>> list(edge_ident.load_motion("motion.json").axes)
    ['x', 'z']
    """
    path = path_of(path, "a motion (.json)")
    if not path.is_file():
        raise DataError(no_file(path), _NEXT)
    try:
        document = read_json(path)
    except ValueError as error:
        raise DataError(f"{path}: it is no JSON: {error}", _NEXT) from error
    if not isinstance(document, dict) or document.get("schema") != SCHEMA:
        raise DataError(f"{path}: its schema is not {SCHEMA}", _NEXT)
    try:
        return _trajectory(document)
    except ValueError as error:
        raise DataError(f"{path}: {error}", _NEXT) from error


def _trajectory(document: Mapping[str, Any]) -> Trajectory:
    of_axes = _entry(document, "axes", dict)
    axes = {name: _motion(f"axes.{name}", of_axis) for name, of_axis in of_axes.items()}
    if not axes or len({type(motion) for motion in axes.values()}) != 1:
        raise ValueError("its axes need motions, all of one kind")
    return Trajectory(
        axes,  # type: ignore[arg-type]
        _number(document, "duration_s", 1e-3, _LONGEST_S),
        _number(document, "lead_in_s", 1e-3, _LONGEST_S),
    )


def _motion(place: str, of_axis: Any) -> Multisine | Staircase:
    _check_kind(place, of_axis, dict)
    if "components" in of_axis:
        sines = _entry(of_axis, "components", list, place)
        _check_count(place, "components", len(sines), MAXIMUM_COMPONENTS)
        return Multisine(
            tuple(_sine(f"{place}.components[{k}]", sine) for k, sine in enumerate(sines))
        )
    speeds = _entry(of_axis, "speeds_rad_s", list, place)
    _check_count(place, "speeds", len(speeds), MAXIMUM_LEVELS)
    return Staircase(
        tuple(
            _checked(f"{place}.speeds_rad_s[{k}]", speed, -_LARGEST, _LARGEST)
            for k, speed in enumerate(speeds)
        ),
        _number(of_axis, "dwell_s", 0.0, _LONGEST_S, place),
        _number(of_axis, "acceleration_rad_s2", 1e-9, _LARGEST**2, place),
    )


def _sine(place: str, sine: Any) -> SineComponent:
    _check_kind(place, sine, dict)
    names = ("amplitude_rad", "angular_frequency_rad_s", "phase_rad")
    return SineComponent(*(_number(sine, name, -_LARGEST, _LARGEST, place) for name in names))


def _check_count(place: str, what: str, count: int, most: int) -> None:
    if not 1 <= count <= most:
        raise ValueError(f"{place} has {count} {what}, a board takes 1 to {most}")


def _entry(values: Mapping[str, Any], name: str, kind: type, place: str = "") -> Any:
    """What stands under a name, of the kind that it must be."""
    where = f"{place}.{name}".removeprefix(".")
    if name not in values:
        raise ValueError(f"{where} is missing")
    _check_kind(where, values[name], kind)
    return values[name]


def _check_kind(place: str, value: Any, kind: type) -> None:
    if not isinstance(value, kind):
        what = "an object with names" if kind is dict else "a list"
        raise ValueError(f"{place} is {value!r:.30}, and must be {what}")


def _number(
    values: Mapping[str, Any], name: str, low: float, high: float, place: str = ""
) -> float:
    where = f"{place}.{name}".removeprefix(".")
    if name not in values:
        raise ValueError(f"{where} is missing")
    return _checked(where, values[name], low, high)


def _checked(place: str, value: Any, low: float, high: float) -> float:
    number = isinstance(value, int | float) and not isinstance(value, bool)
    if not number or not low <= value <= high:
        must = f"a number from {low:g} to {high:g}"
        raise ValueError(f"{place} is {value!r:.30}, and must be {must}")
    return float(value)


# Motions to choose from: the description's own sinusoid, and richer ones that excite more.

MotionName = Literal["sinusoid", "multisine", "staircase"]
MOTIONS: Final[tuple[MotionName, ...]] = ("sinusoid", "multisine", "staircase")

# Multiples of the description's frequency; high ones give the acceleration inertia needs.
_HARMONICS: Final = (1, 3, 7, 11, 17, 23)
LIMIT_SHARE: Final = 0.7
"""Part of the speed and travel limits that a motion may use."""
# Speeds of the staircase as shares of the limit, each both ways.
_LEVELS: Final = (0.05, 0.1, 0.2, 0.35, 0.5)


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


def scaled(motion: Multisine | Staircase, share: float) -> Multisine | Staircase:
    """A motion with all positions, speeds and accelerations scaled."""
    if isinstance(motion, Multisine):
        return Multisine(
            tuple(replace(c, amplitude_rad=share * c.amplitude_rad) for c in motion.components)
        )
    return replace(
        motion,
        speeds_rad_s=tuple(share * speed for speed in motion.speeds_rad_s),
        acceleration_rad_s2=share * motion.acceleration_rad_s2,
    )
