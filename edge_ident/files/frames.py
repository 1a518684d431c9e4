"""Tables that are columns already: data frames, Parquet files."""

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from edge_ident.files.extras import needed, unreadable
from edge_ident.files.table import Table, series


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

    Raises
    ------
    DataError
        The file is damaged, pyarrow is missing, or there are no two columns of numbers.
    """
    parquet = needed("pyarrow.parquet", "parquet", str(path))
    try:
        table = parquet.read_table(path)
    except (OSError, ValueError) as error:
        raise unreadable(str(path), "Parquet", error) from error
    arrays = {name: table.column(i).to_numpy() for i, name in enumerate(table.column_names)}
    return series(str(path), arrays, "Parquet")
