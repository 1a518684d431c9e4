"""What a heading says of its column: which quantity, of which axis. English and German words."""

import re
from dataclasses import dataclass
from typing import Final

_TOKEN: Final = re.compile(r"[A-Z]+(?=[A-Z][a-z])|[A-ZÄÖÜ]?[a-zäöüß]+|[A-ZÄÖÜ]+|\d+")
_STEMS: Final = {
    "other": ("error", "fehler", "abweichung", "schlepp", "following", "accel", "beschleun",
              "jerk", "ruck", "status", "counter", "index"),
    "position": ("position", "lage", "winkel", "angle", "encoder", "geber"),
    "velocity": ("veloc", "speed", "geschwindigkeit", "drehzahl"),
    "temperature": ("temperatur",),
    "torque": ("torque", "moment"),
    "force": ("force", "kraft"),
    "current": ("strom", "current"),
    "voltage": ("voltage", "spannung"),
    "effort": ("effort",),
    "time": ("time", "zeit"),
    "reference": ("reference", "command", "target", "demand", "setpoint", "soll"),
}  # fmt: skip
"""Beginnings and ends of words. Of two quantities in one heading, the first here counts: a `current
position` is a position."""
_SHORT: Final = {
    "other": ("err", "lag", "acc", "seq"),
    "position": ("pos", "enc", "ang"),
    "velocity": ("vel", "velo", "spd", "rpm", "omega"),
    "temperature": ("temp",),
    "torque": ("trq",),
    "current": ("iq", "cur"),
    "effort": ("tau",),
    "time": ("t", "stamp", "date", "datum"),
    "reference": ("ref", "set", "cmd", "des", "desired"),
}
"""Whole words; with a letter before or after it, as in `xpos`, that names the axis."""
_SYMBOLS: Final = {
    "q": "position", "theta": "position", "phi": "position",
    "dq": "velocity", "qd": "velocity", "qdot": "velocity",
    "ddq": "other", "qdd": "other", "qddot": "other",
}  # fmt: skip
"""Letters of formulas, which count where a heading has nothing but numbers besides: an `i_q` is a
current."""
COORDINATES: Final = frozenset({"q", "s", "x", "y", "z", "theta", "phi"})
"""Letters of formulas for a position, where a unit says the same."""
EFFORT_LETTERS: Final = {"f": "force", "m": "torque", "i": "current", "u": "voltage"}
"""Letters of formulas for an effort, where a unit says the same."""
_FILLERS: Final = frozenset({
    "act", "actual", "ist", "istwert", "wert", "value", "val", "measured", "meas", "mess",
    "feedback", "fb", "motor", "axis", "achse", "drive", "signal", "channel", "data", "out",
    "field", "header",
})  # fmt: skip


_OF_DATA_SET: Final = {
    "observation.state.": "position", "observation.velocity.": "velocity", "action.": "reference",
    "observation.effort.": "effort", "observation.torque.": "torque",
    "observation.current.": "current",
}  # fmt: skip
"""What data sets of LeRobot call the quantities of joints; the joint's name follows."""


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
    found: set[str] = set()
    axis: list[str] = []
    for prefix, of_joint in _OF_DATA_SET.items():
        if name.startswith(prefix):
            joint = role_of(name.removeprefix(prefix)).axis
            return Role(of_joint, of_joint == "reference", joint)
    for token in (match.lower() for match in _TOKEN.findall(name)):
        quantity, rest = _quantity(token)
        found |= {quantity} if quantity else set()
        found |= {"reference"} if "soll" in token else set()
        if rest and rest not in _FILLERS:
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
    found = {_quantity(match.lower())[0] for match in _TOKEN.findall(name)}
    return role_of(name).quantity == "time" or (unit == "s" and "time" in found)


def _quantity(token: str) -> tuple[str, str]:
    """The quantity that a word names, and what of the word names an axis."""
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
