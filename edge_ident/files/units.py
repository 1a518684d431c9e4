"""Units that files state, and their factors to the units of a recording."""

import re
from dataclasses import dataclass
from math import inf, pi
from typing import Final


@dataclass(frozen=True)
class Unit:
    """A unit that is known.

    Attributes
    ----------
    base : str
        Unit that it is converted to: s, m, rad, N, N*m, A, V, degC, m/s or rad/s; % and count need
        to be told what they mean.
    factor, offset : float
        A value becomes factor·value + offset.
    """

    base: str
    factor: float = 1.0
    offset: float = 0.0


_TURN: Final = 2.0 * pi
_INCH_M: Final = 0.0254
_FOOT_M: Final = 12.0 * _INCH_M
# Weight of a kilogram at standard gravity, exact by definition (CGPM 1901; NIST SP 811, B.8).
_KILOGRAM_N: Final = 9.80665
# Weight of a pound of 0.45359237 kg; inch and pound are exact since 1959 (NIST SP 811, B.6).
_POUND_N: Final = 0.45359237 * _KILOGRAM_N
_SPELLED: Final = {
    "s": {
        1.0: "s sec sek second seconds Sekunden с сек",
        1e-3: "ms msec millisecond milliseconds мс",
        1e-6: "us µs μs usec microseconds",
        1e-9: "ns nsec nanosecond nanoseconds",
        60.0: "min",
    },
    "m": {1.0: "m meter metre", 1e-3: "mm", 1e-2: "cm", 1e-6: "um µm μm micron", 1e-9: "nm"}
    | {_INCH_M: "in inch inches", _FOOT_M: "ft"},
    "rad": {
        1.0: "rad radian radians",
        1e-3: "mrad",
        1e-6: "urad µrad",
        pi / 180.0: "deg ° degree degrees Grad gradi grados degrés град",
        pi / 180e3: "mdeg",
    }
    | {_TURN: "turn turns rev revs revolution revolutions U Umdr"}
    | {pi / 648000.0: "arcsec", pi / 10800.0: "arcmin", pi / 200.0: "gon gradian"},
    "count": {
        1.0: "count counts cnt cts inc incr increment increments Inkremente Ink ticks pulse pulses"
    },
    "N": {1.0: "N newton newtons", 1e3: "kN", 1e-3: "mN", 10.0: "daN"}
    | {_POUND_N: "lbf lb lbs pound pounds", _POUND_N / 16.0: "ozf oz", _KILOGRAM_N: "kgf"},
    "N*m": {
        1.0: "Nm N*m N·m N.m N-m newton*meter newton*meters Нм Н*м Н·м",
        1e-3: "mNm mN*m mN·m Nmm N*mm N·mm",
        1e-2: "Ncm N*cm N·cm",
        1e3: "kNm kN*m kN·m",
        10.0: "daNm",
    },
    "A": {1.0: "A Arms Aeff A_rms Ampere amp amps amperes", 1e-3: "mA"},
    "V": {1.0: "V Volt volts", 1e-3: "mV"},
    "%": {1.0: "% percent pct Prozent", 0.1: "‰ 0.1% 0,1%"},
    "degC": {1.0: "°C degC celsius"},
    "m/s": {
        1.0: "m/s",
        1e-3: "mm/s",
        1.0 / 60.0: "m/min",
        1e-3 / 60.0: "mm/min",
        1e-6: "µm/s um/s",
    },
    "rad/s": {1.0: "rad/s", pi / 180.0: "deg/s °/s", 1e-3: "mrad/s"}
    | {
        _TURN / 60.0: "rpm 1/min U/min min-1 rev/min r/min tr/min giri/min об/мин",
        _TURN: "rev/s turn/s turns/s 1/s U/s",
    },
}
_UNITS: Final = {
    spelling: Unit(base, factor)
    for base, factors in _SPELLED.items()
    for factor, spellings in factors.items()
    for spelling in spellings.split()
} | {"K": Unit("degC", 1.0, -273.15)}
# German for degree; in English, grad is a gradian. Other spellings of it name no unit.
_ONLY_SO: Final = ("Grad",)
_FORCES_N: Final = {
    "oz": _POUND_N / 16.0, "ounce": _POUND_N / 16.0, "lb": _POUND_N, "pound": _POUND_N,
    "kg": _KILOGRAM_N, "kp": _KILOGRAM_N,
}  # fmt: skip
_ARMS_M: Final = {
    "in": _INCH_M, "inch": _INCH_M, "ft": _FOOT_M, "foot": _FOOT_M, "feet": _FOOT_M,
    "m": 1.0, "cm": 1e-2, "mm": 1e-3,
}  # fmt: skip
_JOINED: Final = r"\s*[-·⋅*._\s]?\s*"
_POUNDS: Final = r"(?P<force>oz|ounce|lb|pound)(?:f|s)?"
_INCHES: Final = r"(?P<arm>inch|in|foot|feet|ft)(?:es|s)?"
# Force and arm in either order: `oz-in`, `lbf·in`, `ft-lbs`, `ftlb`, `kgf·cm`.
_TORQUES: Final = tuple(
    re.compile(pattern, re.IGNORECASE)
    for pattern in (
        _POUNDS + _JOINED + _INCHES,
        _INCHES + _JOINED + _POUNDS,
        r"(?P<force>kg|kp)f?" + _JOINED + "(?P<arm>m|cm|mm)",
    )
)
_LONGEST: Final = 40  # characters of a unit: twice those of the longest that is known
_SIGN: Final = re.compile(r"\s*[·⋅*.\-\s]\s*")  # what stands between the parts of a product
_NUMBER: Final = r"\d+(?:\.\d*)?(?:[eE][-+]?\d+)?"
_SCALED: Final = re.compile(rf"(?P<top>{_NUMBER})(?:/(?P<bottom>{_NUMBER}))?\s*(?P<unit>\D.*)")
_PER: Final = re.compile(rf"(?P<counts>{_NUMBER})\s*(?:/\s*(?P<unit>\D.*))?")


def _spaced(text: str) -> str:
    """Text with single blanks between its words."""
    return " ".join(text.split())


def known_unit(text: str) -> Unit | None:
    """The unit that a text names, None where it names none, or two.

    Case counts (`mN` and `MN`, `nm` and `Nm`); where no unit is written so, it does not, provided
    that only one unit is left.
    """
    text = _spaced(text).rstrip(".")
    if len(text) > _LONGEST:
        return None
    spelled = (text, _SIGN.sub("*", text), text.replace(" %", "%"))
    if exact := [_UNITS[word] for word in spelled if word in _UNITS]:
        return exact[0]
    lower = {word.lower() for word in spelled}
    alike = {
        unit
        for spelling, unit in _UNITS.items()
        if spelling.lower() in lower and spelling not in _ONLY_SO
    }
    return alike.pop() if len(alike) == 1 else _torque(text)


def _torque(text: str) -> Unit | None:
    """A torque as a force and its arm, in the units of pounds and inches, or of kilograms."""
    for pattern in _TORQUES:
        if match := pattern.fullmatch(text):
            force, arm = match["force"].lower(), match["arm"].lower()
            return Unit("N*m", _FORCES_N[force] * _ARMS_M[arm])
    return None


def stated_unit(text: str) -> Unit | None:
    """A unit, or a number of it that one step of a column stands for: `1/8192 turn`, `0.05 Nm`."""
    if (unit := known_unit(text)) is not None:
        return unit
    match = _SCALED.fullmatch(_spaced(text))
    unit = known_unit(match["unit"]) if match else None
    if match is None or unit is None or unit.offset:
        return None
    top, bottom = float(match["top"]), float(match["bottom"] or 1.0)
    factor = unit.factor * top / bottom if bottom > 0.0 else 0.0
    return Unit(unit.base, factor) if 0.0 < factor < inf else None


def count_unit(resolution: str) -> Unit | None:
    """One count of an encoder with so many `counts per turn`, `8192/turn`, or length, `1000/mm`."""
    match = _PER.fullmatch(_spaced(resolution))
    unit = known_unit(match["unit"] or "turn") if match else None
    if match is None or unit is None or unit.base not in ("rad", "m"):
        return None
    counts = float(match["counts"])
    return Unit(unit.base, unit.factor / counts) if 0.0 < counts < inf else None
