"""The drive description in TOML: what is known about the machine before it moves.

The paper's feed drive is built in. A file with the same keys describes another drive. A mistake
gets an error with its line and the allowed range.
"""

import json
import math
import re
import shlex
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, fields, replace
from os import PathLike
from pathlib import Path
from typing import Any, Final

from edge_ident.errors import DataError
from edge_ident.support import documents
from edge_ident.support.given import path as path_of
from edge_ident.support.given import type_of
from edge_ident.support.words import brief
from firmware_interface.motion import Multisine, SineComponent, Trajectory

BUILT_IN: Final = Path(__file__).with_name("feed_drive.toml")
AXIS_RANGES: Final = {
    "gear_ratio": (1e-3, 1e4),
    "encoder_counts_per_turn": (4, 2**31),
    "screw_lead_m_per_rad": (1e-6, 1.0),
    "travel_limit_rad": (1e-3, 1e5),
    "speed_limit_rad_s": (1e-4, 1e4),
    "acceleration_limit_rad_s2": (1e-3, 1e9),
    "effort_limit_nm": (1e-4, 1e5),
    "amplitude_rad": (1e-4, 1e5),
    "phase_rad": (-2 * math.pi, 2 * math.pi),
}
"""Lowest and highest value of each key of an axis."""
TABLE_RANGES: Final = {
    "sampling": {"period_s": (1e-5, 0.1)},
    "trajectory": {
        "angular_frequency_rad_s": (1e-3, 1e3),
        "cycles": (1, 1000),
        "lead_in_s": (0.1, 60.0),
    },
}
"""Lowest and highest value of each key of the other tables."""
OPTIONAL: Final = {"screw_lead_m_per_rad": 0.0, "acceleration_limit_rad_s2": math.inf}
"""Keys that an axis may lack, and what that means: it only turns; its effort is the only limit."""
_SLOWEST_BAUD: Final = 50
_FASTEST_BAUD: Final = 10**8  # ten times what the fastest serial adapters do
_BOARD_KEYS: Final = {
    "device": (str, 'a text, such as "/dev/ttyACM0"'),
    "baud_rate": (int, f"a whole number from {_SLOWEST_BAUD} to {_FASTEST_BAUD}"),
}
_TABLES: Final = {"name", "axes", "board", *TABLE_RANGES}


@dataclass(frozen=True)
class DriveAxis:
    """One axis: mechanics, limits and its share of the default trajectory.

    Angles, speeds and torques are those of the gearbox output. The travel limit is the largest
    distance from zero; the lead is 0 for an axis that only turns, and the limit of acceleration is
    infinite where the effort alone bounds it.

    Examples
    --------
    >>> import edge_ident
    >>> edge_ident.load_drive().axes["x"].encoder_counts_per_turn
    8400.0
    """

    gear_ratio: float
    encoder_counts_per_turn: float
    screw_lead_m_per_rad: float
    travel_limit_rad: float
    speed_limit_rad_s: float
    effort_limit_nm: float
    amplitude_rad: float
    phase_rad: float
    acceleration_limit_rad_s2: float = math.inf

    @property
    def encoder_resolution_rad(self) -> float:
        """Angle of one count at the gearbox output."""
        return 2.0 * math.pi / self.encoder_counts_per_turn


@dataclass(frozen=True)
class Drive:
    """A drive, as its user describes it.

    Attributes
    ----------
    name : str
    sampling_period_s : float
    angular_frequency_rad_s : float
        Of the default motion, one sine per axis.
    cycles : int
        Periods of that motion.
    lead_in_s : float
        Time from rest into the motion.
    axes : mapping of axis name to DriveAxis
    device, baud_rate
        Where the board is found when neither a flag nor the environment says so.

    Examples
    --------
    >>> import edge_ident
    >>> drive = edge_ident.load_drive()
    >>> list(drive.axes), drive.sampling_period_s
    (['x', 'z'], 0.0025)
    """

    name: str
    sampling_period_s: float
    angular_frequency_rad_s: float
    cycles: int
    lead_in_s: float
    axes: Mapping[str, DriveAxis]
    device: str | None = None
    baud_rate: int | None = None

    def check_axes(self, names: Iterable[str]) -> None:
        """Check that axes are described.

        Raises
        ------
        DataError
            One is not.
        """
        named = list(names)
        unknown = [name for name in named if name not in self.axes]
        if unknown:
            axes = shlex.join(part for name in named for part in ("--axis", name))
            raise DataError(
                f"the described drive ({self.name}) has axes {', '.join(self.axes)}, but not "
                f"{', '.join(unknown)}",
                f"describe your machine with edge-ident init {axes}, and give that file with "
                "--drive (without it, the built-in drive is taken), or rename columns (--column)",
            )

    def for_axes(self, names: Iterable[str]) -> "Drive":
        """This drive for the axes of a recording; where both have one, it goes by that name.

        Raises
        ------
        DataError
            An axis is not described, and which is which is not certain.
        """
        wanted = list(names)
        if len(wanted) == len(self.axes) == 1:
            return replace(self, axes=dict(zip(wanted, self.axes.values(), strict=True)))
        self.check_axes(wanted)
        return self

    def trajectory(self, cycles: int | None = None) -> Trajectory:
        """The default motion: one sine per axis, whole cycles of it."""
        rate = self.angular_frequency_rad_s
        return Trajectory(
            axes={
                name: Multisine((SineComponent(axis.amplitude_rad, rate, axis.phase_rad),))
                for name, axis in self.axes.items()
            },
            duration_s=(cycles or self.cycles) * 2.0 * math.pi / rate,
            lead_in_s=self.lead_in_s,
        )


def load_drive(path: str | PathLike[str] | None = None) -> Drive:
    """Read a drive description, or the built-in feed drive.

    Parameters
    ----------
    path : str or Path, optional
        A TOML file; without one, the built-in feed drive.

    Returns
    -------
    Drive

    Raises
    ------
    DataError
        The file is missing, is no TOML, lacks a key, or a value is outside its range; the
        message names the line.

    Examples
    --------
    >>> import edge_ident
    >>> drive = edge_ident.load_drive()
    >>> drive.sampling_period_s
    0.0025
    """
    if path is None:
        return _Reader(BUILT_IN.name, BUILT_IN.read_text("utf-8")).drive()
    path = path_of(path, "a drive description (.toml)")
    if not path.is_file():
        raise DataError(documents.no_file(path), "give the path of a drive description (.toml)")
    try:
        content = documents.read_bytes(path, documents.MOST_DESCRIPTION_BYTES)
    except documents.TooLargeError as error:
        raise DataError(f"{path}: {error}", "give a drive description (.toml)") from error
    return _Reader(str(path), content.decode("utf-8", errors="replace")).drive()


def given_drive(drive: Drive | str | PathLike[str] | None) -> Drive:
    """The drive that a caller gives: a description, the path of one, or none for the built-in one.

    Raises
    ------
    DataError
        As of `load_drive`; it is none of these.
    """
    if isinstance(drive, Drive):
        return drive
    if drive is None or isinstance(drive, str | PathLike):
        return load_drive(drive)
    raise DataError(
        f"{type_of(drive)} is no drive description",
        "give what load_drive returned, or the path of a drive description (.toml)",
    )


class _Reader:
    """Parses one text and knows on which line each key stands."""

    def __init__(self, source: str, text: str) -> None:
        self.source = source
        self.lines = text.splitlines()
        try:
            self.data = documents.from_toml(text)
        except ValueError as error:
            raise DataError(f"{source}: {error}", "correct the TOML there") from error

    def drive(self) -> Drive:
        unknown = set(self.data) - _TABLES
        if unknown:
            raise self.error("", min(unknown), "is not known", f"known: {sorted(_TABLES)}")
        axes = self.data.get("axes")
        if not isinstance(axes, dict) or not axes:
            raise DataError(f"{self.source}: it describes no axis", "add a table [axes.x]")
        values = {table: self.numbers(table, r) for table, r in TABLE_RANGES.items()}
        drive = Drive(
            name=str(self.data.get("name", "drive")),
            sampling_period_s=values["sampling"]["period_s"],
            angular_frequency_rad_s=values["trajectory"]["angular_frequency_rad_s"],
            cycles=int(values["trajectory"]["cycles"]),
            lead_in_s=values["trajectory"]["lead_in_s"],
            axes={name: self.axis(f"axes.{name}") for name in axes},
            **self.board(),
        )
        for name, axis in drive.axes.items():
            self.check_motion(f"axes.{name}", axis, drive.angular_frequency_rad_s)
        return drive

    def axis(self, table: str) -> DriveAxis:
        given = self.table(table, set(AXIS_RANGES))
        ranges = {k: r for k, r in AXIS_RANGES.items() if k in given or k not in OPTIONAL}
        return DriveAxis(**{**OPTIONAL, **self.numbers(table, ranges)})

    def numbers(self, table: str, ranges: Mapping[str, tuple[float, float]]) -> dict[str, float]:
        given = self.table(table, set(ranges))
        for key, (low, high) in ranges.items():
            if key not in given:
                raise self.error(table, None, f"lacks {key}", f"add {key} = {low:g} … {high:g}")
            value = given[key]
            number = isinstance(value, int | float) and not isinstance(value, bool)
            if not number or not low <= value <= high:
                raise self.error(
                    table,
                    key,
                    f"is {brief(value)}",
                    f"allowed are numbers from {low:g} to {high:g}",
                )
        return {key: float(given[key]) for key in ranges}

    def board(self) -> dict[str, Any]:
        given = self.table("board", set(_BOARD_KEYS))
        for key, value in given.items():
            kind, allowed = _BOARD_KEYS[key]
            sound = isinstance(value, kind) and not isinstance(value, bool)
            if not sound or (kind is int and not _SLOWEST_BAUD <= value <= _FASTEST_BAUD):
                raise self.error("board", key, f"is {brief(value)}", f"give {allowed}")
        return given

    def check_motion(self, table: str, axis: DriveAxis, rate: float) -> None:
        """The default trajectory must stay inside the limits described beside it."""
        if axis.amplitude_rad > axis.travel_limit_rad:
            raise self.error(
                table, "amplitude_rad", "exceeds the travel limit",
                f"allowed are at most {axis.travel_limit_rad:g}",
            )  # fmt: skip
        if axis.amplitude_rad * rate > axis.speed_limit_rad_s:
            raise self.error(
                table, "amplitude_rad", f"moves at {axis.amplitude_rad * rate:.3g} rad/s, "
                "above the speed limit",
                f"allowed are at most {axis.speed_limit_rad_s / rate:.3g} at this frequency",
            )  # fmt: skip

    def table(self, name: str, known: set[str]) -> dict[str, Any]:
        found: Any = self.data
        for part in name.split("."):
            found = found.get(part, {})
        if not isinstance(found, dict):
            raise self.error("", name, "is not a table", f"write [{name}]")
        unknown = set(found) - known
        if unknown:
            raise self.error(name, min(unknown), "is not known", f"known: {sorted(known)}")
        return found

    def error(self, table: str, key: str | None, cause: str, next_step: str) -> DataError:
        name = ".".join(part for part in (table, key) if part)
        return DataError(f"{self.source}, line {self.line(table, key)}: {name} {cause}", next_step)

    def line(self, table: str, key: str | None) -> int:
        """Line of a key, else of its table, else the last line."""
        current, header = "", len(self.lines)
        for number, line in enumerate(self.lines, start=1):
            if heading := re.match(r"\s*\[([^\]]+)\]", line):
                current = heading[1].replace('"', "").strip()
                if current == table:
                    header = number
            if current == table and key and re.match(rf'\s*"?{re.escape(key)}"?\s*=', line):
                return number
        return header


# A drive description as a TOML file whose comments state units and where numbers come from.

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
_WIDTH: Final = 38  # columns before the comments


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
    with documents.atomic_write(path) as partial:
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
