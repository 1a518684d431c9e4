"""Entry point for every format of files; what reads a format is loaded when such a file is read."""

from collections.abc import Callable
from importlib import import_module
from pathlib import Path
from typing import Any, Final

from edge_ident.errors import DataError
from edge_ident.files.frames import is_frame, read_frame
from edge_ident.files.ros import joined_stamps
from edge_ident.files.table import Table
from edge_ident.support.atomic_files import no_file
from edge_ident.support.limits import TooLargeError

_READERS: Final = {
    ".npz": ("native", "read_npz"),
    ".mat": ("matlab", "read_mat"),
    ".h5": ("matlab", "read_hdf5"),
    ".hdf5": ("matlab", "read_hdf5"),
    ".tdms": ("tdms", "read_tdms"),
    ".parquet": ("frames", "read_parquet"),
    ".xlsx": ("excel", "read_xlsx"),
    ".bag": ("bags", "read_bag"),
    ".db3": ("bags", "read_bag"),
    ".mcap": ("bags", "read_bag"),
}
"""Module and function of every format but text, by the ending of the name."""
ENDINGS: Final = (".csv", ".tsv", ".txt", ".dat", ".asc", ".csv.gz", *_READERS)
"""Endings of files that hold a table: of text, then of every other format."""
_ANY: Final = f"give the path of a recording ({', '.join(ENDINGS)})"
_LESS: Final = (
    "record for less time, at a lower rate, or fewer signals; or cut the file into several"
)
_CAPTURE: Final = "capture.npz"
"""What run and capture call their first recording."""
_BAG_OF_ROS_2: Final = "metadata.yaml"
"""File in the folder that a bag of ROS 2 is."""
_NOT_READ: Final = {
    ".npy": (
        "an array without names of columns, which edge-ident does not read",
        "write an archive of named arrays: numpy.savez('FILE.npz', time_s=..., "
        "x_position_rad=..., x_torque_nm=...)",
    ),
    ".json": (
        "a JSON document, and no recording",
        "give the recording that it was made from; a model goes with --model, gains go to a board "
        "with edge-ident gains stage",
    ),
}
"""What other endings stand for, and what to do."""


def read_table(
    source: Any,
    delimiter: str | None = None,
    decimal: str | None = None,
    topic: str | None = None,
) -> Table:
    """Read the columns of a file, or of a data frame.

    Parameters
    ----------
    source : str, Path or data frame
        The ending of the name tells the format: .npz, .mat, .h5 or .hdf5, .tdms, .parquet, .xlsx,
        and .bag, .db3 or .mcap of ROS, of which version 2 also writes a folder;
        any other is text, which gzip may have compressed.
    delimiter, decimal : str, optional
        Of text, where they cannot be found out.
    topic : str, optional
        Of a bag that has several.

    Raises
    ------
    DataError
        There is no such file, it is damaged or of a format that is not read, it is larger than
        `edge_ident.support.limits` allow, or a package that it needs is missing.
    """
    try:
        return joined_stamps(_table(source, delimiter, decimal, topic))
    except TooLargeError as error:
        raise DataError(f"{source}: {error}", _LESS) from error
    except MemoryError as error:
        raise DataError(f"{source}: there is not enough memory to read it", _LESS) from error


def _table(source: Any, delimiter: str | None, decimal: str | None, topic: str | None) -> Table:
    if not isinstance(source, str | Path):
        return _frame(source)
    path = Path(source)
    if (path / _BAG_OF_ROS_2).is_file():
        return _read("bags", "read_bag", path, topic)
    if not path.is_file():
        raise DataError(no_file(path), _recording_in(path) or _ANY)
    ending = path.suffix.lower()
    if ending in _READERS:
        module, function = _READERS[ending]
        return _read(module, function, path, *([topic] if module == "bags" else []))
    if ending in _NOT_READ:
        what, next_step = _NOT_READ[ending]
        raise DataError(f"{path}: {what}", next_step)
    return _read("text", "read_text", path, delimiter, decimal)


def _recording_in(path: Path) -> str:
    """What to give instead of a folder; empty where it holds no recording, or is no folder."""
    found = sorted(file for kind in ("npz", "csv") for file in path.glob(f"*.{kind}"))
    found.sort(key=lambda file: file.name != _CAPTURE)
    return f"give a recording in it, such as {found[0]}" if found else ""


def _frame(source: Any) -> Table:
    if not is_frame(source):
        raise TypeError(f"a recording is a path or a data frame, not {type(source).__name__}")
    return read_frame(source)


def _read(module: str, function: str, *given: Any) -> Table:
    read: Callable[..., Table] = getattr(import_module(f"edge_ident.files.{module}"), function)
    return read(*given)
