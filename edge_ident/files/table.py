"""A table as it stands in a file: named columns, in the units that the file states."""

import re
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Final

import numpy as np
from numpy.typing import NDArray

from edge_ident.errors import DataError
from edge_ident.files.units import known_unit
from edge_ident.support import documents

Array = NDArray[np.float64]


LOOKED_AT: Final = 100
"""Rows of a column of text that are looked at: a name of a joint is in all of them."""


@dataclass(frozen=True)
class Column:
    """One column.

    Attributes
    ----------
    heading : str
        As it stands in the file; made unique by a number where two are the same.
    name : str
        The heading without its unit.
    unit : str or None
        As the file states it, None where it states none that is known.
    values : (N,) array
    sparse : bool
        Whether NaN stands where it was not sampled; of another column, NaN is a bad value.
    """

    heading: str
    name: str
    unit: str | None
    values: Array
    sparse: bool = False


@dataclass(frozen=True)
class Table:
    """What a file holds.

    Attributes
    ----------
    source : str
        File name for messages.
    columns : tuple of Column
    how : str
        How the file was read, in one line; empty where nothing had to be decided.
    first_row : int
        Row of the file that holds the first sample, 0 where rows have no number.
    header : mapping of str to str
        What the lines before the table state, by their key.
    left_out : tuple of str
        What the file holds besides, and why it is not in the table.
    period_s : float or None
        Sampling period that the file states.
    labels : mapping of str to str
        Names of axes that headings have the index of.
    """

    source: str
    columns: tuple[Column, ...]
    how: str = ""
    first_row: int = 0
    header: Mapping[str, str] = field(default_factory=dict)
    left_out: tuple[str, ...] = ()
    period_s: float | None = None
    labels: Mapping[str, str] = field(default_factory=dict)


def make_columns(
    headings: Iterable[str],
    values: Iterable[Array],
    units: Iterable[str | None],
    *,
    sparse: bool = False,
) -> tuple[Column, ...]:
    """Columns with unique headings; a unit that is given apart goes before the heading's own.

    Those of a table that is sparse are so where they hold NaN.

    Raises
    ------
    TooLargeError
        They are more than are read, or a heading is longer.
    """
    headings, made = list(headings), []
    documents.check_size("columns", len(headings), documents.MOST_COLUMNS)
    documents.check_size(
        "characters in a heading", max(map(len, headings), default=0), documents.MOST_CHARACTERS
    )
    for heading, written, numbers, given in zip(
        unique(headings), headings, values, units, strict=True
    ):
        name, unit = split_heading(written.strip() or heading)  # a repetition has its unit, too
        holes = sparse and bool(np.isnan(numbers).any())
        made.append(Column(heading, name, given or unit, numbers, holes))
    return tuple(made)


def series(source: str, arrays: Mapping[str, NDArray[np.generic]], how: str) -> Table:
    """Make a table of the named arrays of a file that are as long as most of them.

    Parameters
    ----------
    source : str
    arrays : mapping of heading to array
        (N,), (N, 1) or (1, N); a matrix gives a column for each of its shorter side. Dates become
        seconds from the first.
    how : str

    Raises
    ------
    DataError
        No two arrays have the same length.
    TooLargeError
        There are more numbers than are read.
    """
    documents.check_size("columns", len(arrays), documents.MOST_COLUMNS)
    documents.check_size(
        "numbers", sum(array.size for array in arrays.values()), documents.MOST_NUMBERS
    )
    split, left_out = _split(arrays)
    lengths = [len(values) for _, values in split.values()]
    length = max(set(lengths), key=lambda n: (min(lengths.count(n), 2), n), default=0)
    kept = {name: pair for name, pair in split.items() if len(pair[1]) == length}
    if len(kept) < 2 or length < 2:
        names = ", ".join([*kept, *left_out]) or "nothing"
        raise DataError(
            f"{source}: no two series of numbers of the same length (it holds: {names})",
            "store position and effort as vectors of numbers, one value per time stamp",
        )
    left_out += [
        f"{name} ({len(pair[1])} values, not {length})"
        for name, pair in split.items()
        if name not in kept
    ]
    columns = make_columns(
        kept, (values for _, values in kept.values()), (unit for unit, _ in kept.values())
    )
    texts = {name: set(map(str, a[:LOOKED_AT])) for name, a in arrays.items() if _is_text(a)}
    labels = joint_names(texts.items())
    return Table(source, columns, how, left_out=tuple(left_out), labels=labels)


def _is_text(array: NDArray[np.generic]) -> bool:
    return array.ndim == 1 and array.dtype.kind in "OSUT"


def _split(
    arrays: Mapping[str, NDArray[np.generic]],
) -> tuple[dict[str, tuple[str | None, Array]], list[str]]:
    """Vectors with their units, and what is none."""
    split: dict[str, tuple[str | None, Array]] = {}
    left_out = []
    for name, given in arrays.items():
        array = np.squeeze(given) if given.ndim > 1 else given
        if array.ndim not in (1, 2) or array.dtype.kind not in "iufbmM":
            left_out.append(f"{name} ({'text' if array.dtype.kind in 'OSUT' else 'no series'})")
        elif array.ndim == 1:
            split[name] = as_numbers(array)
        else:
            rows = array if array.shape[0] < array.shape[1] else array.T
            split |= {f"{name}_{i}": as_numbers(row) for i, row in enumerate(rows, start=1)}
    return split, left_out


def as_numbers(values: NDArray[np.generic]) -> tuple[str | None, Array]:
    """Numbers of a series and the unit that its type implies: dates become seconds."""
    if values.dtype.kind not in "mM":
        return None, np.ascontiguousarray(values, dtype=np.float64)
    stamps = values.astype(f"{values.dtype.kind}8[ns]").astype(np.int64)
    return "s", np.asarray((stamps - stamps[:1]) * 1e-9, dtype=np.float64)


# Headings of columns: the name and the unit in it.

_OPENING: Final = "[({<"
_CLOSING: Final = "])}>"
_SIGNS: Final = (",", ";", ":")
_WORDS: Final = ("/", "in")  # what stands between blanks before a unit
_PER_SECOND: Final = ("s", "s2")
_LABEL: Final = re.compile(r"\w*\d|[XYZABCUVW]")
# `field.name0`, `name_0`, `name[0]`: each row repeats the joint's name.
_JOINT: Final = re.compile(r"(?:.*[\W_])?name[\W_]*(?P<index>\d+)\W*", re.IGNORECASE)
_REPETITION: Final = re.compile(r" \(\d+\)\Z")
# Lower-case units after an underscore, as the contract writes them.
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
    words = name.split() or [""]
    # `Speed m/s` and `m/s` state a unit; `M/Nm` and `s/mm` are symbols with their units (DIN 1313)
    per_unit = known_unit(words[-1]) if len(words) > 1 else known_unit(text)
    if len(units) != 1 or len(unit.split()) != 1 or per_unit:
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


# Series that have a clock each, in one table: its rows are the stamps of all of them.
#
# A column is sparse then: NaN stands where it was not sampled. What reads the table resamples.


@dataclass(frozen=True)
class Series:
    """One series.

    Attributes
    ----------
    heading : str
    unit : str or None
        Where it stands apart from the heading.
    stamps : (N,) array
        In the unit of the clock, which all series of a table share.
    values : (N,) array
    """

    heading: str
    unit: str | None
    stamps: Array
    values: Array


def merged(series: Sequence[Series], clock: str, clock_unit: str | None) -> tuple[Column, ...]:
    """Columns of series, with their stamps in the first column; sparse where the stamps differ.

    Parameters
    ----------
    series : sequence of Series
        Of several values at one stamp, the last counts.
    clock, clock_unit : str
        Heading and unit of the column of stamps.

    Raises
    ------
    TooLargeError
    """
    stamps = np.unique(np.concatenate([each.stamps for each in series]))
    documents.check_table(len(series) + 1, len(stamps))
    arrays = [stamps]
    for each in series:
        values = np.full(len(stamps), np.nan)
        values[np.searchsorted(stamps, each.stamps)] = each.values
        arrays.append(values)
    headings = [clock, *(each.heading for each in series)]
    return make_columns(
        headings, arrays, [clock_unit, *(each.unit for each in series)], sparse=True
    )
