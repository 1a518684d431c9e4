"""Tables that are columns already: data frames, Parquet files."""

import json
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from edge_ident.files.extras import needed, reading
from edge_ident.files.table import LOOKED_AT, Table, series
from edge_ident.support.limits import (
    MOST_COLUMNS,
    MOST_NUMBERS,
    check_size,
    check_table,
    read_document,
)

_NOTHING: Final = np.empty(0, dtype=object)
"""Stands for what is not unpacked."""


def is_frame(source: object) -> bool:
    """Whether an object is a data frame, of pandas or of a package that looks like it."""
    return hasattr(source, "columns") and hasattr(source, "__getitem__")


def read_frame(frame: Any) -> Table:
    """Read a data frame; an index that has a name is a column.

    Raises
    ------
    DataError
        There are no two columns of numbers.
    """
    arrays: dict[str, NDArray[np.generic]] = {}
    index = getattr(frame, "index", None)
    if (name := getattr(index, "name", None)) is not None:
        arrays[_text(name)] = np.array(index)
    for name in frame.columns:
        arrays[_text(name)] = np.array(frame[name])  # a copy: the frame stays as it is
    return series("the data frame", arrays, "")


def _text(name: object) -> str:
    """A column's name; the levels of one that has several are joined."""
    return ".".join(map(str, name)) if isinstance(name, tuple) else str(name)


def read_parquet(path: Path) -> Table:
    """Read a Parquet file.

    A column of lists that all have one length, as data sets of LeRobot have, is a column for each
    place. Other lists and records are no series, and are not unpacked. Text is kept once for each
    of its values, as it is packed; the first rows of it are looked at.

    Raises
    ------
    DataError
        The file is damaged, pyarrow is missing, or there are no two columns of numbers.
    TooLargeError
    """
    parquet = needed("pyarrow.parquet", "parquet", str(path))
    with reading(str(path), "Parquet"):
        with parquet.ParquetFile(path) as file:
            schema, metadata = file.schema_arrow, file.metadata
        check_table(len(schema), metadata.num_rows)
        lists = [field.name for field in schema if _is_list(field)]
        check_size("numbers", _stated(metadata, lists), MOST_NUMBERS)
        text = [field.name for field in schema if _is_text(field)]
        with parquet.ParquetFile(path, read_dictionary=text) as file:
            read = [f.name for f in schema if not f.type.num_fields or f.name in lists]
            table = file.read(read)
        arrays: dict[str, NDArray[np.generic]] = {}
        for field in schema:
            held = table.column(field.name) if field.name in table.column_names else None
            if held is not None and field.name in lists:
                arrays |= _places(field.name, held, _names_of_places(path, field.name))
            else:
                arrays[field.name] = _NOTHING if held is None else _values(held, field)
    empty = {name for name in table.column_names if table.column(name).null_count}
    made = series(str(path), arrays, "Parquet")
    columns = tuple(replace(c, sparse=c.heading in empty) for c in made.columns)
    return replace(made, columns=columns)


def _is_list(field: Any) -> bool:
    """Whether a column holds lists of numbers."""
    kind = str(field.type)
    return kind.startswith(("list<", "large_list<", "fixed_size_list<")) and not any(
        inner in kind for inner in ("struct", "string", "binary", "list<element: list")
    )


def _stated(metadata: Any, lists: Sequence[str]) -> int:
    """Numbers in columns of lists, as the file states them."""
    groups = [metadata.row_group(i) for i in range(metadata.num_row_groups)]
    columns = [group.column(c) for group in groups for c in range(group.num_columns)]
    return sum(c.num_values for c in columns if c.path_in_schema.partition(".list")[0] in lists)


def _places(name: str, column: Any, names: Sequence[str]) -> dict[str, NDArray[np.generic]]:
    """A column for each place of a column of lists, or nothing that can be used where their lengths
    differ."""
    flat = np.asarray(column.combine_chunks().flatten())
    width = len(flat) // max(len(column), 1)
    if not width or len(flat) != width * len(column) or flat.dtype.kind not in "iuf":
        return {name: _NOTHING}
    if len(set(column.combine_chunks().value_lengths().to_pylist())) > 1:
        return {name: _NOTHING}
    check_size("columns", width, MOST_COLUMNS)
    if len(names) != width:
        names = [str(place) for place in range(1, width + 1)]
    rows = flat.reshape(len(column), width)
    return {f"{name}.{place}": rows[:, i] for i, place in enumerate(names)}


def _names_of_places(path: Path, name: str) -> list[str]:
    """What a data set of LeRobot calls the places of a column, in the folder above its data."""
    for folder in path.resolve().parents[:3]:
        if (description := folder / "meta" / "info.json").is_file():
            try:
                names = json.loads(read_document(description))["features"][name]["names"]
            except (KeyError, OSError, TypeError, ValueError):
                return []
            names = next(iter(names.values()), []) if isinstance(names, dict) else names
            return [str(each) for each in names or []]
    return []


def _is_text(field: Any) -> bool:
    return str(field.type) in ("string", "large_string", "binary", "large_binary")


def _values(column: Any, field: Any) -> NDArray[np.generic]:
    kept = column.slice(0, LOOKED_AT) if _is_text(field) else column
    return np.asarray(kept.to_numpy())
