"""Recordings as files, in the contract's two formats.

`.npz` is native, `.csv` is for exchange. Columns are named `<axis>_<quantity>_<unit>`.
"""

import csv
import re
import warnings
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray

from edge_ident.errors import DataError
from edge_ident.signals.data_checks import check_motions, check_table
from edge_ident.signals.recording import AxisRecord, Recording
from edge_ident.support.atomic_files import atomic_write

Array = NDArray[np.float64]

_QUANTITIES: Final = {
    "position": ("rad", "m"),
    "torque": ("nm",),
    "force": ("n",),
    "current": ("a",),
    "voltage": ("v",),
    "reference": ("rad", "m"),
    "velocity": ("rad_s", "m_s"),
    "temperature": ("c",),
}
_EFFORTS: Final = ("torque", "force", "current", "voltage")
_EFFORT_UNITS: Final = {"nm": "N*m", "n": "N", "a": "A", "v": "V"}
_COLUMN: Final = re.compile(
    r"(?P<axis>\w+?)_(?P<quantity>" + "|".join(_QUANTITIES) + r")_(?P<unit>[a-z_]+)"
)
_SHIFT: Final = "effort_shift_s"


@dataclass(frozen=True)
class _Table:
    """Named columns as they stand in a file; `first_row` is the file's number of row 0."""

    source: str
    columns: Mapping[str, Array]
    effort_shift_s: float = 0.0
    first_row: int = 0


def load_recording(path: str | Path, rename: Mapping[str, str] | None = None) -> Recording:
    """Read and check a recording.

    An effort that never changes is refused only where something has to follow from it.

    Parameters
    ----------
    path : str or Path
        A `.npz` or `.csv` file.
    rename : mapping, optional
        From a column's name in the file to its name in the contract.

    Returns
    -------
    Recording

    Raises
    ------
    DataError
        The file is missing or unreadable, a column is missing or misnamed, or the data fail a
        check of `edge_ident.signals.data_checks`.

    Examples
    --------
    >>> import edge_ident
    >>> edge_ident.save_recording(edge_ident.simulate(), "drive.csv")
    >>> recording = edge_ident.load_recording("drive.csv")
    >>> recording.axes["x"].position_unit
    'rad'
    """
    path = Path(path)
    if not path.is_file():
        raise DataError(f"{path}: no such file", "give the path of a .csv or .npz recording")
    table = _renamed(_read_npz(path) if path.suffix == ".npz" else _read_csv(path), rename or {})
    check_table(table.source, table.columns, table.first_row)
    recording = _from_table(table)
    check_motions(recording, table.first_row)
    return recording


def save_recording(recording: Recording, path: str | Path) -> None:
    """Write a recording, whole or not at all.

    Parameters
    ----------
    recording : Recording
    path : str or Path
        A name that ends in `.npz` gives that format, any other gives `.csv`.

    Raises
    ------
    OSError
        The file cannot be written.

    Examples
    --------
    >>> import edge_ident
    >>> edge_ident.save_recording(edge_ident.simulate(), "drive.npz")
    """
    path = Path(path)
    columns = {"time_s": recording.time_s}
    for name, axis in recording.axes.items():
        columns |= _axis_columns(name, axis)
    with atomic_write(path) as partial:
        if path.suffix == ".npz":
            shift = {_SHIFT: np.array(recording.effort_shift_s)}
            np.savez(partial, allow_pickle=False, **columns, **shift)
            return
        with partial.open("w", newline="") as file:
            file.write(f"# {_SHIFT}={recording.effort_shift_s!r}\n")
            file.write(",".join(columns) + "\n")
            np.savetxt(file, np.column_stack(list(columns.values())), fmt="%.12g", delimiter=",")


def _axis_columns(name: str, axis: AxisRecord) -> dict[str, Array]:
    unit = {text: suffix for suffix, text in _EFFORT_UNITS.items()}[axis.effort_unit]
    effort = next(q for q in _EFFORTS if _QUANTITIES[q] == (unit,))
    length = axis.position_unit
    optional = {
        f"{name}_reference_{length}": axis.reference,
        f"{name}_velocity_{length}_s": axis.velocity,
        f"{name}_temperature_c": axis.temperature_c,
    }
    required = {f"{name}_position_{length}": axis.position, f"{name}_{effort}_{unit}": axis.effort}
    return required | {key: value for key, value in optional.items() if value is not None}


def _read_npz(path: Path) -> _Table:
    try:
        with np.load(path, allow_pickle=False) as archive:
            columns = {name: np.asarray(archive[name], dtype=np.float64) for name in archive.files}
    except (OSError, ValueError, EOFError) as error:
        raise DataError(
            f"{path}: not a readable .npz file ({error})", "write it again, or use .csv"
        ) from error
    shift = float(columns.pop(_SHIFT, np.array(0.0)))
    if len({column.shape for column in columns.values()}) > 1:
        raise DataError(
            f"{path}: columns differ in length", "store one value per time stamp in every column"
        )
    return _Table(str(path), columns, shift)


def _read_csv(path: Path) -> _Table:
    shift, header_row = 0.0, 1
    with path.open(newline="", encoding="utf-8-sig", errors="replace") as file:
        line = file.readline()
        while line.startswith("#"):
            key, _, value = line.lstrip("# ").partition("=")
            if key.strip() == _SHIFT:
                shift = float(value)
            line = file.readline()
            header_row += 1
        names = [name.strip() for name in next(csv.reader([line]), [])]
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore", UserWarning)  # no rows: reported below
                values = np.loadtxt(file, delimiter=",", ndmin=2)
        except ValueError as error:
            raise _bad_cell(path, header_row, names) from error
    if values.size and values.shape[1] != len(names):
        raise DataError(
            f"{path}: {values.shape[1]} values per row but {len(names)} column names",
            f"check the header in row {header_row}",
        )
    columns = dict(zip(names, values.T, strict=True)) if values.size else {n: values for n in names}
    return _Table(str(path), columns, shift, header_row + 1)


def _bad_cell(path: Path, header_row: int, names: list[str]) -> DataError:
    """Find the first cell that is no number; loadtxt does not say where in words that help."""
    with path.open(newline="", encoding="utf-8-sig", errors="replace") as file:
        for row, cells in enumerate(csv.reader(file), start=1):
            if row <= header_row:
                continue
            if len(cells) != len(names):
                return DataError(
                    f"{path}, row {row}: {len(cells)} values but {len(names)} column names",
                    "give every row one value per column",
                )
            for name, cell in zip(names, cells, strict=True):
                try:
                    float(cell)
                except ValueError:
                    return DataError(
                        f"{path}, row {row}, column {name}: {cell!r} is not a number",
                        "correct the cell, or remove the row",
                    )
    return DataError(f"{path}: not a table of numbers", "give comma separated numbers")


def _renamed(table: _Table, rename: Mapping[str, str]) -> _Table:
    absent = [name for name in rename if name not in table.columns]
    if absent:
        raise DataError(
            f"{table.source}: there is no column {absent[0]} to rename",
            f"its columns are {', '.join(table.columns)}",
        )
    columns = {rename.get(name, name): values for name, values in table.columns.items()}
    return _Table(table.source, columns, table.effort_shift_s, table.first_row)


def _from_table(table: _Table) -> Recording:
    found: dict[str, dict[str, tuple[str, Array]]] = {}
    for column, values in table.columns.items():
        match = _COLUMN.fullmatch(column)
        if match and match["unit"] in _QUANTITIES[match["quantity"]]:
            found.setdefault(match["axis"], {})[match["quantity"]] = (match["unit"], values)
    axes = {name: _axis(table, name, parts) for name, parts in found.items()}
    if not axes:
        raise DataError(
            f"{table.source}: no column holds a position (columns: {', '.join(table.columns)})",
            "name them <axis>_position_rad and <axis>_torque_nm, "
            "or give --column NAME=CONTRACT_NAME",
        )
    return Recording(table.columns["time_s"], axes, table.source, table.effort_shift_s)


def _axis(table: _Table, name: str, parts: Mapping[str, tuple[str, Array]]) -> AxisRecord:
    efforts = [quantity for quantity in _EFFORTS if quantity in parts]
    if "position" not in parts or len(efforts) != 1:
        lacks = "position" if "position" not in parts else "effort"
        what = f"has {' and '.join(efforts)}" if len(efforts) > 1 else f"has no {lacks} column"
        raise DataError(
            f"{table.source}: axis {name} {what}",
            f"give one {name}_position_rad or _m and one of "
            f"{name}_torque_nm, _force_n, _current_a, _voltage_v; see --column",
        )
    unit, position = parts["position"]
    effort_unit, effort = parts[efforts[0]]

    def optional(quantity: str, expected: str) -> Array | None:
        given, values = parts.get(quantity, (expected, None))
        if given != expected:
            raise DataError(
                f"{table.source}: axis {name} has its position in {unit} "
                f"and its {quantity} in {given}",
                "convert one of them",
            )
        return values

    return AxisRecord(
        position=position,
        effort=effort,
        position_unit=unit,
        effort_unit=_EFFORT_UNITS[effort_unit],
        reference=optional("reference", unit),
        velocity=optional("velocity", f"{unit}_s"),
        temperature_c=optional("temperature", "c"),
    )
