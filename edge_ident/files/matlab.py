"""MATLAB's files: .mat up to v7 through scipy, v7.3 and any other HDF5 through h5py."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from edge_ident.files.extras import needed, reading
from edge_ident.files.mat_sizes import check_mat
from edge_ident.files.table import Table, series
from edge_ident.support.limits import MOST_COLUMNS, MOST_NUMBERS, check_size

Arrays = dict[str, NDArray[np.generic]]

_HDF5: Final = b"\x89HDF\r\n\x1a\n"
_USER_BLOCK: Final = 512
"""Bytes that MATLAB writes before the HDF5 part of a v7.3 file."""


def read_mat(path: Path) -> Table:
    """Read the vectors of a .mat file of any version; those in structs are called `struct.field`.

    Raises
    ------
    DataError
        The file is damaged, its package is missing, or it holds no two vectors of one length.
    TooLargeError
    """
    with path.open("rb") as file:
        start = file.read(_USER_BLOCK + len(_HDF5))
    if start.startswith(_HDF5) or start.endswith(_HDF5):
        return read_hdf5(path)
    io = needed("scipy.io", "mat", str(path))
    with reading(str(path), ".mat"):
        check_mat(path)
        held = io.loadmat(path, simplify_cells=True)
        arrays = {name: array for key, value in held.items() if not key.startswith("__")
                  for name, array in _vectors(key, value)}  # fmt: skip
    return series(str(path), arrays, "MATLAB v5 to v7")


def _vectors(name: str, value: Any) -> Iterator[tuple[str, NDArray[np.generic]]]:
    """Arrays of a variable, with those of its fields."""
    if isinstance(value, dict):
        for key, inner in value.items():
            yield from _vectors(f"{name}.{key}", inner)
    elif isinstance(value, list) or (isinstance(value, np.ndarray) and value.dtype == object):
        for i, inner in enumerate(value, start=1):
            yield from _vectors(f"{name}.{i}", inner)
    elif isinstance(value, np.ndarray) and value.size > 1:
        yield name, value


def read_hdf5(path: Path) -> Table:
    """Read the vectors of an HDF5 file; those in groups are called `group.name`.

    An attribute `unit` or `units` of a vector is its unit.

    Raises
    ------
    DataError
        As `read_mat`.
    """
    h5py = needed("h5py", "mat", str(path))
    arrays: Arrays = {}
    sizes: list[int] = []

    def take(name: str, item: Any) -> None:
        if not isinstance(item, h5py.Dataset) or name.startswith("#") or item.size < 2:
            return
        sizes.append(max(item.size, item.nbytes // np.dtype(np.float64).itemsize))
        check_size("columns", len(sizes), MOST_COLUMNS)
        check_size("numbers", sum(sizes), MOST_NUMBERS)
        unit = item.attrs.get("unit", item.attrs.get("units", ""))
        unit = unit.decode() if isinstance(unit, bytes) else str(unit)
        heading = name.replace("/", ".") + (f" [{unit}]" if unit else "")
        if "MATLAB_class" not in item.attrs or item.attrs["MATLAB_class"] != b"char":
            arrays[heading] = item[()]

    with reading(str(path), "HDF5"), h5py.File(path, "r") as file:
        file.visititems(take)
    return series(str(path), arrays, "HDF5")
