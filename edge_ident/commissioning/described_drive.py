"""From data sheets to a drive description, with a first motion that the axes can make."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Final

from edge_ident.commissioning.data_sheet import AxisSheet, quantity, with_unit
from edge_ident.drive.description import TABLE_RANGES, Drive, DriveAxis, load_drive
from edge_ident.drive.motions import LIMIT_SHARE
from edge_ident.errors import DataError
from edge_ident.support.words import listed
from firmware_interface.motion import stop_duration_s

# Time to top speed where the acceleration is not known: slow, so that a feed drive can.
_SPEED_UP_S: Final = 1.0
# Part of the rated torque that is kept for friction and weight where they are not known.
_UNKNOWN_FRICTION: Final = 0.5
# What tells an acceleration, with the torque.
_OF_TORQUE: Final = {
    "rotor_inertia": "rotor inertia",
    "load_inertia": "load",
    "friction_nm": "friction",
}
_DIGITS: Final = 10
_MIDDLE: Final = "position zero is the middle of the travel: home the axes, or power up there"


@dataclass(frozen=True)
class DescribedDrive:
    """A drive description made of data sheets.

    Attributes
    ----------
    drive : Drive
    origins : mapping
        Where numbers come from, by "axes.x.travel_limit_rad".
    assumed : tuple of str
        What stands in for what is not known, and why; one line each.
    """

    drive: Drive
    origins: Mapping[str, str]
    assumed: tuple[str, ...]


def sampling_period_s(text: str) -> float:
    """Read a sample rate, in Hz, or a period with its unit.

    Raises
    ------
    DataError
        It is neither, or no board has it.
    """
    value, unit = quantity(with_unit(text, "Hz"), ("Hz", "s"))
    low, high = TABLE_RANGES["sampling"]["period_s"]
    period_s = value if unit.base == "s" else 1.0 / value if value else math.inf
    if not low <= period_s <= high:
        raise DataError(
            f"a sample rate of {text} is a period of {period_s:.4g} s",
            f"allowed are rates of {1 / high:g} to {1 / low:g} Hz; write a period as in 2.5 ms",
        )
    return _rounded(period_s)


def describe_drive(name: str, period_s: float, sheets: Mapping[str, AxisSheet]) -> DescribedDrive:
    """Describe a drive whose axes are filled in.

    Frequency, periods and lead-in are those of the built-in motion: it is slow, as a first motion
    on an unknown machine should be, and the built-in network knows it. The axes are a quarter
    period apart, each with the largest amplitude that its limits allow.

    Parameters
    ----------
    name : str
    period_s : float
        Of sampling.
    sheets : mapping of axis name to AxisSheet
    """
    built_in = load_drive()
    rate = built_in.angular_frequency_rad_s
    axes: dict[str, DriveAxis] = {}
    origins: dict[str, str] = {}
    for index, (axis, sheet) in enumerate(sheets.items()):
        amplitude, limit = _amplitude(sheet, rate)
        axes[axis] = DriveAxis(
            gear_ratio=sheet.gear_ratio,
            encoder_counts_per_turn=_rounded(sheet.encoder_counts_per_turn),
            screw_lead_m_per_rad=_rounded(sheet.screw_lead_m_per_rad),
            travel_limit_rad=_rounded(sheet.travel_limit_rad),
            speed_limit_rad_s=_rounded(sheet.speed_limit_rad_s),
            effort_limit_nm=_rounded(sheet.effort_limit_nm),
            amplitude_rad=_rounded(amplitude),
            phase_rad=_rounded((0.5 * math.pi * index) % (2.0 * math.pi)),
            acceleration_limit_rad_s2=_rounded(sheet.acceleration_rad_s2 or math.inf),
        )
        origins |= {f"axes.{axis}.{key}": text for key, text in _origins(sheet, limit).items()}
    drive = replace(built_in, name=name, sampling_period_s=period_s, axes=axes)
    lines = {axis: _assumed(sheet) for axis, sheet in sheets.items()}
    assumed = (
        f"axis {', '.join(axis for axis in lines if line in lines[axis])}: {line}"
        for line in dict.fromkeys(line for found in lines.values() for line in found)
    )
    return DescribedDrive(drive, origins, (_MIDDLE, *assumed))


def _rounded(value: float) -> float:
    """Without the digits that a person cannot use; a drive and its file have the same number."""
    return float(f"{value:.{_DIGITS}g}")


def _amplitude(sheet: AxisSheet, rate: float) -> tuple[float, str]:
    """Largest amplitude at a frequency, and which limit it keeps."""
    limits = {
        "travel": LIMIT_SHARE * sheet.travel_limit_rad,
        "top speed": LIMIT_SHARE * sheet.speed_limit_rad_s / rate,
        "acceleration": LIMIT_SHARE * _acceleration(sheet) / rate**2,
    }
    limit = min(limits, key=lambda name: limits[name])
    amplitude, text = limits[limit], f"{LIMIT_SHARE:.0%} of the {limit}"
    while _reach(amplitude, rate) > sheet.travel_limit_rad:
        amplitude, text = 0.95 * amplitude, "room for the way to a stop"
    return amplitude, text


def _reach(amplitude: float, rate: float) -> float:
    """Furthest point of a sine that is stopped at the worst moment."""
    stop_s = stop_duration_s(amplitude * rate)
    return amplitude * math.hypot(1.0, 0.5 * rate * stop_s)


def _acceleration(sheet: AxisSheet) -> float:
    """What the axis can do, by its data sheet and by its torque, as far as both are known."""
    known = []
    if sheet.acceleration_rad_s2 is not None:
        known.append(sheet.acceleration_rad_s2)
    if sheet.inertia:
        friction = sheet.friction_nm
        if friction is None:
            friction = _UNKNOWN_FRICTION * sheet.effort_limit_nm
        left = max(sheet.effort_limit_nm - friction, 0.0)
        known.append(left / sheet.inertia)
    return min(known, default=sheet.speed_limit_rad_s / _SPEED_UP_S)


def _origins(sheet: AxisSheet, limit: str) -> dict[str, str]:
    said = sheet.said
    encoder = with_unit(said["encoder"], "um" if sheet.encoder_at == "table" else "counts")
    found = {
        "encoder_counts_per_turn": f"from {encoder} at the {sheet.encoder_at}",
        "travel_limit_rad": f"from {said['travel']} end to end",
        "speed_limit_rad_s": f"from {said['speed']}",
        "effort_limit_nm": f"from {said['torque']} of the motor times the gear ratio",
        "amplitude_rad": limit,
    }
    if sheet.kind == "linear":
        found["screw_lead_m_per_rad"] = f"from {said['lead']} a turn"
    return found


def _assumed(sheet: AxisSheet) -> list[str]:
    """What stands in for what is not known of an axis; it makes the motion slower, never faster."""
    if sheet.inertia and sheet.friction_nm is None:
        return [f"friction not known: {_UNKNOWN_FRICTION:.0%} of the torque is kept for it"]
    lines = []
    unused = [text for known, text in _OF_TORQUE.items() if getattr(sheet, known) is not None]
    if not sheet.inertia and unused:
        lines.append(
            f"{listed(unused)} not used: the torque tells an acceleration where both rotor inertia "
            "and load are known"
        )
    if not sheet.inertia and sheet.acceleration_rad_s2 is None:
        lines.append(
            f"acceleration not known: {_SPEED_UP_S:g} s to top speed is assumed; most drives need "
            "less"
        )
    return lines
