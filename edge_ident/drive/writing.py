"""A drive description as a TOML file whose comments state units and where numbers come from."""

import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import fields
from pathlib import Path
from typing import Final

from edge_ident.drive.description import OPTIONAL, Drive, DriveAxis, load_drive
from edge_ident.support.atomic_files import atomic_write

_MEANING: Final = {
    "period_s": "s, of control loop and capture",
    "angular_frequency_rad_s": "rad/s, of the sine that run and capture command",
    "cycles": "periods in a capture",
    "lead_in_s": "s, from rest into the motion",
    "gear_ratio": "turns of the motor per turn of the gearbox output",
    "encoder_counts_per_turn": "counts per turn of the gearbox output",
    "screw_lead_m_per_rad": "m/rad, travel per angle of the gearbox output",
    "travel_limit_rad": "rad, either way from zero, the middle of the travel",
    "speed_limit_rad_s": "rad/s at the gearbox output",
    "acceleration_limit_rad_s2": "rad/s^2 at the gearbox output",
    "effort_limit_nm": "N*m at the gearbox output",
    "amplitude_rad": "rad, of the sine",
    "phase_rad": "rad, of the sine at its beginning",
}
_TAIL: Final = """
# [board]                            # where the board is, unless --device says it
# device = "/dev/ttyACM0"
# baud_rate = 115200
"""
_WIDTH: Final = 38
"""Columns before the comments."""


def write_drive(
    drive: Drive, path: Path, origins: Mapping[str, str], notes: Sequence[str] = ()
) -> None:
    """Write a description that `load_drive` has read once, whole or not at all.

    Parameters
    ----------
    drive : Drive
        Device and baud rate are not written.
    path : Path
    origins : mapping
        Where numbers come from, such as "300 mm end to end", by "axes.x.travel_limit_rad".
    notes : sequence of str
        Lines for the top of the file.

    Raises
    ------
    DataError
        `load_drive` refuses the description; nothing is written.
    OSError
        The file cannot be written.
    """
    with atomic_write(path) as partial:
        partial.write_text(drive_text(drive, origins, notes), encoding="utf-8")
        load_drive(partial)


def drive_text(drive: Drive, origins: Mapping[str, str], notes: Sequence[str] = ()) -> str:
    """The text that `write_drive` writes."""
    lines = ["# Drive description: edge-ident COMMAND --drive FILE"]
    lines += [f"# - {note}" for note in notes]
    lines += [f"name = {json.dumps(drive.name, ensure_ascii=False)}"]
    lines += _table("sampling", {"period_s": drive.sampling_period_s}, origins)
    keys = ("angular_frequency_rad_s", "cycles", "lead_in_s")
    lines += _table("trajectory", {key: getattr(drive, key) for key in keys}, origins)
    for name, axis in drive.axes.items():
        values = {field.name: getattr(axis, field.name) for field in fields(DriveAxis)}
        values = {k: v for k, v in values.items() if k not in OPTIONAL or v != OPTIONAL[k]}
        lines += _table(f"axes.{name}", values, origins)
    return "\n".join(lines) + "\n" + _TAIL


def _table(name: str, values: Mapping[str, float], origins: Mapping[str, str]) -> Iterator[str]:
    yield ""
    yield f"[{name}]"
    for key, value in values.items():
        origin = origins.get(f"{name}.{key}")
        comment = _MEANING[key] + (f"; {origin}" if origin else "")
        yield f"{f'{key} = {_number(value)}':{_WIDTH}} # {comment}"


def _number(value: float) -> str:
    """The shortest digits that are read back as the same number."""
    return f"{value:.0f}" if value == round(value) and abs(value) < 1e15 else repr(value)
