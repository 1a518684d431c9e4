"""The native archive of columns, .npz."""

from pathlib import Path

import numpy as np

from edge_ident.errors import DataError
from edge_ident.files.extras import unreadable
from edge_ident.files.table import Column, Table, make_columns


def read_npz(path: Path) -> Table:
    """Read the columns of an archive; a single number goes into the table's header.

    Raises
    ------
    DataError
        The file is damaged, or its columns differ in length.
    """
    try:
        with np.load(path, allow_pickle=False) as archive:
            held = {name: np.asarray(archive[name], dtype=np.float64) for name in archive.files}
    except (OSError, ValueError, EOFError) as error:
        raise unreadable(str(path), ".npz", error) from error
    header = {name: repr(float(value)) for name, value in held.items() if value.ndim == 0}
    arrays = {name: value for name, value in held.items() if value.ndim}
    if len({array.shape for array in arrays.values()}) > 1:
        raise DataError(
            f"{path}: columns differ in length", "store one value per time stamp in every column"
        )
    columns: tuple[Column, ...] = make_columns(arrays, arrays.values(), [None] * len(arrays))
    return Table(str(path), columns, header=header)
