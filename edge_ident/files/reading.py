"""One door for every format of files; a format's package is loaded when such a file is read."""

from pathlib import Path
from typing import Any, Final

from edge_ident.errors import DataError
from edge_ident.files.excel import read_xlsx
from edge_ident.files.frames import is_frame, read_frame, read_parquet
from edge_ident.files.matlab import read_hdf5, read_mat
from edge_ident.files.native import read_npz
from edge_ident.files.table import Table
from edge_ident.files.tdms import read_tdms
from edge_ident.files.text import read_text

_READERS: Final = {
    ".npz": read_npz,
    ".mat": read_mat,
    ".h5": read_hdf5,
    ".hdf5": read_hdf5,
    ".tdms": read_tdms,
    ".parquet": read_parquet,
    ".xlsx": read_xlsx,
}
ENDINGS: Final = (".csv", ".tsv", ".txt", ".dat", ".asc", *_READERS)
"""Of files that hold a table: of text, then of every other format."""


def read_table(source: Any, delimiter: str | None = None, decimal: str | None = None) -> Table:
    """Read the columns of a file, or of a data frame.

    Parameters
    ----------
    source : str, Path or data frame
        The ending of the name tells the format: .npz, .mat, .h5 or .hdf5, .tdms, .parquet, .xlsx;
        any other is text.
    delimiter, decimal : str, optional
        Of text, where they cannot be found out.

    Raises
    ------
    DataError
        There is no such file, it is damaged, or a package that it needs is missing.
    """
    if not isinstance(source, str | Path):
        return _frame(source)
    path = Path(source)
    if not path.is_file():
        raise DataError(f"{path}: no such file", "give the path of a .csv or .npz recording")
    reader = _READERS.get(path.suffix.lower())
    return reader(path) if reader else read_text(path, delimiter, decimal)


def _frame(source: Any) -> Table:
    if not is_frame(source):
        raise TypeError(f"a recording is a path or a data frame, not {type(source).__name__}")
    return read_frame(source)
