"""A motion as a file: what `plan` designs, and `capture` and `simulate` follow."""

import math
from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any, Final

from edge_ident.errors import DataError
from edge_ident.support.json_text import read_json, write_json
from edge_ident.support.paths import no_file
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
    write_json(motion_document(trajectory), Path(path))


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
    path = Path(path)
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
    except (KeyError, TypeError, ValueError, AttributeError) as error:
        what = f"{error} is missing" if isinstance(error, KeyError) else str(error)
        raise DataError(f"{path}: {what}", _NEXT) from error


def _trajectory(document: Mapping[str, Any]) -> Trajectory:
    axes = {str(name): _motion(name, of_axis) for name, of_axis in document["axes"].items()}
    if not axes or len({type(motion) for motion in axes.values()}) != 1:
        raise ValueError("its axes need motions, all of one kind")
    return Trajectory(
        axes,  # type: ignore[arg-type]
        _number(document, "duration_s", 1e-3, _LONGEST_S),
        _number(document, "lead_in_s", 1e-3, _LONGEST_S),
    )


def _motion(name: str, of_axis: Mapping[str, Any]) -> Multisine | Staircase:
    if "components" in of_axis:
        sines = of_axis["components"]
        _check_count(name, "components", len(sines), MAXIMUM_COMPONENTS)
        return Multisine(
            tuple(
                SineComponent(
                    _number(sine, "amplitude_rad"),
                    _number(sine, "angular_frequency_rad_s"),
                    _number(sine, "phase_rad"),
                )
                for sine in sines
            )
        )
    speeds = of_axis["speeds_rad_s"]
    _check_count(name, "speeds", len(speeds), MAXIMUM_LEVELS)
    return Staircase(
        tuple(_number({"speed": speed}, "speed") for speed in speeds),
        _number(of_axis, "dwell_s", 0.0),
        _number(of_axis, "acceleration_rad_s2", 1e-9),
    )


def _check_count(name: str, what: str, count: int, most: int) -> None:
    if not 1 <= count <= most:
        raise ValueError(f"axis {name} has {count} {what}, a board takes 1 to {most}")


def _number(
    values: Mapping[str, Any], name: str, low: float = -math.inf, high: float = math.inf
) -> float:
    value = values[name]
    number = isinstance(value, int | float) and not isinstance(value, bool)
    if not number or not math.isfinite(value) or not low <= value <= high:
        raise ValueError(f"{name} is {value!r}")
    return float(value)
