"""Headings of columns: the name and the unit in it."""

import re
from collections.abc import Collection, Iterable
from typing import Final

from edge_ident.files.units import known_unit

_OPENING: Final = "[({<"
_CLOSING: Final = "])}>"
_SIGNS: Final = (",", ";", ":")
_WORDS: Final = ("/", "in")
"""What stands between blanks before a unit."""
_PER_SECOND: Final = ("s", "s2")
_LABEL: Final = re.compile(r"\w*\d|[XYZABCUVW]")
_JOINT: Final = re.compile(r"(?:.*[\W_])?name[\W_]*(?P<index>\d+)\W*", re.IGNORECASE)
"""`field.name0`, `name_0`, `name[0]`: each row repeats the joint's name."""
_REPETITION: Final = re.compile(r" \(\d+\)\Z")
_BY_NAME: Final = {
    "nm": "Nm",
    "a": "A",
    "v": "V",
    "n": "N",
    "rad_s": "rad/s",
    "m_s": "m/s",
    "deg_s": "deg/s",
    "mm_s": "mm/s",
    "rev_s": "rev/s",
    "c": "°C",
}
"""Lower-case units after an underscore, as the contract writes them."""


def split_heading(heading: str) -> tuple[str, str | None]:
    """Name and unit of a heading, such as `Position [mm]`, `Zeit (ms)`, `pos_mm`, `Kraft in N`.

    Brackets that hold no unit belong to the name, as in `Axis[1]`. The first form that names a unit
    counts.
    """
    text = heading.strip()
    for form in _FORMS:
        name, unit = form(text)
        if name and unit and known_unit(unit) is not None:
            return name.strip(), unit
    return text, None


def split_unknown(heading: str) -> tuple[str, str | None]:
    """Name of a heading, and what stands where a unit would and is none that is known, or None.

    That is text in brackets, but for the label of an axis, as in `Axis[1]` or `Position (J2)`; and
    `grad` anywhere, which is one unit in German and another in English.
    """
    name, unit = split_heading(heading)
    for form in _FORMS if unit is None else ():
        before, text = form(heading.strip())
        said = form is _in_brackets and not _LABEL.fullmatch(text)
        if text and (said or (before and text.lower() == "grad")):
            return before.strip(), text
    return name, None


Parts = tuple[str, str]
"""Name and unit; both are empty where a heading does not have that form."""
_OTHER: Final[Parts] = ("", "")


def _in_brackets(text: str) -> Parts:
    """`Position [mm]`: what the last brackets hold, at the end."""
    start = max(map(text.rfind, _OPENING))
    if start < 0 or text[-1] not in _CLOSING:
        return _OTHER
    name = text[:start]
    while name and (name[-1].isspace() or name[-1] == "_"):
        name = name[:-1]
    return name, text[start + 1 : -1].strip()


def _after_sign(text: str) -> Parts:
    """`Zeit, ms`, `Kraft / N` or `Kraft in N`: the last word, behind a sign."""
    *before, unit = text.rsplit(None, 1) or [""]
    name = "".join(before).rstrip()
    if name.endswith(_SIGNS):
        return name[:-1].rstrip(), unit
    *first, word = name.rsplit(None, 1) or [""]
    return ("".join(first).rstrip(), unit) if first and word in _WORDS else _OTHER


def _two_words(text: str) -> Parts:
    """`torque_oz_in`: the last two words of underscores."""
    name, *words = text.rsplit("_", 2)
    return (name, "_".join(words)) if len(words) == 2 and _all_words(words) else _OTHER


def _underscore(text: str) -> Parts:
    """`pos_mm`, or `speed_rad_s` as the contract writes it: the last word of underscores."""
    words = text.rsplit("_", 2 if text.endswith(tuple(f"_{end}" for end in _PER_SECOND)) else 1)
    words = words if words[0] and _all_words(words[1:]) else text.rsplit("_", 1)
    name, unit = words[0], "_".join(words[1:])
    return (name, _BY_NAME.get(unit, unit)) if _all_words(words[1:]) else _OTHER


def _divisor(text: str) -> Parts:
    """`Zeit/ms` (DIN 1313): the unit is a divisor, unless the stroke is that of m/s."""
    name, *units = text.split("/")
    unit = "".join(units).strip()
    if len(units) != 1 or len(unit.split()) != 1 or known_unit((name.split() or [""])[-1]):
        return _OTHER
    return name.strip(), unit


def _all_words(words: Iterable[str]) -> bool:
    return all(word.isalnum() for word in words)


_FORMS: Final = (_in_brackets, _after_sign, _two_words, _underscore, _divisor)


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


def without_repetition(heading: str) -> str:
    """A heading without the number that `repetition` gave it."""
    return _REPETITION.sub("", heading)


def joint_names(texts: Iterable[tuple[str, Collection[str]]]) -> dict[str, str]:
    """Names of joints by their index, from headings of columns of text and what stands in them."""
    names: dict[str, str] = {}
    for heading, held in texts:
        match = _JOINT.fullmatch(heading)
        if match and len(held) == 1:
            name = re.sub(r"\W+", "_", next(iter(held))).strip("_")
            names |= {match["index"]: name} if name else {}
    return names if len(set(names.values())) == len(names) else {}
