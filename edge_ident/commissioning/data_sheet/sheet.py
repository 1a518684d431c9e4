"""One axis as data sheets describe it, filled in answer by answer."""

import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from typing import Any, Final

from edge_ident.commissioning.data_sheet.quantities import with_unit
from edge_ident.drive.description import AXIS_RANGES
from edge_ident.errors import DataError
from edge_ident.signals.scale_checks import LONG_M, SMALL_RAD, TURNS, check_inertia

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


# Questions about answers that are possible, and unlikely of a feed drive: mostly wrong units.

_TURN: Final = 2.0 * math.pi
_LEAD_M: Final = (2e-4, 0.5)
"""Travel per turn: from the finest lead screws to pulleys and pinions of a hand's width."""
_RATIO: Final = (1.0, 1000.0)
"""Gearboxes of feed drives reduce the speed; few have more than three stages of ten."""
_COUNT_M: Final = (1e-9, 1e-5)
"""Linear scales end at a nanometre; a feed drive is accurate to better than ten micrometres."""
_COUNT_RAD: Final = (_TURN / 2**32, _TURN / 3600.0)
"""Counts of a rotary axis: finer than any encoder, and coarser than a tenth of a degree."""
_TORQUE_NM: Final = (1e-3, 1e3)
"""Rated, of motors from finger to barrel size."""
_MOTOR_RAD_S: Final = 60_000.0 * _TURN / 60.0
"""Faster than servo motors and most spindles."""
_SHORT_M: Final = 1e-3
"""Travel of an axis that flexures guide, not a screw."""
_CROSSING_S: Final = (0.02, 600.0)
"""Time from end to end at top speed."""
_SPEED_UP_S: Final = (1e-3, 60.0)
"""Time from rest to top speed."""
_PEAK: Final = 5.0
"""Peak over rated torque of servo motors, at most."""
_PERIOD_S: Final = (5e-5, 0.01)
"""Sampling period of position loops: 20 kHz to 100 Hz."""


def sheet_doubts(sheet: AxisSheet, entry: Entry) -> list[str]:
    """What to ask about the answer that was taken in last, one line each."""
    asked = {
        "lead": _lead,
        "gear_ratio": _gear_ratio,
        "encoder": _encoder,
        "torque": _torque,
        "travel": _travel,
        "speed": _speed,
        "acceleration": _acceleration,
        "load": _inertia,
    }
    known = getattr(sheet, entry.key) is not None
    return list(asked[entry.name](sheet)) if known and entry.name in asked else []


def period_doubts(period_s: float) -> list[str]:
    """What to ask about a sampling period."""
    if _within(period_s, _PERIOD_S):
        return []
    return [f"the position loop runs at {1.0 / period_s:.4g} Hz: is the unit right?"]


def _within(value: float, limits: tuple[float, float]) -> bool:
    return limits[0] <= value <= limits[1]


def _lead(sheet: AxisSheet) -> Iterator[str]:
    lead_m = _TURN * sheet.screw_lead_m_per_rad
    if not _within(lead_m, _LEAD_M):
        yield f"one turn moves the table by {1e3 * lead_m:.4g} mm: is the lead in mm?"


def _gear_ratio(sheet: AxisSheet) -> Iterator[str]:
    if sheet.gear_ratio < _RATIO[0]:
        yield (
            "the screw turns faster than the motor: is the ratio turns of the motor per turn of "
            f"the screw, {1.0 / sheet.gear_ratio:.4g}?"
        )
    elif sheet.gear_ratio > _RATIO[1]:
        yield f"the motor turns {sheet.gear_ratio:.4g} times for one turn of the output"


def _encoder(sheet: AxisSheet) -> Iterator[str]:
    count_rad = _TURN / sheet.encoder_counts_per_turn
    if sheet.kind == "linear":
        count_m = count_rad * sheet.screw_lead_m_per_rad
        if not _within(count_m, _COUNT_M):
            yield (
                f"one count is {1e6 * count_m:.3g} um at the table: are these counts (4 per line) "
                f"of one turn, and is the encoder at the {sheet.encoder_at}?"
            )
    elif not _within(count_rad, _COUNT_RAD):
        yield (
            f"one count is {math.degrees(count_rad):.3g} degrees of the axis: are these counts "
            f"(4 per line) of one turn, and is the encoder at the {sheet.encoder_at}?"
        )


def _torque(sheet: AxisSheet) -> Iterator[str]:
    at_motor = sheet.effort_limit_nm / sheet.gear_ratio
    if not _within(at_motor, _TORQUE_NM):
        yield f"the motor gives {at_motor:.3g} Nm: is it the motor's torque, and its unit right?"


def _travel(sheet: AxisSheet) -> Iterator[str]:
    travel = 2.0 * sheet.travel_limit_rad / sheet.rad_per_unit
    if sheet.kind == "linear":
        if not _within(travel, (_SHORT_M, LONG_M)):
            yield f"the axis travels {travel:.4g} m: is the unit right?"
    elif not _within(travel, (SMALL_RAD, TURNS * _TURN)):
        yield f"the axis turns by {math.degrees(travel):.4g} degrees: is the unit right?"


def _speed(sheet: AxisSheet) -> Iterator[str]:
    of_motor = sheet.speed_limit_rad_s * sheet.gear_ratio
    crossing_s = 2.0 * sheet.travel_limit_rad / sheet.speed_limit_rad_s
    if of_motor > _MOTOR_RAD_S:
        yield f"the motor turns at {of_motor * 60.0 / _TURN:.4g} rpm: are speed and unit right?"
    if not _within(crossing_s, _CROSSING_S):
        yield (
            f"the axis needs {crossing_s:.3g} s from end to end at top speed: is the speed that "
            "of the motor in rpm, or that of the axis with its unit?"
        )


def _acceleration(sheet: AxisSheet) -> Iterator[str]:
    assert sheet.acceleration_rad_s2 is not None
    rise_s = sheet.speed_limit_rad_s / sheet.acceleration_rad_s2
    if not _within(rise_s, _SPEED_UP_S):
        yield f"the axis needs {rise_s:.3g} s to its top speed: is the unit right?"


def _inertia(sheet: AxisSheet) -> Iterator[str]:
    inertia = sheet.inertia
    if inertia is None:
        return
    yield from (question.message for question in check_inertia("", inertia, "kg*m^2"))
    if sheet.acceleration_rad_s2 is not None:
        needed = inertia * sheet.acceleration_rad_s2
        if needed > _PEAK * sheet.effort_limit_nm:
            yield (
                f"with this inertia, the acceleration takes {needed / sheet.gear_ratio:.3g} Nm of "
                f"the motor, {needed / sheet.effort_limit_nm:.3g} times its torque: are inertia, "
                "acceleration and torque right?"
            )
