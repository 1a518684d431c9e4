"""Tables that are columns already: data frames, Parquet files."""

from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from edge_ident.files.extras import needed, reading
from edge_ident.files.table import LOOKED_AT, Table, series
from edge_ident.support.limits import check_table

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

    Columns of lists or of records are no series, and are not unpacked. Text is kept once for each
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
            schema, rows = file.schema_arrow, file.metadata.num_rows
        check_table(len(schema), rows)
        text = [field.name for field in schema if _is_text(field)]
        with parquet.ParquetFile(path, read_dictionary=text) as file:
            table = file.read([f.name for f in schema if not f.type.num_fields])
        arrays: dict[str, NDArray[np.generic]] = {}
        for field in schema:
            held = table.column(field.name) if field.name in table.column_names else None
            arrays[field.name] = _NOTHING if held is None else _values(held, field)
    return series(str(path), arrays, "Parquet")


def _is_text(field: Any) -> bool:
    return str(field.type) in ("string", "large_string", "binary", "large_binary")


def _values(column: Any, field: Any) -> NDArray[np.generic]:
    kept = column.slice(0, LOOKED_AT) if _is_text(field) else column
    return np.asarray(kept.to_numpy())
