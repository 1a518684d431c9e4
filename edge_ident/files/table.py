"""A table as it stands in a file: named columns, in the units that the file states."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Final

import numpy as np
from numpy.typing import NDArray

from edge_ident.errors import DataError
from edge_ident.files.headings import joint_names, split_heading, unique
from edge_ident.support.limits import MOST_CHARACTERS, MOST_COLUMNS, MOST_NUMBERS, check_size

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
    check_size("columns", len(headings), MOST_COLUMNS)
    check_size("characters in a heading", max(map(len, headings), default=0), MOST_CHARACTERS)
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
    check_size("columns", len(arrays), MOST_COLUMNS)
    check_size("numbers", sum(array.size for array in arrays.values()), MOST_NUMBERS)
    split, left_out = _split(arrays)
    lengths = [len(values) for _, values in split.values()]
    length = max(set(lengths), key=lambda n: (min(lengths.count(n), 2), n), default=0)
    kept = {name: pair for name, pair in split.items() if len(pair[1]) == length}
    if len(kept) < 2 or length < 2:
        names = ", ".join(arrays) or "none"
        raise DataError(
            f"{source}: no two series of the same length (it holds: {names})",
            "store position and effort as vectors, one value per time stamp",
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
