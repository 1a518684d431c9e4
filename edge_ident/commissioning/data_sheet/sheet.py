"""One axis as data sheets describe it, filled in answer by answer."""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from typing import Any, Final

from edge_ident.commissioning.data_sheet.quantities import with_unit
from edge_ident.drive.description import AXIS_RANGES
from edge_ident.errors import DataError

_AT_TABLE: Final = {
    "travel_limit_rad": (2.0, "m from end to end"),
    "speed_limit_rad_s": (1.0, "m/s"),
    "acceleration_rad_s2": (1.0, "m/s^2"),
}
"""Factor and unit in which people know these numbers of a linear axis."""
_RANGES: Final = AXIS_RANGES | {"acceleration_rad_s2": (1e-3, 1e9)}
"""Lowest and highest value of a field, as in the description; acceleration is never zero."""


@dataclass(frozen=True)
class AxisSheet:
    """One axis, as far as it is described; angles and efforts at the gearbox output, in SI.

    Attributes
    ----------
    kind : {"linear", "rotary"}
    encoder_at : {"motor", "output", "table"}
    torque_constant : float or None
        N*m/A of the motor.
    acceleration_rad_s2, rotor_inertia, load_inertia, friction_nm : float or None
        None where it is not known. The inertias, kg*m^2, are those of the motor and of what it
        moves.
    said : mapping
        The answers, by the name of their entry.
    """

    kind: str = "linear"
    gear_ratio: float = 1.0
    screw_lead_m_per_rad: float = 0.0
    encoder_at: str = "motor"
    encoder_counts_per_turn: float = 0.0
    torque_constant: float | None = None
    effort_limit_nm: float = 0.0
    travel_limit_rad: float = 0.0
    speed_limit_rad_s: float = 0.0
    acceleration_rad_s2: float | None = None
    rotor_inertia: float | None = None
    load_inertia: float | None = None
    friction_nm: float | None = None
    said: Mapping[str, str] = field(default_factory=dict)

    @property
    def inertia(self) -> float | None:
        """Inertia of all that moves, kg*m^2, where it is known."""
        if self.rotor_inertia is None or self.load_inertia is None:
            return None
        return self.rotor_inertia + self.load_inertia

    @property
    def rad_per_unit(self) -> float:
        """Angle of the gearbox output per m of a linear axis, or per rad of a rotary one."""
        return 1.0 / self.screw_lead_m_per_rad if self.screw_lead_m_per_rad else 1.0

    @property
    def unit(self) -> str:
        """Unit of the axis's travel."""
        return "m" if self.kind == "linear" else "rad"


Reader = Callable[[AxisSheet, str], Any]


@dataclass(frozen=True)
class Entry:
    """One thing that data sheets say.

    Attributes
    ----------
    name : str
        Also that of the option.
    question : str
        For a linear axis.
    rotary_question : str or None
        For a rotary one; "": the same; None: nothing is asked.
    key : str
        Field of the AxisSheet that the answer fills.
    read : callable
        Turns the text of an answer into that field; raises DataError.
    unit : str
        Of the field.
    bare : (str, str)
        Unit of a bare number, of a linear and a rotary axis.
    default : str or None
        Answer where none is given; "" where it may stay unknown; None where it must be given.
    """

    name: str
    question: str
    rotary_question: str | None
    key: str
    read: Reader
    unit: str = ""
    bare: tuple[str, str] = ("", "")
    default: str | None = None

    def question_for(self, sheet: AxisSheet) -> str | None:
        """What to ask of this axis, None for nothing."""
        linear = sheet.kind == "linear" or self.rotary_question == ""
        return self.question if linear else self.rotary_question


def fill_sheet(sheet: AxisSheet, entry: Entry, text: str) -> AxisSheet:
    """Take in one answer; an empty one leaves the field unknown, where it may be.

    Raises
    ------
    DataError
        The answer cannot be read, or its value is outside the range of a drive description.
    """
    text = with_unit(text, entry.bare[sheet.kind == "rotary"])
    if not text:
        if entry.default is None:
            raise DataError("an answer is needed", "look it up in the data sheet")
        unknown: dict[str, Any] = {entry.key: None}
        return replace(sheet, **unknown)
    value = entry.read(sheet, text)
    low, high = _RANGES.get(entry.key, (-math.inf, math.inf))
    if not isinstance(value, str) and not low <= value <= high:
        raise DataError(
            f"{text} is {value:.4g} {entry.unit}".rstrip(),
            f"allowed are {low:g} to {high:g} {entry.unit}".rstrip(),
        )
    return replace(sheet, **{entry.key: value}, said={**sheet.said, entry.name: text})


def sheet_in_si(sheet: AxisSheet, entry: Entry) -> str:
    """An answer and what it came to, as a person is told it."""
    said, value = sheet.said.get(entry.name, "not known"), getattr(sheet, entry.key)
    if value is None or not entry.unit:
        return said
    text = f"{value:.6g} {entry.unit}"
    if sheet.kind == "linear" and entry.key in _AT_TABLE:
        factor, unit = _AT_TABLE[entry.key]
        text = f"{factor * value / sheet.rad_per_unit:.6g} {unit}, {text}"
    return f"{said} = {text}"
