"""What data sheets say of an axis, in which units, and what of it is doubtful."""

import math
import re
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from typing import Any, Final

from edge_ident.drive.description import AXIS_RANGES
from edge_ident.errors import DataError
from edge_ident.files.units import Unit, count_unit, known_unit
from edge_ident.signals.scale_checks import LONG_M, SMALL_RAD, TURNS, check_inertia

# Numbers with a unit, as data sheets print them.

_G_M_S2: Final = 9.80665
# Units that no column of a recording has; a bare number is one of them.
_ONLY_ON_SHEETS: Final = {
    "": Unit(""),
    "Hz": Unit("Hz"),
    "kHz": Unit("Hz", 1e3),
    "m/s2": Unit("m/s2"),
    "mm/s2": Unit("m/s2", 1e-3),
    "g": Unit("m/s2", _G_M_S2),
    "rad/s2": Unit("rad/s2"),
    "deg/s2": Unit("rad/s2", math.pi / 180.0),
    "°/s2": Unit("rad/s2", math.pi / 180.0),
    "kg": Unit("kg"),
    "kgm2": Unit("kg*m2"),
    "kgcm2": Unit("kg*m2", 1e-4),
    "kgmm2": Unit("kg*m2", 1e-6),
    "gcm2": Unit("kg*m2", 1e-7),
    "Nm/A": Unit("N*m/A"),
    "mNm/A": Unit("N*m/A", 1e-3),
}
# A unit that data sheets print, by base.
_USUAL: Final = {
    "Hz": "Hz",
    "s": "ms",
    "m": "mm",
    "rad": "deg",
    "m/s": "mm/s",
    "rad/s": "rpm",
    "m/s2": "m/s2",
    "rad/s2": "rad/s2",
    "N": "N",
    "N*m": "Nm",
    "A": "A",
    "N*m/A": "Nm/A",
    "kg": "kg",
    "kg*m2": "kgcm2",
}
_NUMBER: Final = re.compile(r"(\d+(?:\.\d*)?(?:[eE][-+]?\d+)?|\.\d+)\s*(.*)")


def unit_named(text: str) -> Unit | None:
    """The unit that a text names; signs of multiplication and power may be left out."""
    plain = re.sub(r"[·* ^]", "", text).replace("²", "2")
    return _ONLY_ON_SHEETS.get(plain) or known_unit(text)


def quantity(text: str, bases: tuple[str, ...]) -> tuple[float, Unit]:
    """Read a number and its unit.

    Parameters
    ----------
    text : str
        Such as "300 mm" or "300mm".
    bases : tuple of str
        Units to which the one that is given must convert; "" for a bare number.

    Returns
    -------
    (float, Unit)
        The value in the unit's base, and the unit.

    Raises
    ------
    DataError
        It is no positive number or zero, or in another kind of unit.
    """
    units = " or ".join(_USUAL[base] for base in bases if base)
    next_step = f"write a number with its unit, such as {units}" if units else "write a number"
    if "," in text:
        raise DataError(f"{text!r} has a comma", "write decimals with a point, thousands without")
    match = _NUMBER.fullmatch(text.strip())
    if match is None or not math.isfinite(float(match[1])):
        raise DataError(f"{text!r} is not a positive number", next_step)
    unit = unit_named(match[2])
    if unit is None or unit.base not in bases:
        raise DataError(f"{match[2]!r} is not a unit of this quantity", next_step)
    return float(match[1]) * unit.factor, unit


def with_unit(text: str, unit: str) -> str:
    """A text to which the unit is added if it is a bare number."""
    match = _NUMBER.fullmatch(text.strip())
    return f"{text.strip()} {unit}" if match and unit and not match[2] else text.strip()


# One axis as data sheets describe it, filled in answer by answer.


# Factor and unit in which people know these numbers of a linear axis.
_AT_TABLE: Final = {
    "travel_limit_rad": (2.0, "m from end to end"),
    "speed_limit_rad_s": (1.0, "m/s"),
    "acceleration_rad_s2": (1.0, "m/s^2"),
}
# Lowest and highest value of a field, as in the description; acceleration is never zero.
_RANGES: Final = AXIS_RANGES | {"acceleration_rad_s2": (1e-3, 1e9)}


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
# Travel per turn: from the finest lead screws to pulleys and pinions of a hand's width.
_LEAD_M: Final = (2e-4, 0.5)
# Gearboxes of feed drives reduce the speed; few have more than three stages of ten.
_RATIO: Final = (1.0, 1000.0)
# Linear scales end at a nanometre; a feed drive is accurate to better than ten micrometres.
_COUNT_M: Final = (1e-9, 1e-5)
# Counts of a rotary axis: finer than any encoder, and coarser than a tenth of a degree.
_COUNT_RAD: Final = (_TURN / 2**32, _TURN / 3600.0)
_TORQUE_NM: Final = (1e-3, 1e3)  # rated, of motors from finger to barrel size
_MOTOR_RAD_S: Final = 60_000.0 * _TURN / 60.0  # faster than servo motors and most spindles
_SHORT_M: Final = 1e-3  # travel of an axis that flexures guide, not a screw
_CROSSING_S: Final = (0.02, 600.0)  # time from end to end at top speed
_SPEED_UP_S: Final = (1e-3, 60.0)  # time from rest to top speed
_PEAK: Final = 5.0  # peak over rated torque of servo motors, at most
_PERIOD_S: Final = (5e-5, 0.01)  # sampling period of position loops: 20 kHz to 100 Hz


def sheet_doubts(sheet: AxisSheet, entry: Entry) -> list[str]:
    """What to ask about the answer that was taken in last, one line each."""
    asked = {
        "lead": _lead_doubts,
        "gear_ratio": _gear_ratio_doubts,
        "encoder": _encoder_doubts,
        "torque": _torque_doubts,
        "travel": _travel_doubts,
        "speed": _speed_doubts,
        "acceleration": _acceleration_doubts,
        "load": _inertia_doubts,
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


def _lead_doubts(sheet: AxisSheet) -> Iterator[str]:
    lead_m = _TURN * sheet.screw_lead_m_per_rad
    if not _within(lead_m, _LEAD_M):
        yield f"one turn moves the table by {1e3 * lead_m:.4g} mm: is the lead in mm?"


def _gear_ratio_doubts(sheet: AxisSheet) -> Iterator[str]:
    if sheet.gear_ratio < _RATIO[0]:
        yield (
            "the screw turns faster than the motor: is the ratio turns of the motor per turn of "
            f"the screw, {1.0 / sheet.gear_ratio:.4g}?"
        )
    elif sheet.gear_ratio > _RATIO[1]:
        yield f"the motor turns {sheet.gear_ratio:.4g} times for one turn of the output"


def _encoder_doubts(sheet: AxisSheet) -> Iterator[str]:
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


def _torque_doubts(sheet: AxisSheet) -> Iterator[str]:
    at_motor = sheet.effort_limit_nm / sheet.gear_ratio
    if not _within(at_motor, _TORQUE_NM):
        yield f"the motor gives {at_motor:.3g} Nm: is it the motor's torque, and its unit right?"


def _travel_doubts(sheet: AxisSheet) -> Iterator[str]:
    travel = 2.0 * sheet.travel_limit_rad / sheet.rad_per_unit
    if sheet.kind == "linear":
        if not _within(travel, (_SHORT_M, LONG_M)):
            yield f"the axis travels {travel:.4g} m: is the unit right?"
    elif not _within(travel, (SMALL_RAD, TURNS * _TURN)):
        yield f"the axis turns by {math.degrees(travel):.4g} degrees: is the unit right?"


def _speed_doubts(sheet: AxisSheet) -> Iterator[str]:
    of_motor = sheet.speed_limit_rad_s * sheet.gear_ratio
    crossing_s = 2.0 * sheet.travel_limit_rad / sheet.speed_limit_rad_s
    if of_motor > _MOTOR_RAD_S:
        yield f"the motor turns at {of_motor * 60.0 / _TURN:.4g} rpm: are speed and unit right?"
    if not _within(crossing_s, _CROSSING_S):
        yield (
            f"the axis needs {crossing_s:.3g} s from end to end at top speed: is the speed that "
            "of the motor in rpm, or that of the axis with its unit?"
        )


def _acceleration_doubts(sheet: AxisSheet) -> Iterator[str]:
    assert sheet.acceleration_rad_s2 is not None
    rise_s = sheet.speed_limit_rad_s / sheet.acceleration_rad_s2
    if not _within(rise_s, _SPEED_UP_S):
        yield f"the axis needs {rise_s:.3g} s to its top speed: is the unit right?"


def _inertia_doubts(sheet: AxisSheet) -> Iterator[str]:
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


# What data sheets say of an axis, and how it becomes the numbers of a drive description.
#
# Torques, inertias and speeds in rpm are the motor's; everything else is that of the axis.

KINDS: Final = ("linear", "rotary")
ENCODER_PLACES: Final = ("motor", "output", "table")
_LINE_COUNTS: Final = 4.0  # counts of a line: both edges of both tracks
# Units in which a speed is the motor's; deg/s, rad/s and mm/s are the axis's.
_OF_MOTOR: Final = (unit_named("rpm"), unit_named("rev/s"))


def _one_of(allowed: tuple[str, ...], text: str) -> str:
    if text not in allowed:
        raise DataError(f"{text!r} is not known here", f"write one of {', '.join(allowed)}")
    return text


def _encoder_place(sheet: AxisSheet, text: str) -> str:
    places = ENCODER_PLACES if sheet.kind == "linear" else ENCODER_PLACES[:2]
    return _one_of(places, text)


def _encoder(sheet: AxisSheet, text: str) -> float:
    """Counts per turn of the gearbox output."""
    if sheet.encoder_at == "table":
        return _TURN * sheet.screw_lead_m_per_rad / _scale_step_m(text)
    return _counts_per_turn(text) * (sheet.gear_ratio if sheet.encoder_at == "motor" else 1.0)


def _counts_per_turn(text: str) -> float:
    """Counts per turn of the encoder's shaft, from counts, lines or bits."""
    if lines := re.fullmatch(r"(.+?)\s*lines?", text):
        return _LINE_COUNTS * quantity(lines[1], ("",))[0]
    if bits := re.fullmatch(r"(\d{1,2})\s*bits?", text):
        return 2.0 ** int(bits[1])
    count = count_unit(text)
    if count is None or count.base != "rad":
        raise DataError(
            f"{text!r} is not the resolution of an encoder on a shaft",
            "write counts per turn, as in 8400, or 2100 lines, or 17 bit",
        )
    return _TURN / count.factor


def _scale_step_m(text: str) -> float:
    """Step of a linear scale, from the length of a count or counts per length."""
    per_length = count_unit(text) if "/" in text else None
    step_m = per_length.factor if per_length else quantity(with_unit(text, "um"), ("m",))[0]
    if not step_m or (per_length and per_length.base != "m"):
        raise DataError(
            f"{text!r} is not the resolution of a linear scale",
            "write the length of a count, as in 0.5 um, or 2000/mm",
        )
    return step_m


def _motor_effort(sheet: AxisSheet, text: str, more: tuple[str, ...] = ()) -> float:
    """Torque at the gearbox output, from a torque or current of the motor, or a force."""
    value, unit = quantity(text, ("N*m", "A", *more))
    if unit.base == "N":
        return value / sheet.rad_per_unit
    if unit.base == "A":
        if not sheet.torque_constant:
            raise DataError(
                f"{text} is a current, and the torque constant is not known",
                "give the torque constant of the motor, or a torque in Nm",
            )
        value *= sheet.torque_constant
    return value * sheet.gear_ratio


def _friction(sheet: AxisSheet, text: str) -> float:
    friction = _motor_effort(sheet, text, ("N",) if sheet.kind == "linear" else ())
    if friction >= sheet.effort_limit_nm:
        raise DataError(
            f"a friction of {text} takes all the torque of the motor: the axis cannot move",
            "check friction, torque and their units",
        )
    return friction


def _speed(sheet: AxisSheet, text: str) -> float:
    bases = ("rad/s", "m/s") if sheet.kind == "linear" else ("rad/s",)
    value, unit = quantity(text, bases)
    if unit in _OF_MOTOR:
        return value / sheet.gear_ratio
    return value * (sheet.rad_per_unit if unit.base == "m/s" else 1.0)


def _load(sheet: AxisSheet, text: str) -> float:
    if sheet.kind == "rotary":
        return quantity(text, ("kg*m2",))[0]
    return quantity(text, ("kg",))[0] / sheet.rad_per_unit**2


SHEET_ENTRIES: Final = (
    Entry(
        "kind", "Kind of axis: linear (screw, belt or rack) or rotary", "",
        "kind", lambda _, text: _one_of(KINDS, text), default="linear",
    ),
    Entry(
        "lead", "Lead: travel for one turn of the screw, pulley or pinion, in mm", None,
        "screw_lead_m_per_rad", lambda _, text: quantity(text, ("m",))[0] / _TURN, "m/rad",
        bare=("mm", "mm"),
    ),
    Entry(
        "gear_ratio", "Gear ratio: turns of the motor for one turn of the screw; 1: no gearbox",
        "Gear ratio: turns of the motor for one turn of the axis; 1: no gearbox",
        "gear_ratio", lambda _, text: quantity(re.sub(r"\s*:\s*1$", "", text), ("",))[0],
    ),
    Entry(
        "encoder_at", "Place of the encoder: motor, output (of the gearbox) or table (a scale)",
        "Place of the encoder: motor or output (of the gearbox)",
        "encoder_at", _encoder_place,
    ),
    Entry(
        "encoder", "Encoder: counts per turn (or 2100 lines, or 17 bit); of a scale: um per count",
        "Encoder: counts per turn (or 2100 lines, or 17 bit)",
        "encoder_counts_per_turn", _encoder, "counts per turn of the gearbox output",
    ),
    Entry(
        "torque_constant", "Torque constant of the motor, in Nm/A, if you give currents", "",
        "torque_constant", lambda _, text: quantity(text, ("N*m/A",))[0], "N*m/A", default="",
        bare=("Nm/A", "Nm/A"),
    ),
    Entry(
        "torque", "Rated torque of the motor, in Nm; or its rated current, as in 3A", "",
        "effort_limit_nm", _motor_effort, "N*m at the gearbox output",
        bare=("Nm", "Nm"),
    ),
    Entry(
        "travel", "Travel from end to end, in mm", "Travel from end to end, in degrees",
        "travel_limit_rad",
        lambda sheet, text: 0.5 * quantity(text, (sheet.unit,))[0] * sheet.rad_per_unit,
        "rad, either way from the middle",
        bare=("mm", "deg"),
    ),
    Entry(
        "speed", "Top speed of the motor, in rpm; or of the table, as in 200mm/s",
        "Top speed of the motor, in rpm; or of the axis, as in 90deg/s",
        "speed_limit_rad_s", _speed, "rad/s at the gearbox output",
        bare=("rpm", "rpm"),
    ),
    Entry(
        "acceleration", "Acceleration of the table, in m/s2", "Acceleration of the axis, in rad/s2",
        "acceleration_rad_s2",
        lambda sheet, text: quantity(text, (f"{sheet.unit}/s2",))[0] * sheet.rad_per_unit,
        "rad/s^2 at the gearbox output", default="",
        bare=("m/s2", "rad/s2"),
    ),
    Entry(
        "rotor_inertia", "Inertia of the motor, in kgcm2", "",
        "rotor_inertia", lambda sheet, text: quantity(text, ("kg*m2",))[0] * sheet.gear_ratio**2,
        "kg*m^2 at the gearbox output", default="",
        bare=("kgcm2", "kgcm2"),
    ),
    Entry(
        "load", "Mass that moves, in kg", "Inertia that turns with the axis, in kgm2",
        "load_inertia", _load, "kg*m^2 at the gearbox output", default="",
        bare=("kg", "kgm2"),
    ),
    Entry(
        "friction", "Friction, in Nm at the motor; or of the guides, as in 40N",
        "Friction, in Nm at the motor",
        "friction_nm", _friction, "N*m at the gearbox output", default="",
        bare=("Nm", "Nm"),
    ),
)  # fmt: skip
"""What is asked of an axis, in this order: later answers are converted with earlier ones."""
