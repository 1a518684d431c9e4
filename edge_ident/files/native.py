"""The native archive of columns, .npz."""

import zipfile
import zlib
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
        with zipfile.ZipFile(path):  # np.load takes an array alone, too
            pass
        with np.load(path, allow_pickle=False) as archive:
            held = {name: np.asarray(archive[name], dtype=np.float64) for name in archive.files}
    except (OSError, ValueError, EOFError, zipfile.BadZipFile, zlib.error) as error:
        raise unreadable(str(path), ".npz", error) from error
    header = {name: repr(float(value)) for name, value in held.items() if value.ndim == 0}
    arrays = {name: value for name, value in held.items() if value.ndim}
    if any(array.ndim > 1 for array in arrays.values()):
        raise DataError(
            f"{path}: not all of its arrays are columns",
            "store every column as an array of its own",
        )
    if len({array.shape for array in arrays.values()}) > 1:
        raise DataError(
            f"{path}: columns differ in length", "store one value per time stamp in every column"
        )
    columns: tuple[Column, ...] = make_columns(arrays, arrays.values(), [None] * len(arrays))
    return Table(str(path), columns, header=header)
