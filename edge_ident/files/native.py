"""The native archive of columns, .npz."""

import zipfile
from math import prod
from pathlib import Path
from typing import IO

import numpy as np

from edge_ident.errors import DataError
from edge_ident.files.archives import open_archive
from edge_ident.files.extras import reading
from edge_ident.files.table import Column, Table, make_columns
from edge_ident.support.limits import MOST_NUMBERS, check_size


def read_npz(path: Path) -> Table:
    """Read the columns of an archive; a single number goes into the table's header.

    Raises
    ------
    DataError
        The file is damaged, or its columns differ in length.
    TooLargeError
    """
    with reading(str(path), ".npz"):
        with open_archive(path) as archive:
            _check_arrays(archive)
        with np.load(path, allow_pickle=False) as arrays_of:
            held = {name: np.asarray(arrays_of[name], dtype=np.float64) for name in arrays_of.files}
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


def _check_arrays(archive: zipfile.ZipFile) -> None:
    """Ask the arrays for their sizes first: numpy makes room for all that they state."""
    numbers = 0
    for name in archive.namelist():
        with archive.open(name) as member:
            numbers += _stated_numbers(member)
        check_size("numbers", numbers, MOST_NUMBERS)


def _stated_numbers(member: IO[bytes]) -> int:
    """How many numbers an array takes; text and records as many as fit into their bytes."""
    if np.lib.format.read_magic(member) == (1, 0):
        shape, _, kind = np.lib.format.read_array_header_1_0(member)
    else:
        shape, _, kind = np.lib.format.read_array_header_2_0(member)
    return prod(map(abs, shape)) * max(1, kind.itemsize // np.dtype(np.float64).itemsize)
