"""Numbers with a unit, as data sheets print them."""

import math
import re
from typing import Final

from edge_ident.errors import DataError
from edge_ident.files.units import Unit, known_unit

_G_M_S2: Final = 9.80665
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
"""Units that no column of a recording has; a bare number is one of them."""
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
"""A unit that data sheets print, by base."""
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
