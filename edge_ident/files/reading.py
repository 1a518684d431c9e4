"""Entry point for every format of files; what reads a format is loaded when such a file is read."""

import json
import re
import zipfile
from collections.abc import Callable, Sequence
from dataclasses import replace
from importlib import import_module
from math import prod
from pathlib import Path
from typing import IO, Any, Final

import numpy as np
from numpy.typing import NDArray

from edge_ident.errors import DataError
from edge_ident.files.opening import needed, open_archive, reading
from edge_ident.files.table import LOOKED_AT, Column, Table, series
from edge_ident.support import documents

# Module and function of every format but text, by the ending of the name.
_READERS: Final = {
    ".npz": ("reading", "read_npz"),
    ".mat": ("measurement_files", "read_mat"),
    ".h5": ("measurement_files", "read_hdf5"),
    ".hdf5": ("measurement_files", "read_hdf5"),
    ".tdms": ("measurement_files", "read_tdms"),
    ".parquet": ("reading", "read_parquet"),
    ".xlsx": ("measurement_files", "read_xlsx"),
    ".bag": ("bags", "read_bag"),
    ".db3": ("bags", "read_bag"),
    ".mcap": ("bags", "read_bag"),
}
ENDINGS: Final = (".csv", ".tsv", ".txt", ".dat", ".asc", ".csv.gz", *_READERS)
"""Endings of files that hold a table: of text, then of every other format."""
_ANY: Final = f"give the path of a recording ({', '.join(ENDINGS)})"
_LESS: Final = (
    "record for less time, at a lower rate, or fewer signals; or cut the file into several"
)
_CAPTURE: Final = "capture.npz"  # what run and capture call their first recording
_BAG_OF_ROS_2: Final = "metadata.yaml"  # file in the folder that a bag of ROS 2 is
# What other endings stand for, and what to do.
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


def read_table(
    source: Any, delimiter: str | None = None, decimal: str | None = None, topic: str | None = None
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
        `edge_ident.support.documents` allow, or a package that it needs is missing.
    """
    try:
        return joined_stamps(_table(source, delimiter, decimal, topic))
    except documents.TooLargeError as error:
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
        raise DataError(documents.no_file(path), _recording_in(path) or _ANY)
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


# The native archive of columns, .npz.


def read_npz(path: Path) -> Table:
    """Read the columns of an archive; a single number goes into the table's header.

    Raises
    ------
    DataError
        The file is damaged, or no two of its columns have the same length.
    TooLargeError
    """
    with reading(str(path), ".npz"):
        with open_archive(path) as archive:
            _check_arrays(archive)
        with np.load(path, allow_pickle=False) as arrays_of:
            held = {name: np.asarray(arrays_of[name]) for name in arrays_of.files}
    header = {name: str(value) for name, value in held.items() if value.ndim == 0}
    arrays = {name: value for name, value in held.items() if value.ndim}
    return replace(series(str(path), arrays, ""), header=header)


def _check_arrays(archive: zipfile.ZipFile) -> None:
    """Ask the arrays for their sizes first: numpy makes room for all that they state."""
    numbers = 0
    for name in archive.namelist():
        with archive.open(name) as member:
            numbers += _stated_numbers(member)
        documents.check_size("numbers", numbers, documents.MOST_NUMBERS)


def _stated_numbers(member: IO[bytes]) -> int:
    """How many numbers an array takes; text and records as many as fit into their bytes."""
    if np.lib.format.read_magic(member) == (1, 0):
        shape, _, kind = np.lib.format.read_array_header_1_0(member)
    else:
        shape, _, kind = np.lib.format.read_array_header_2_0(member)
    return prod(map(abs, shape)) * max(1, kind.itemsize // np.dtype(np.float64).itemsize)


# Tables that are columns already: data frames, Parquet files.

_NOTHING: Final = np.empty(0, dtype=object)  # stands for what is not unpacked


def is_frame(source: object) -> bool:
    """Whether an object is a data frame, of pandas or of a package that looks like it."""
    return hasattr(source, "columns") and hasattr(source, "__getitem__")


def read_frame(frame: Any) -> Table:
    """Read a data frame; an index that has a name, or holds times, is a column.

    Raises
    ------
    DataError
        There are no two columns of numbers.
    """
    arrays: dict[str, NDArray[np.generic]] = {}
    index = getattr(frame, "index", None)
    name = getattr(index, "name", None)
    if name is not None or np.asarray(index).dtype.kind in "mM":
        arrays["time" if name is None else _text(name)] = np.array(index)
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
        documents.check_table(len(schema), metadata.num_rows)
        lists = [field.name for field in schema if _is_list(field)]
        documents.check_size("numbers", _stated(metadata, lists), documents.MOST_NUMBERS)
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
    documents.check_size("columns", width, documents.MOST_COLUMNS)
    if len(names) != width:
        names = [str(place) for place in range(1, width + 1)]
    rows = flat.reshape(len(column), width)
    return {f"{name}.{place}": rows[:, i] for i, place in enumerate(names)}


def _names_of_places(path: Path, name: str) -> list[str]:
    """What a data set of LeRobot calls the places of a column, in the folder above its data."""
    for folder in path.resolve().parents[:3]:
        if (description := folder / "meta" / "info.json").is_file():
            try:
                names = json.loads(documents.read_document(description))["features"][name]["names"]
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


# Stamps that exports of ROS messages spread over two columns.

# `header.stamp.secs` and `.nsecs` of ROS 1, `header.stamp.sec` and `.nanosec` of ROS 2.
_PART: Final = re.compile(r"(?P<part>n|nano)?se?cs?\Z", re.IGNORECASE)
_NS_PER_S: Final = 1e9


def joined_stamps(table: Table) -> Table:
    """Put stamps of seconds and nanoseconds together: seconds since the first of them."""
    headings = {column.heading for column in table.columns}
    parts: dict[str, dict[bool, Column]] = {}
    for column in table.columns:
        if match := _PART.search(column.heading):
            stem = _without_signs(column.heading[: match.start()])
            parts.setdefault(stem, {})[bool(match["part"])] = column
    columns, how = list(table.columns), [table.how] if table.how else []
    for stem, pair in parts.items():
        heading = stem or "stamp"
        if len(pair) < 2 or heading in headings or not _is_stamp(pair[False], pair[True]):
            continue
        seconds, fine = pair[False], pair[True]
        values = seconds.values - seconds.values[0]
        values += (fine.values - fine.values[0]) / _NS_PER_S
        joined = Column(heading, heading, "s", values)
        columns = [joined if c is seconds else c for c in columns if c is not fine]
        how.append(f"{heading} of {seconds.heading} and {fine.heading}")
    return replace(table, columns=tuple(columns), how=", ".join(how))


def _without_signs(text: str) -> str:
    """Text up to its last letter or digit."""
    end = len(text)
    while end and not text[end - 1].isalnum():
        end -= 1
    return text[:end]


def _is_stamp(seconds: Column, fine: Column) -> bool:
    if not len(seconds.values):
        return False
    whole = bool(np.all(np.floor(seconds.values) == seconds.values))
    return whole and bool(np.all((fine.values >= 0.0) & (fine.values < _NS_PER_S)))
