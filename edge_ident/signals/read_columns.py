"""Columns as a file has them: what their headings, their units and a person say of them."""

import math
import re
import unicodedata
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from numbers import Real
from typing import Final

from edge_ident.errors import DataError
from edge_ident.files.table import Column, split_heading, split_unknown
from edge_ident.files.units import Unit, count_unit, stated_unit
from edge_ident.signals.contract_columns import UNITS, parse_name
from edge_ident.support.documents import LARGEST, SMALLEST
from edge_ident.support.given import check_type, number


@dataclass(frozen=True)
class ReadOptions:
    """What a person says of a file, beyond what stands in it.

    Attributes
    ----------
    columns : mapping of str to str
        From a column's heading, with or without its unit, to its name in the contract.
    units : mapping of str to str
        From a column's heading to its unit, or to what one step of it stands for: `mm`,
        `1/8192 turn`.
    period_s : float or None
        Sampling period, which takes the place of a column of time.
    resolution : str or None
        Encoder counts per turn or length: `8192/turn`, `1000/mm`.
    rated_effort : str or None
        Effort that 100 % stands for: `2.4 Nm`.
    torque_constant : float or None
        In N·m/A. With it a current becomes a torque.
    delimiter : str or None
        comma, semicolon, tab or blanks; found out where it is None.
    decimal : str or None
        comma or point; found out where it is None.
    topic : str or None
        Of a bag, the topic to read; not needed where one alone has efforts.
    effort_encoding : str or None
        How the effort's numbers hold their sign (`edge_ident.signals.effort_encoding`): `uint16`
        for two's complement that was read without a sign, `sign-magnitude`, or `opposite` where
        it counts against the position.
    effort_shift_s : float
        Time from a row's position to when its effort acted.
    axes : sequence of str
        Axes to read, all where it is empty; the others' columns may hold anything.

    Examples
    --------
    >>> import edge_ident
    >>> edge_ident.ReadOptions({"pos": "x_position_m"}, units={"pos": "mm"}).units
    {'pos': 'mm'}
    """

    columns: Mapping[str, str] = field(default_factory=dict)
    units: Mapping[str, str] = field(default_factory=dict)
    period_s: float | None = None
    resolution: str | None = None
    rated_effort: str | None = None
    torque_constant: float | None = None
    delimiter: str | None = None
    decimal: str | None = None
    topic: str | None = None
    effort_encoding: str | None = None
    effort_shift_s: float = 0.0
    axes: Sequence[str] = ()

    def __post_init__(self) -> None:
        for name in ("columns", "units"):
            check_type(getattr(self, name), Mapping, f'give {name}={{"heading": "..."}}')
        for name in ("resolution", "rated_effort"):
            if getattr(self, name) is not None:
                check_type(getattr(self, name), str, f'give {name} as text, such as "8192/turn"')
        if self.period_s is not None:
            number("period_s", self.period_s, SMALLEST, LARGEST, "give s, such as 0.001")
        if self.torque_constant is not None:
            check_type(self.torque_constant, Real, "give a number for torque_constant")
        number("effort_shift_s", self.effort_shift_s, -LARGEST, LARGEST, "give s, such as 0.001")


# What a heading says of its column: which quantity, of which axis. Words are English and German,
# with those of programs in French, Italian, Spanish, Russian, Chinese and Japanese. Accents do not
# count.

_TOKEN: Final = re.compile(r"[A-Z]+(?=[A-Z][a-z])|[A-Z]?[a-z]+|[A-Z]+|\d+|[^\W\d_a-zA-Z]+")
# Of a command; joined to the quantity, as `soll` is in German.
_COMMANDED: Final = ("指令", "目标", "目標", "给定")
# Beginnings and ends of words. Of two quantities in one heading, the first here counts: a `current
# position` is a position.
_STEMS: Final = {
    "other": ("error", "fehler", "abweichung", "schlepp", "following", "accel", "beschleun",
              "jerk", "ruck", "status", "counter", "index"),
    "position": ("position", "lage", "winkel", "angle", "encoder", "geber", "posic", "posiz",
                 "angol", "angul", "положение", "угол", "位置", "角度"),
    "velocity": ("veloc", "speed", "geschwindigkeit", "drehzahl", "vitesse", "скорость", "速度",
                 "转速", "回転数"),
    "temperature": ("temperatur", "температура", "温度"),
    "torque": ("torque", "moment", "coppia", "момент", "转矩", "扭矩", "力矩", "トルク"),
    "force": ("force", "kraft", "fuerza", "forza", "сила", "推力"),
    "current": ("strom", "current", "courant", "corrient", "corrent", "电流", "電流"),
    "voltage": ("voltage", "spannung", "напряжение", "电压", "電圧"),
    "effort": ("effort",),
    "time": ("time", "zeit", "temps", "tempo", "tiempo", "время", "时间", "時間", "時刻"),
    "reference": ("reference", "command", "target", "demand", "setpoint", "soll", "consign",
                  "riferiment", "referenc", "задание", *_COMMANDED),
}  # fmt: skip
# Whole words alone.
_WHOLE: Final = {"couple": "torque", "par": "torque"}
# Whole words; with a letter before or after it, as in `xpos`, that names the axis.
_SHORT: Final = {
    "other": ("err", "lag", "acc", "seq"),
    "position": ("pos", "enc", "ang", "weg"),
    "velocity": ("vel", "velo", "spd", "rpm", "omega"),
    "temperature": ("temp",),
    "torque": ("trq",),
    "current": ("iq", "cur"),
    "effort": ("tau",),
    "time": ("t", "stamp", "date", "datum"),
    "reference": ("ref", "set", "cmd", "des", "desired"),
}
# Letters of formulas, which count where a heading has nothing but numbers besides: an `i_q` is a
# current.
_SYMBOLS: Final = {
    "q": "position", "theta": "position", "phi": "position",
    "dq": "velocity", "qd": "velocity", "qdot": "velocity",
    "ddq": "other", "qdd": "other", "qddot": "other",
}  # fmt: skip
COORDINATES: Final = frozenset({"q", "s", "x", "y", "z", "theta", "phi"})
"""Letters of formulas for a position, where a unit says the same."""
EFFORT_LETTERS: Final = {"f": "force", "m": "torque", "i": "current", "u": "voltage"}
"""Letters of formulas for an effort, where a unit says the same."""
_FILLERS: Final = frozenset({
    "act", "actual", "ist", "istwert", "wert", "value", "val", "measured", "meas", "mess",
    "feedback", "fb", "motor", "axis", "achse", "drive", "signal", "channel", "data", "out",
    "field", "header",
})  # fmt: skip


# What data sets of LeRobot call the quantities of joints; the joint's name follows.
_OF_DATA_SET: Final = {
    "observation.state.": "position", "observation.velocity.": "velocity", "action.": "reference",
    "observation.effort.": "effort", "observation.torque.": "torque",
    "observation.current.": "current",
}  # fmt: skip


@dataclass(frozen=True)
class Role:
    """What a heading says.

    Attributes
    ----------
    quantity : str
        time, position, velocity, temperature, torque, force, current, voltage, effort, reference
        (of a position), other, or empty where the heading says nothing.
    commanded : bool
        Whether it is a command and not a measurement.
    axis : tuple of str
        What is left of the heading.
    """

    quantity: str
    commanded: bool
    axis: tuple[str, ...]


def role_of(name: str) -> Role:
    """Read the name of a column, without its unit."""
    name = _plain(name)
    found: set[str] = set()
    axis: list[str] = []
    for prefix, of_joint in _OF_DATA_SET.items():
        if name.startswith(prefix):
            joint = role_of(name.removeprefix(prefix)).axis
            return Role(of_joint, of_joint == "reference", joint)
    for token in (match.lower() for match in _TOKEN.findall(name)):
        quantity, rest = _quantity(token)
        found |= {quantity} if quantity else set()
        found |= {"reference"} if any(word in token for word in ("soll", *_COMMANDED)) else set()
        if rest and rest not in _FILLERS and rest.isascii():
            axis.append(rest)
    quantities = [quantity for quantity in _STEMS if quantity in found and quantity != "reference"]
    quantity = quantities[0] if quantities else ""
    if not quantity and axis and axis[0] in _SYMBOLS and all(t.isdigit() for t in axis[1:]):
        quantity = _SYMBOLS[axis.pop(0)]
    commanded = "reference" in found
    if quantity == "position" and commanded:
        quantity = "reference"
    return Role(quantity, commanded, tuple(axis))


def is_time(name: str, unit: str | None) -> bool:
    """Whether a name is that of a time: also `time_position`, where its unit in SI is s."""
    found = {_quantity(match.lower())[0] for match in _TOKEN.findall(_plain(name))}
    return role_of(name).quantity == "time" or (unit == "s" and "time" in found)


def _plain(name: str) -> str:
    """A name without accents: `Größe` as `Grosse`, `durée` as `duree`."""
    parts = unicodedata.normalize("NFKD", name.replace("ß", "ss"))
    return unicodedata.normalize("NFC", re.sub("[\u0300-\u036f]", "", parts))


def _quantity(token: str) -> tuple[str, str]:
    """The quantity that a word names, and what of the word names an axis."""
    if token in _WHOLE:
        return _WHOLE[token], ""
    for quantity, stems in _STEMS.items():
        if any(token.startswith(stem) or token.endswith(stem) for stem in stems):
            return quantity, ""
    for quantity, words in _SHORT.items():
        if token in words:
            return quantity, ""
    for quantity, words in _SHORT.items():
        for word in words:
            if len(word) > 1 and len(token) == len(word) + 1 and word in token:
                return quantity, token.replace(word, "", 1)
    return "", token


def axis_names(keys: list[tuple[str, ...]]) -> dict[tuple[str, ...], str]:
    """Names for axes: what tells them apart, or x where nothing does."""
    distinct = list(dict.fromkeys(keys))
    shared = set.intersection(*map(set, distinct)) if len(distinct) > 1 else set()
    names: dict[tuple[str, ...], str] = {}
    for key in distinct:
        kept = [token for token in key if token not in shared]
        name = "_".join(kept) if len(distinct) > 1 or len(kept) == 1 else ""
        name = name or "x"
        names[key] = f"axis{name}" if name[0].isdigit() else name
    return names


# From the unit of a column in a file to that of the contract.

_ENDS: Final = {base: end for end, base in UNITS.items()}
_PERCENT: Final = 0.01


def check_options(options: ReadOptions) -> None:
    """Check units, resolution, torque constant and rated effort that a user gives.

    Raises
    ------
    DataError
    """
    for name, text in options.units.items():
        if stated_unit(text) is None:
            raise DataError(
                f"--unit {name}={text}: {text!r} is no unit that edge-ident knows",
                "write one such as s, ms, mm, m, in, deg, gon, rad, turn, N, lbf, Nm, oz-in, A, V, "
                "or a number of it: 1/8192 turn",
            )
    if options.resolution is not None and count_unit(options.resolution) is None:
        raise DataError(
            f"--resolution {options.resolution}: not counts per turn or length",
            "write it as 8192/turn or 1000/mm",
        )
    constant = options.torque_constant
    if constant is not None and not 0.0 < constant < math.inf:
        raise DataError(
            f"--torque-constant {constant:g}: not a torque constant",
            "give a number above 0, in N*m/A",
        )
    rated = None if options.rated_effort is None else stated_unit(options.rated_effort)
    if options.rated_effort is not None and (rated is None or rated.base not in ("N*m", "N", "A")):
        raise DataError(
            f"--rated-effort {options.rated_effort}: not an effort with its unit",
            "write it as 2.4Nm, 150N or 8A",
        )


def resolved_unit(unit: Unit, options: ReadOptions) -> tuple[Unit, str]:
    """A unit as a multiple of one of the contract's, and the option that is missing for that.

    Counts need a resolution, percents a rated effort; a torque constant turns amperes into N·m.
    """
    if unit.base == "count":
        count = count_unit(options.resolution) if options.resolution else None
        return (unit, "--resolution") if count is None else (count, "")
    if unit.base == "%":
        rated = stated_unit(options.rated_effort) if options.rated_effort else None
        if rated is None:
            return unit, "--rated-effort"
        unit = Unit(rated.base, rated.factor * _PERCENT * unit.factor)
    if unit.base == "A" and options.torque_constant is not None:
        return Unit("N*m", unit.factor * options.torque_constant), ""
    return unit, ""


def conversion(column: Column, target: str, text: str | None, options: ReadOptions) -> Unit:
    """The unit that converts the numbers of a column to those of a column of the contract.

    Parameters
    ----------
    column : Column
    target : str
        Name in the contract.
    text : str or None
        Unit of the column; None stands for that of the contract.
    options : ReadOptions

    Raises
    ------
    DataError
        The unit is of another kind, or an option is missing.
    """
    parsed = parse_name(target)
    assert parsed is not None, target
    wanted = UNITS[parsed[2]]
    unit = None if text is None else stated_unit(text)
    if unit is None:
        return Unit(wanted)
    if unit.base == wanted:
        return unit
    found, missing = resolved_unit(unit, options)
    if found.base == wanted:
        return found
    if missing or (unit.base == "A" and wanted == "N*m"):
        raise DataError(
            f"column {column.heading} is in {text}, and {target} needs {wanted}",
            f"give its meaning with {missing or '--torque-constant'}",
        )
    raise DataError(
        f"column {column.heading} is in {text}, which is no {wanted}, as {target} needs",
        "name the column for its own unit, or correct the unit with --unit NAME=UNIT",
    )


def name_ending(base: str) -> str | None:
    """Ending of a column's name for a unit, such as nm for N*m; None for other units."""
    return _ENDS.get(base)


def unit_may_be_name(column: Column) -> bool:
    """Whether what looks like a unit may belong to the name: it stands after an underscore."""
    _, underscore, last = column.heading.rpartition("_")
    after_underscore = bool(underscore) and last.isascii() and last.isalpha()
    return after_underscore and split_heading(column.heading)[1] == column.unit


# A column with what its heading and its unit say, and what may be proposed for it.

LENGTHS: Final = ("m", "rad")
_UNIT: Final = "UNIT"
PLACEHOLDERS: Final = {
    "--resolution": ("COUNTS/turn", "the encoder's counts per turn or length, as 8192/turn"),
    "--rated-effort": ("VALUE_Nm", "the effort at 100 %, as 2.4Nm or 8A"),
    "--unit": (_UNIT, "a unit such as mm, deg, Nm, A or rpm"),
    "--period": ("SECONDS", "the sampling period, as 0.001"),
    "--column": ("POSITION, EFFORT", "the heading of that column"),
}
"""What stands in a proposed command line where only a person knows the value, by its option."""
_SPEEDS: Final = ("m/s", "rad/s")


@dataclass(frozen=True)
class Proposal:
    """What a column may be.

    Attributes
    ----------
    target : str or None
        Name in the contract.
    reason : str
    unit : str or None
        That the file does not state.
    open : tuple of str
        Option that still has to be given, and what it wants.
    """

    target: str | None
    reason: str
    unit: str | None = None
    open: tuple[str, ...] = ()


@dataclass(frozen=True)
class ReadColumn:
    """A column with what its heading and its unit say.

    Attributes
    ----------
    column : Column
    role : Role
    unit : Unit or None
    unknown : str or None
        What the heading states in a unit's place, where that is no unit that is known.
    """

    column: Column
    role: Role
    unit: Unit | None
    unknown: str | None

    @property
    def heading(self) -> str:
        """The heading as it stands in the file."""
        return self.column.heading

    @property
    def is_length(self) -> bool:
        """Whether its unit is one of a position."""
        return self.unit is not None and self.unit.base in (*LENGTHS, "count")


def read_columns(
    columns: Sequence[Column], names: Mapping[str, str] | None = None
) -> list[ReadColumn]:
    """Read headings and units of columns; the user may have stated a unit.

    Parameters
    ----------
    columns : sequence of Column
    names : mapping of str to str, optional
        Names of axes that headings have the index of.
    """
    split = [split_unknown(column.heading) for column in columns]
    labels = {text for _, text in split if text is not None and _is_label(text, split)}
    read = []
    for column, (name, text) in zip(columns, split, strict=True):
        unit = None if column.unit is None else stated_unit(column.unit)
        if text is None or text in labels:
            role, unknown = role_of(column.name), None
        else:
            role, unknown = role_of(name), text if column.unit is None else None
        if unit is not None and is_time(column.name, unit.base):
            role = Role("time", False, ())
        axis = tuple((names or {}).get(token, token) for token in role.axis)
        read.append(ReadColumn(column, replace(role, axis=axis), unit, unknown))
    return read


def _is_label(text: str, split: Sequence[tuple[str, str | None]]) -> bool:
    """Whether text in a unit's place is none: known words, or the same for several quantities.

    As in `Position (actual)`, or in `Position (left)` beside `Torque (left)`.
    """
    quantities = {role_of(name).quantity for name, other in split if other == text}
    return not role_of(text).axis or len(quantities) > 1


def open_values(options: Sequence[str]) -> dict[str, str]:
    """What options of a proposal leave to a person: what stands there, and what it is.

    Parameters
    ----------
    options : sequence of str
        Options and their values by turns.
    """
    found = {}
    for option, value in zip(options[::2], options[1::2], strict=True):
        names, what = PLACEHOLDERS.get(option, ("", ""))
        for name in filter(None, names.split(", ")):
            if value == name or value.startswith(f"{name}=") or value.endswith(f"={name}"):
                found[name] = what
    return found


def is_speed(unit: Unit | None) -> bool:
    """Whether a unit is one of a speed."""
    return unit is not None and unit.base in _SPEEDS


def without_unit(read: ReadColumn, target: str, reason: str) -> tuple[Proposal, str]:
    """A proposal for a column that states a unit which cannot be its own, and the question.

    No other unit is proposed: that would be a guess against what the file says.
    """
    stated = read.unknown or read.column.unit
    asked = (
        f"{read.heading} states {stated}, which is no unit that edge-ident knows"
        if read.unknown
        else f"{read.heading} is {reason} and has the unit {stated}"
    )
    return Proposal(target, reason, open=("--unit", f"{read.heading}={_UNIT}")), asked
