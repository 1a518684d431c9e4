"""Headings of columns: the name and the unit in it."""

import re
from collections.abc import Collection, Iterable
from typing import Final

from edge_ident.files.units import known_unit

_BRACKETS: Final = re.compile(r"(?P<name>.*?)[\s_]*[\[({<](?P<unit>[^\[({<]*)[\])}>]\s*")
_AFTER_SIGN: Final = re.compile(r"(?P<name>.+?)\s*(?:[,;:]|\s/|\sin)\s+(?P<unit>\S+)\s*")
_UNDERSCORE: Final = re.compile(r"(?P<name>.+?)_(?P<unit>[^\W_]+(?:_s2?)?)")
_TWO_WORDS: Final = re.compile(r"(?P<name>.+?)_(?P<unit>[^\W_]+_[^\W_]+)")
"""Heading with a unit of two words, as in `torque_oz_in`."""
_DIVISOR: Final = re.compile(r"(?P<name>[^/]+)/\s*(?P<unit>[^/\s]+)\s*")
"""Heading with its unit as divisor, as in `Zeit/ms` (DIN 1313)."""
_LABEL: Final = re.compile(r"\w*\d|[XYZABCUVW]")
_FORMS: Final = (_BRACKETS, _AFTER_SIGN, _TWO_WORDS, _UNDERSCORE, _DIVISOR)
"""The first form that names a unit counts."""
_JOINT: Final = re.compile(r"(?:.*[\W_])?name[\W_]*(?P<index>\d+)\W*", re.IGNORECASE)
"""`field.name0`, `name_0`, `name[0]`: each row repeats the joint's name."""
_BY_NAME: Final = {
    "nm": "Nm",
    "a": "A",
    "v": "V",
    "n": "N",
    "rad_s": "rad/s",
    "m_s": "m/s",
    "c": "°C",
}
"""Lower-case units after an underscore, as the contract writes them."""


def split_heading(heading: str) -> tuple[str, str | None]:
    """Name and unit of a heading, such as `Position [mm]`, `Zeit (ms)`, `pos_mm`, `Kraft in N`.

    Brackets that hold no unit belong to the name, as in `Axis[1]`.
    """
    text = heading.strip()
    for form in _FORMS:
        match = form.fullmatch(text)
        if not match:
            continue
        unit = match["unit"].strip()
        name = match["name"].strip()
        if form is _UNDERSCORE:
            unit = _BY_NAME.get(unit, unit)
        if form is _DIVISOR and known_unit(name.split()[-1] if name else "") is not None:
            continue  # the stroke of m/s
        if name and known_unit(unit) is not None:
            return name, unit
    return text, None


def split_unknown(heading: str) -> tuple[str, str | None]:
    """Name of a heading, and what stands where a unit would and is none that is known, or None.

    That is text in brackets, but for the label of an axis, as in `Axis[1]` or `Position (J2)`; and
    `grad` anywhere, which is one unit in German and another in English.
    """
    name, unit = split_heading(heading)
    for form in _FORMS if unit is None else ():
        match = form.fullmatch(heading.strip())
        text = match["unit"].strip() if match else ""
        said = form is _BRACKETS and not _LABEL.fullmatch(text)
        if match and text and (said or text.lower() == "grad"):
            return match["name"].strip(), text
    return name, None


def unique(headings: Iterable[str]) -> list[str]:
    """Headings, of which a repeated one gets a number."""
    seen: dict[str, int] = {}
    made = []
    for position, heading in enumerate(headings, start=1):
        text = heading.strip() or f"column_{position}"
        seen[text] = seen.get(text, 0) + 1
        made.append(text if seen[text] == 1 else repetition(text, seen[text]))
    return made


def repetition(heading: str, number: int) -> str:
    """What a heading is called where it stands in a file for the second time, and so on."""
    return f"{heading} ({number})"


def joint_names(texts: Iterable[tuple[str, Collection[str]]]) -> dict[str, str]:
    """Names of joints by their index, from headings of columns of text and what stands in them."""
    names: dict[str, str] = {}
    for heading, held in texts:
        match = _JOINT.fullmatch(heading)
        if match and len(held) == 1:
            name = re.sub(r"\W+", "_", next(iter(held))).strip("_")
            names |= {match["index"]: name} if name else {}
    return names if len(set(names.values())) == len(names) else {}
