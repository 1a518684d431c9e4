"""Names of columns in the contract, and the recording that such columns make."""

import re
from collections.abc import Iterable, Mapping, Sequence
from typing import Final

import numpy as np
from numpy.typing import NDArray

from edge_ident.errors import DataError
from edge_ident.signals.recording import Array, AxisRecord, PassiveAxis, Recording, chosen_axes

Rows = range | NDArray[np.intp]
"""Row of the file that holds each sample: one after the other, or with some left out."""

TIME: Final = "time_s"
QUANTITIES: Final = {
    "position": ("rad", "m"),
    "torque": ("nm",),
    "force": ("n",),
    "current": ("a",),
    "voltage": ("v",),
    "reference": ("rad", "m"),
    "velocity": ("rad_s", "m_s"),
    "temperature": ("c",),
}
EFFORTS: Final = ("torque", "force", "current", "voltage")
UNITS: Final = {
    "s": "s",
    "rad": "rad",
    "m": "m",
    "nm": "N*m",
    "n": "N",
    "a": "A",
    "v": "V",
    "rad_s": "rad/s",
    "m_s": "m/s",
    "c": "degC",
}
"""Unit of a column, by the ending of its name."""
_COLUMN: Final = re.compile(
    r"(?P<axis>\w+?)_(?P<quantity>" + "|".join(QUANTITIES) + ")_(?P<unit>" + "|".join(UNITS) + ")"
)


def parse_name(name: str) -> tuple[str, str, str] | None:
    """Axis, quantity and unit of a column's name in the contract, None where it is none."""
    if name == TIME:
        return "", "time", "s"
    match = _COLUMN.fullmatch(name)
    if match is None or match["unit"] not in QUANTITIES[match["quantity"]]:
        return None
    return match["axis"], match["quantity"], match["unit"]


def contract_name(name: str, base: str) -> str | None:
    """Name in the contract from axis and quantity, such as `x_position`, and an SI unit.

    None where the contract has no such column.
    """
    ends = [end for end, text in UNITS.items() if text == base]
    whole = f"{name}_{ends[0]}" if ends else ""
    return whole if whole != TIME and parse_name(whole) else None


def only_axes(source: str, columns: Mapping[str, Array], axes: Sequence[str]) -> dict[str, Array]:
    """The time, and the columns of these axes, in this order; of all where none is named.

    Raises
    ------
    DataError
        There is no such axis.
    """
    axis_of = {name: (parse_name(name) or ("",))[0] for name in columns}
    every = dict.fromkeys(axis for axis in axis_of.values() if axis)
    kept = ["", *chosen_axes(source, every, axes)]
    return {n: columns[n] for axis in kept for n in columns if axis_of[n] == axis}


def recording_of(
    source: str, columns: Mapping[str, Array], effort_shift_s: float, held: str
) -> Recording:
    """Make a recording of columns that have the contract's names.

    Parameters
    ----------
    source : str
    columns : mapping of name to (N,) array
    effort_shift_s : float
    held : str
        What the file holds, for messages.

    Raises
    ------
    DataError
        No axis has an effort, or one lacks its position, or has two efforts.

    Notes
    -----
    An axis that has nothing but a position is passive, where another one has an effort.
    """
    found: dict[str, dict[str, tuple[str, Array]]] = {}
    for column, values in columns.items():
        parsed = parse_name(column)
        if parsed and column != TIME:
            axis, quantity, unit = parsed
            found.setdefault(axis, {})[quantity] = (unit, values)
    if not found:
        raise DataError(
            f"{source}: no column holds a position (columns: {held})",
            "name them <axis>_position_rad and <axis>_torque_nm, "
            "or give --column NAME=CONTRACT_NAME",
        )
    alone = _passive_axes(columns)
    axes = {n: _axis(source, n, parts) for n, parts in found.items() if n not in alone}
    passive = {n: PassiveAxis(*found[n]["position"][::-1]) for n in alone}
    return Recording(columns[TIME], axes, source, effort_shift_s, passive=passive)


def columns_of(recording: Recording) -> dict[str, Array]:
    """All columns of a recording, by their names."""
    columns = {TIME: recording.time_s}
    for name, axis in recording.axes.items():
        columns |= _axis_columns(name, axis)
    for name, passive in recording.passive.items():
        columns[f"{name}_position_{passive.position_unit}"] = passive.position
    return columns


def _axis_columns(name: str, axis: AxisRecord) -> dict[str, Array]:
    unit = next(end for end, text in UNITS.items() if text == axis.effort_unit)
    effort = next(quantity for quantity in EFFORTS if QUANTITIES[quantity] == (unit,))
    length = axis.position_unit
    optional = {
        f"{name}_reference_{length}": axis.reference,
        f"{name}_velocity_{length}_s": axis.velocity,
        f"{name}_temperature_c": axis.temperature_c,
    }
    required = {f"{name}_position_{length}": axis.position, f"{name}_{effort}_{unit}": axis.effort}
    return required | {key: value for key, value in optional.items() if value is not None}


def undriven(columns: Iterable[str]) -> list[str]:
    """What becomes of axes without an effort, in words."""
    return [
        f"{axis} has no effort: it is not identified, and its motion may act on the others"
        for axis in _passive_axes(columns)
    ]


def _passive_axes(columns: Iterable[str]) -> list[str]:
    """Axes that have nothing but a position, where another one has an effort."""
    quantities: dict[str, list[str]] = {}
    for axis, quantity, _ in filter(None, map(parse_name, columns)):
        quantities.setdefault(axis, []).append(quantity)
    if not any(set(EFFORTS).intersection(each) for each in quantities.values()):
        return []
    return [axis for axis, each in quantities.items() if each == ["position"]]


def _axis(source: str, name: str, parts: Mapping[str, tuple[str, Array]]) -> AxisRecord:
    efforts = [quantity for quantity in EFFORTS if quantity in parts]
    if "position" not in parts or len(efforts) != 1:
        lacks = "position" if "position" not in parts else "effort"
        what = f"has {' and '.join(efforts)}" if len(efforts) > 1 else f"has no {lacks} column"
        raise DataError(
            f"{source}: axis {name} {what}",
            f"give one {name}_position_rad or _m and one of "
            f"{name}_torque_nm, _force_n, _current_a, _voltage_v; see --column",
        )
    unit, position = parts["position"]
    effort_unit, effort = parts[efforts[0]]

    def optional(quantity: str, expected: str) -> Array | None:
        given, values = parts.get(quantity, (expected, None))
        if given != expected:
            raise DataError(
                f"{source}: axis {name} has its position in {unit} and its {quantity} in {given}",
                "convert one of them",
            )
        return values

    return AxisRecord(
        position=position,
        effort=effort,
        position_unit=unit,
        effort_unit=UNITS[effort_unit],
        reference=optional("reference", unit),
        velocity=optional("velocity", f"{unit}_s"),
        temperature_c=optional("temperature", "c"),
    )


# In which unit time stamps are likely written.

TIME_UNITS: Final = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9}
"""Units in s, the coarsest first."""
TIME_WORDS: Final = {
    "s": "seconds", "ms": "milliseconds", "us": "microseconds", "ns": "nanoseconds",
}  # fmt: skip
_SLOW_S: Final = 0.1  # sampling period from which the unit is likelier a finer one
_FAST_S: Final = 2e-5  # sampling period of the fastest recordings of a drive
# Stamps of the years 2001 to 2286. What lies there in one unit lies there in no other.
_SINCE_1970_S: Final = (1e9, 1e10)


def likely_unit(time: NDArray[np.float64]) -> str:
    """The unit in which stamps (N,) have a plausible sampling period: s, ms, us or ns.

    Of several, that in which they are seconds since 1970, else the coarsest.
    """
    step = float(np.median(np.diff(time)))
    plausible = [text for text, factor in TIME_UNITS.items() if step * factor < _SLOW_S]
    low_s, high_s = _SINCE_1970_S
    dated = [text for text in plausible if low_s <= time[0] * TIME_UNITS[text] < high_s]
    return (*dated, *plausible, "ns")[0]


def only_plausible(step: float, text: str) -> bool:
    """Whether a drive is sampled at these steps in one unit of TIME_UNITS alone."""
    plausible = [t for t, factor in TIME_UNITS.items() if _FAST_S <= step * factor < _SLOW_S]
    return plausible == [text]
