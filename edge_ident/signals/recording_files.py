"""Recordings as files: the contract's two formats, and what other programs write.

`.npz` is native, `.csv` is for exchange. Columns are named `<axis>_<quantity>_<unit>`; columns of
other names are mapped to these.
"""

import math
import os
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Final, Union

import numpy as np

from edge_ident.errors import DataError
from edge_ident.files.reading import is_frame, read_table
from edge_ident.files.table import Table
from edge_ident.signals import contract_columns, data_checks, effort_encoding, made_columns
from edge_ident.signals.column_mapping import ColumnMapping, ColumnUse, map_columns
from edge_ident.signals.read_columns import ReadOptions, open_values
from edge_ident.signals.recording import Array, Recording
from edge_ident.support.documents import atomic_write
from edge_ident.support.given import check_type, type_of
from edge_ident.support.given import path as path_of

if TYPE_CHECKING:
    from typing import Protocol

    class DataFrame(Protocol):
        """A table of named columns, such as pandas has."""

        @property
        def columns(self) -> "object": ...
        def __getitem__(self, name: object, /) -> "object": ...


Source = Union[str, Path, "DataFrame"]

_SHIFT: Final = "effort_shift_s"
_LARGEST_SHIFT_S: Final = 10.0  # beyond what any controller's effort can be shifted
_FORMAT: Final = "%.12g"
_TIME_FORMAT: Final = "%.16g"  # seconds since 1970 take ten digits before the point


@dataclass(frozen=True)
class Inspection:
    """What a file holds, and what each column is taken for.

    Attributes
    ----------
    source : str
    how : str
        How the file was read, empty where nothing had to be decided.
    rows : int
    columns : tuple of ColumnUse
        `heading`, `unit_text`, `target` (the name in the contract, or None) and `reason`.
    period_s : float or None
        Sampling period that takes the place of a column of time, and why:
    period_reason : str
    left_out : tuple of str
        What else the file holds.
    questions : tuple of str
        What is not certain. Where there is one, the columns are a proposal.
    options : tuple of str
        Of the command line, which accept the proposal.
    done : tuple of str
        What was done to the numbers: rows left out, clocks brought together, signs put back.

    Examples
    --------
    >>> import edge_ident
    >>> edge_ident.save_recording(edge_ident.simulate(), "drive.csv")
    >>> found = edge_ident.inspect_recording("drive.csv")
    >>> [use.target for use in found.columns][:3]
    ['time_s', 'x_position_rad', 'x_torque_nm']
    >>> found.recording().axes["x"].effort_unit
    'N*m'
    """

    source: str
    how: str
    rows: int
    columns: tuple[ColumnUse, ...]
    period_s: float | None
    period_reason: str
    left_out: tuple[str, ...]
    questions: tuple[str, ...]
    options: tuple[str, ...]
    done: tuple[str, ...]
    _columns: Mapping[str, Array]
    _rows: contract_columns.Rows
    _effort_shift_s: float
    _axes: Sequence[str]
    _of_program: bool = False

    @property
    def assumptions(self) -> tuple[str, ...]:
        """What was decided, one line each; nothing for names of the contract."""
        said = [self.how] if self.how else []
        for use in self.columns:
            heading, unit = use.heading, use.unit_text
            if use.target is not None and (use.target != heading or use.unit.factor != 1.0):
                kept = f"{heading}" + (f", in {unit}" if unit and unit not in heading else "")
                factor = "" if use.unit.factor == 1.0 else f", times {use.unit.factor:.6g}"
                said.append(f"{kept} → {use.target}{factor} ({use.reason})")
        if self.period_s is not None:
            said.append(f"sampling period {self.period_s:g} s ({self.period_reason})")
        said += self.done
        said += (
            []
            if self._axes
            else contract_columns.undriven(use.target or "" for use in self.columns)
        )
        unused = [use.heading for use in self.columns if use.target is None]
        if said and (unused or self.left_out):
            said.append(f"not used: {', '.join((*unused, *self.left_out))}")
        return tuple(said)

    @property
    def open_values(self) -> dict[str, str]:
        """What stands in capitals in the options, where only a person knows the value, and what
        it is."""
        return open_values(self.options)

    def recording(self) -> Recording:
        """Convert the columns to the contract's units, and check them.

        Axes at rest are passive, unless an option names the axes.

        Raises
        ------
        DataError
            There is a question, a column is missing, or the data fail a check of
            `edge_ident.signals.data_checks`.
        """
        with speaking_python(self._of_program):
            return self._recording()

    def _recording(self) -> Recording:
        if self.questions:
            raise DataError(
                f"{self.source}: not certain which column is what: {'; '.join(self.questions)}",
                f"accept or correct the proposal: {_shell(self.options)}",
            )
        held = ", ".join(use.heading for use in self.columns)
        columns = contract_columns.only_axes(self.source, self._columns, self._axes)
        times = [
            (use.heading, use.unit.factor)
            for use in self.columns
            if use.target == contract_columns.TIME
        ]
        data_checks.check_table(self.source, columns, self._rows, held, next(iter(times), None))
        recording = contract_columns.recording_of(self.source, columns, self._effort_shift_s, held)
        recording = recording if self._axes else data_checks.resting_as_passive(recording)
        data_checks.check_motions(recording, self._rows)
        return recording


def inspect_recording(source: Source, options: ReadOptions | None = None) -> Inspection:
    """Read a file of any known format, and find out what its columns are.

    Parameters
    ----------
    source : str, Path or data frame
        The ending of the name tells the format: .npz, .mat, .h5 or .hdf5, .tdms, .parquet, .xlsx,
        and .bag, .db3 or .mcap of ROS; any other is text.
    options : ReadOptions, optional

    Returns
    -------
    Inspection

    Raises
    ------
    DataError
        The file is missing or unreadable, its package is not installed, or an option names a
        column or a unit that is none.

    Examples
    --------
    >>> import edge_ident
    >>> edge_ident.save_recording(edge_ident.simulate(), "drive.csv")
    >>> edge_ident.inspect_recording("drive.csv").questions
    ()
    """
    options = options or ReadOptions()
    check_type(options, ReadOptions, 'give ReadOptions(columns={"pos": "x_position_rad"}, ...)')
    if not (isinstance(source, str | Path) or is_frame(source)):
        raise DataError(f"{type_of(source)} is no recording", "give a path or a data frame")
    with speaking_python(is_frame(source)):
        table = read_table(source, options.delimiter, options.decimal, options.topic)
        table = made_columns.with_own_clocks(table)
        mapping = map_columns(table, options)
    rows = len(table.columns[0].values) if table.columns else 0
    asked = _encodings(table, mapping) if options.effort_encoding is None else {}
    questions = (*mapping.questions, *asked.values())
    made = made_columns.OneClock({}, (), range(0))
    if not questions:
        made = _converted(table, mapping, rows, options)
    return Inspection(
        source=table.source,
        how=table.how,
        rows=rows,
        columns=mapping.uses,
        period_s=mapping.period_s,
        period_reason=mapping.period_reason,
        left_out=table.left_out,
        questions=questions,
        options=(*mapping.options, *(x for name in asked for x in ("--effort-encoding", name))),
        done=made.said,
        _columns=made.columns,
        _rows=made.rows,
        _effort_shift_s=_effort_shift_s(table),
        _axes=options.axes,
        _of_program=is_frame(source),
    )


def load_recording(
    source: Source, rename: Mapping[str, str] | None = None, options: ReadOptions | None = None
) -> Recording:
    """Read and check a recording.

    An effort that never changes is refused only where something has to follow from it.

    Parameters
    ----------
    source : str, Path or data frame
        See `inspect_recording`.
    rename : mapping, optional
        From a column's name in the file to its name in the contract; goes before that of the
        options.
    options : ReadOptions, optional
        Units, sampling period and what else the file does not say.

    Returns
    -------
    Recording

    Raises
    ------
    DataError
        The file is missing or unreadable, a column is missing or misnamed, it is not certain which
        column is what, or the data fail a check of `edge_ident.signals.data_checks`.

    Examples
    --------
    >>> import edge_ident
    >>> edge_ident.save_recording(edge_ident.simulate(), "drive.csv")
    >>> recording = edge_ident.load_recording("drive.csv")
    >>> recording.axes["x"].position_unit
    'rad'
    """
    options = options or ReadOptions()
    check_type(options, ReadOptions, 'give ReadOptions(columns={"pos": "x_position_rad"}, ...)')
    check_type(rename or {}, Mapping, "give ReadOptions as options=")
    options = replace(options, columns={**options.columns, **(rename or {})})
    return inspect_recording(source, options).recording()


def save_recording(recording: Recording, path: str | Path) -> None:
    """Write a recording, whole or not at all.

    Parameters
    ----------
    recording : Recording
    path : str or Path
        A name that ends in `.npz` gives that format, any other gives `.csv`.

    Raises
    ------
    DataError
        A unit is none of a recording, or a signal is not as long as the time.
    OSError
        The file cannot be written.

    Examples
    --------
    >>> import edge_ident
    >>> edge_ident.save_recording(edge_ident.simulate(), "drive.npz")
    """
    check_type(recording, Recording, "give what load_recording or simulate returned")
    data_checks.check_form(recording)
    path = path_of(path, "the file to write, .npz or .csv")
    columns = contract_columns.columns_of(recording)
    with atomic_write(path, lasting=False) as partial:  # a watchdog does not wait for a disk
        if path.suffix == ".npz":
            shift = {_SHIFT: np.array(recording.effort_shift_s)}
            np.savez(partial, allow_pickle=False, **columns, **shift)
            return
        with partial.open("w", newline="") as file:
            file.write(f"# {_SHIFT}={recording.effort_shift_s!r}\n")
            file.write(",".join(columns) + "\n")
            formats = [_TIME_FORMAT] + [_FORMAT] * (len(columns) - 1)
            np.savetxt(file, np.column_stack(list(columns.values())), fmt=formats, delimiter=",")


def _encodings(table: Table, mapping: ColumnMapping) -> dict[str, str]:
    """By the encoding of an effort that lacks its sign, the question about it."""
    asked: dict[str, str] = {}
    for column, use in zip(table.columns, mapping.uses, strict=True):
        if effort_encoding.is_effort(use.target):
            known = column.values[~np.isnan(column.values)] if column.sparse else column.values
            encoding = effort_encoding.find_encoding(known)
            if encoding is not None:
                asked.setdefault(
                    encoding, effort_encoding.encoding_sentence(use.heading, known, encoding)
                )
    return asked


def _converted(
    table: Table, mapping: ColumnMapping, rows: int, options: ReadOptions
) -> made_columns.OneClock:
    """Columns by their names in the contract, on one clock; the table's own arrays, which may be
    large."""
    columns: dict[str, Array] = {}
    sparse: list[str] = []
    signed: list[str] = []
    for column, use in zip(table.columns, mapping.uses, strict=True):
        if use.target is not None:
            values = column.values if column.values.flags.writeable else column.values.copy()
            if options.effort_encoding is not None and effort_encoding.is_effort(use.target):
                given, values = values, effort_encoding.decode(values, options.effort_encoding)
                negative = int(np.count_nonzero(values < 0.0))
                said = f"{use.heading}: {negative} of {rows} values are negative, by their encoding"
                if options.effort_encoding == effort_encoding.OPPOSITE:
                    said = f"{use.heading}: multiplied by -1"
                signed += [said] if values is not given else []
            if (use.unit.factor, use.unit.offset) != (1.0, 0.0):
                values *= use.unit.factor
                values += use.unit.offset
            columns[use.target] = values
            sparse += [use.target] if column.sparse else []
    if mapping.period_s is not None:
        columns[contract_columns.TIME] = mapping.period_s * np.arange(rows, dtype=np.float64)
    signed += _went_on(columns)
    numbers = range(table.first_row, table.first_row + rows)
    made = made_columns.on_one_clock(columns, sparse, numbers, options.effort_shift_s)
    whole, integrated = made_columns.with_integrated_speed(made.columns)
    return replace(made, columns=whole, said=(*signed, *made.said, *integrated))


def _went_on(columns: dict[str, Array]) -> list[str]:
    """Put positions together that start again after a turn, and say so."""
    said = []
    for name, values in columns.items():
        _, quantity, unit = contract_columns.parse_name(name) or ("", "", "")
        if quantity in ("position", "reference"):
            known = ~np.isnan(values)
            whole, turn, times = made_columns.unwrapped(values[known], unit)
            if times:
                columns[name] = values.copy()
                columns[name][known] = whole
                said.append(f"{name} starts again after {turn:.6g} {unit}, {times} times: joined")
    return said


def _effort_shift_s(table: Table) -> float:
    text = table.header.get(_SHIFT, "0")
    try:
        shift_s = float(text)
    except ValueError:
        shift_s = math.nan
    if not abs(shift_s) <= _LARGEST_SHIFT_S:
        raise DataError(
            f"{table.source}: its {_SHIFT} is {text}",
            f"give seconds, {-_LARGEST_SHIFT_S:g} to {_LARGEST_SHIFT_S:g}, or leave it out",
        )
    return shift_s


def _shell(options: tuple[str, ...]) -> str:
    from shlex import join

    return join(options)


# The recordings that a caller gives: recordings, paths or data frames, one or several.

Given = Recording | Source
"""A recording, or what `load_recording` makes one of."""

_WANTED = "give a Recording, the path of a file, or a data frame"


def given_recording(given: "Given | Iterable[Given]", job: str) -> Recording:
    """The one recording that is meant.

    Parameters
    ----------
    given : Recording, str, Path, data frame, or one of these in a sequence
    job : str
        What is to be done with it, for messages.

    Raises
    ------
    DataError
        As of `load_recording`; there is none, or there are several.
    """
    found = given_recordings(given)
    if len(found) != 1:
        raise DataError(
            f"{len(found)} recordings to {job}: it takes one at a time",
            f"call {job} for each of them; diagnose takes several of one machine together",
        )
    return found[0]


def given_recordings(given: "Given | Iterable[Given]") -> list[Recording]:
    """The recordings that are meant, in their order.

    Raises
    ------
    DataError
        As of `load_recording`; something is neither a recording nor what one is made of.
    """
    if isinstance(given, Recording | str | os.PathLike) or is_frame(given):
        return [_one(given)]
    if not isinstance(given, Iterable):
        raise DataError(f"{type_of(given)} is no recording", _WANTED)
    return [_one(each) for each in given]


def _one(given: object) -> Recording:
    if isinstance(given, Recording):
        return given
    if isinstance(given, str | os.PathLike):
        with speaking_python():
            return load_recording(os.fspath(given))
    if is_frame(given):
        return load_recording(given)  # type: ignore[arg-type]  # by what it can do
    raise DataError(f"{type_of(given)} is no recording", _WANTED)


# What a message says of options of the command line, as a program says it.

# Fields of `ReadOptions` that are not named as the option is.
_NAMES: Final = {
    "column": "columns", "unit": "units", "period": "period_s", "axis": "axes",
    "effort_shift": "effort_shift_s",
}  # fmt: skip
_MAPPINGS: Final = frozenset({"columns", "units"})
_WORDS: Final = ("comma", "point", "semicolon", "tab", "blanks", "sign-magnitude")
# What follows an option and is its value, and no word of the sentence.
_VALUE: Final = (
    r"'[^']*'|[^\s,;:)]*[=\d][^\s,;:)]*|[A-Z_/]+\b|(?<=--axis )[^\s,;:)]+"
    rf"|(?:{'|'.join(_WORDS)})\b"
)
_OPTION: Final = re.compile(rf"--([a-z][a-z-]*)(?: ({_VALUE}))?")
_RUN: Final = re.compile(rf"{_OPTION.pattern}(?: {_OPTION.pattern})*")


@contextmanager
def speaking_python(wanted: bool = True) -> Iterator[None]:
    """Reword what a refusal says, where a program reads the data and no command does."""
    try:
        yield
    except DataError as error:
        if not wanted:
            raise
        said = DataError(in_python(error.cause), in_python(error.next_step))
        said.code = error.code
        raise said from error


def in_python(text: str) -> str:
    """The text with `ReadOptions` in the place of options of the command line.

    Examples
    --------
    >>> in_python("accept it: --column 'pos=x_position_rad' --period 0.001")
    "accept it: options=ReadOptions(columns={'pos': 'x_position_rad'}, period_s=0.001)"
    """
    return _RUN.sub(lambda run: _call(run[0]), text)


def _call(run: str) -> str:
    """One call for options that follow each other."""
    given: dict[str, str] = {}
    pairs: dict[str, dict[str, str]] = {}
    axes: list[str] = []
    for option in _OPTION.finditer(run):
        name = option[1].replace("-", "_")
        name, value = _NAMES.get(name, name), (option[2] or "").strip("'")
        heading, equals, meaning = value.partition("=")
        if name in _MAPPINGS and equals:
            pairs.setdefault(name, {})[heading] = meaning
            given[name] = repr(pairs[name])
        elif name == "axes" and value:
            axes.append(value)
            given[name] = repr(axes)
        elif value:
            given[name] = value if _is_number(value) or value.isupper() else repr(value)
        else:
            given[name] = "…"
    called = ", ".join(f"{name}={value}" for name, value in given.items())
    return f"options=ReadOptions({called})"


def _is_number(value: str) -> bool:
    try:
        float(value)
    except ValueError:
        return False
    return True
