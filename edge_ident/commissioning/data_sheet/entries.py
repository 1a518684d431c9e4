"""What data sheets say of an axis, and how it becomes the numbers of a drive description.

Torques, inertias and speeds in rpm are the motor's; everything else is that of the axis.
"""

import re
from math import pi
from typing import Final

from edge_ident.commissioning.data_sheet.quantities import quantity, unit_named, with_unit
from edge_ident.commissioning.data_sheet.sheet import AxisSheet, Entry
from edge_ident.errors import DataError
from edge_ident.files.units import count_unit

KINDS: Final = ("linear", "rotary")
ENCODER_PLACES: Final = ("motor", "output", "table")
_TURN: Final = 2.0 * pi
_LINE_COUNTS: Final = 4.0
"""Counts of a line: both edges of both tracks."""
_OF_MOTOR: Final = (unit_named("rpm"), unit_named("rev/s"))
"""Units in which a speed is the motor's; deg/s, rad/s and mm/s are the axis's."""


def _one_of(allowed: tuple[str, ...], text: str) -> str:
    if text not in allowed:
        raise DataError(f"{text!r} is not known here", f"write one of {', '.join(allowed)}")
    return text


def _kind(_: AxisSheet, text: str) -> str:
    return _one_of(KINDS, text)


def _lead(_: AxisSheet, text: str) -> float:
    return quantity(text, ("m",))[0] / _TURN


def _ratio(_: AxisSheet, text: str) -> float:
    return quantity(re.sub(r"\s*:\s*1$", "", text), ("",))[0]


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


def _torque_constant(_: AxisSheet, text: str) -> float:
    return quantity(text, ("N*m/A",))[0]


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


def _travel(sheet: AxisSheet, text: str) -> float:
    return 0.5 * quantity(text, (sheet.unit,))[0] * sheet.rad_per_unit


def _speed(sheet: AxisSheet, text: str) -> float:
    bases = ("rad/s", "m/s") if sheet.kind == "linear" else ("rad/s",)
    value, unit = quantity(text, bases)
    if unit in _OF_MOTOR:
        return value / sheet.gear_ratio
    return value * (sheet.rad_per_unit if unit.base == "m/s" else 1.0)


def _acceleration(sheet: AxisSheet, text: str) -> float:
    return quantity(text, (f"{sheet.unit}/s2",))[0] * sheet.rad_per_unit


def _rotor_inertia(sheet: AxisSheet, text: str) -> float:
    return quantity(text, ("kg*m2",))[0] * sheet.gear_ratio**2


def _load(sheet: AxisSheet, text: str) -> float:
    if sheet.kind == "rotary":
        return quantity(text, ("kg*m2",))[0]
    return quantity(text, ("kg",))[0] / sheet.rad_per_unit**2


SHEET_ENTRIES: Final = (
    Entry(
        "kind", "Kind of axis: linear (screw, belt or rack) or rotary", "",
        "kind", _kind, default="linear",
    ),
    Entry(
        "lead", "Lead: travel for one turn of the screw, pulley or pinion, in mm", None,
        "screw_lead_m_per_rad", _lead, "m/rad",
        bare=("mm", "mm"),
    ),
    Entry(
        "gear_ratio", "Gear ratio: turns of the motor for one turn of the screw; 1: no gearbox",
        "Gear ratio: turns of the motor for one turn of the axis; 1: no gearbox",
        "gear_ratio", _ratio,
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
        "torque_constant", _torque_constant, "N*m/A", default="",
        bare=("Nm/A", "Nm/A"),
    ),
    Entry(
        "torque", "Rated torque of the motor, in Nm; or its rated current, as in 3A", "",
        "effort_limit_nm", _motor_effort, "N*m at the gearbox output",
        bare=("Nm", "Nm"),
    ),
    Entry(
        "travel", "Travel from end to end, in mm", "Travel from end to end, in degrees",
        "travel_limit_rad", _travel, "rad, either way from the middle",
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
        "acceleration_rad_s2", _acceleration, "rad/s^2 at the gearbox output", default="",
        bare=("m/s2", "rad/s2"),
    ),
    Entry(
        "rotor_inertia", "Inertia of the motor, in kgcm2", "",
        "rotor_inertia", _rotor_inertia, "kg*m^2 at the gearbox output", default="",
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
