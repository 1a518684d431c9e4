"""Options that say of a recording's file what does not stand in it; one list for all commands."""

from dataclasses import dataclass, fields
from pathlib import Path
from shlex import join
from typing import Annotated, Literal

import typer

import edge_ident
from edge_ident import report
from edge_ident.cli.messages import say
from edge_ident.support.next_step import Done


@dataclass(frozen=True, kw_only=True)
class FileOptions:
    """What a person says of files.

    Attributes
    ----------
    column : NAME=CONTRACT_NAME
        Meaning of a column, such as 'X.ActPos [mm]=x_position_m'; may be repeated.
    unit : NAME=UNIT
        Unit of a column or of its steps, such as mm or '1/8192 turn'; may be repeated.
    period : SECONDS
        Sampling period in s, for a file without a time column.
    resolution : COUNTS/UNIT
        Encoder counts per turn or length, such as 8192/turn or 1000/mm.
    rated_effort : EFFORT
        Effort at 100 %, such as 2.4Nm.
    torque_constant : NUMBER
        Torque constant in N*m/A, to convert a current to a torque.
    delimiter
        Delimiter of a text file; default: detected.
    decimal
        Decimal sign of a text file; default: detected.
    topic : NAME
        Topic of a bag to read, such as /joint_states.
    effort_encoding : ENCODING
        How the file codes the sign of the effort: uint16 (two's complement that was read as
        unsigned; also uint8, uint32, uint64), sign-magnitude (the highest bit is the sign), or
        opposite (it counts against the position).
    effort_shift : SECONDS
        Time in s by which the effort of a row acted after its position: 0.1 if a row holds the
        effort of 0.1 s later.
    axis : NAME
        Axis to read; may be repeated, joints of an arm from the base outwards. Default: all axes
        that move, in the order of the file. An axis whose reference moves while its position stands
        still is an error.
    """

    context: typer.Context
    column: list[str] | None = None
    unit: list[str] | None = None
    period: Annotated[float | None, typer.Option(min=1e-9)] = None
    resolution: str | None = None
    rated_effort: str | None = None
    torque_constant: float | None = None
    delimiter: Literal["comma", "semicolon", "tab", "blanks"] | None = None
    decimal: Literal["point", "comma"] | None = None  # fmt: skip

    topic: str | None = None  # fmt: skip
    effort_encoding: str | None = None
    effort_shift: float = 0.0
    axis: list[str] | None = None

    def inspect(self, file: Path) -> "edge_ident.Inspection":
        """Find out what a file's columns are."""
        return edge_ident.inspect_recording(file, self.options())

    def options(self) -> "edge_ident.ReadOptions":
        """What is said of every file."""
        return edge_ident.ReadOptions(
            columns=_pairs(self.column, "--column", "CONTRACT_NAME"),
            units=_pairs(self.unit, "--unit", "UNIT"),
            period_s=self.period,
            resolution=self.resolution,
            rated_effort=self.rated_effort,
            torque_constant=self.torque_constant,
            delimiter=self.delimiter,
            decimal=self.decimal,
            topic=self.topic,
            effort_encoding=self.effort_encoding,
            effort_shift_s=self.effort_shift,
            axes=self.axis or (),
        )

    def typed(self) -> tuple[str, ...]:
        """The options as they are typed."""
        said = []
        for of in fields(FileOptions):
            given = getattr(self, of.name)
            for value in given if isinstance(given, list) else [given]:
                if of.name != "context" and value not in (None, of.default):
                    said.append((f"--{of.name.replace('_', '-')}", str(value)))
        return tuple(word for pair in said for word in pair)

    def done(
        self, *files: Path | None, page: Path | None = None, model: Path | None = None
    ) -> Done:
        """What was done with files, for the next step."""
        named = tuple(str(file) for file in files if file is not None)
        of_page, of_model = ("" if one is None else str(one) for one in (page, model))
        return Done(named, self.typed(), of_page, model=of_model)

    def read(self, file: Path) -> "edge_ident.Recording":
        """Read and check a recording; what was decided goes to stderr.

        Raises
        ------
        DataError
            As `edge_ident.load_recording`; where the columns are not certain, the columns are
            listed before, and the next step is the command that accepts the proposal.
        """
        found = self.inspect(file)
        if found.questions:
            for line in report.recordings.inspection_lines(found):
                say(line)
            raise edge_ident.DataError(self.doubt(found), self.accepting(found, file))
        for line in found.assumptions:
            say(f"{file.name}: {line}")
        recording = found.recording()
        for line in report.recordings.resting_lines(found, recording) if recording.passive else ():
            say(line)
        return recording

    def doubt(self, found: "edge_ident.Inspection") -> str:
        """What is not certain of a file, in one line."""
        return f"{found.source}: not certain: {'; '.join(found.questions)}"

    def accepting(self, found: "edge_ident.Inspection", file: Path) -> str:
        """The command that accepts what is proposed for a file."""
        words = ["edge-ident", *self.context.command_path.split()[1:], str(file), *found.options]
        if not found.open_values:
            return f"correct or accept this: {join(words)}"
        said = "; ".join(f"{name}: {what}" for name, what in found.open_values.items())
        return f"put in what is in capitals ({said}): {join(words)}"


@dataclass(frozen=True, kw_only=True)
class RecordingOptions(FileOptions):
    """One recording, and what a person says of it.

    Attributes
    ----------
    file : FILE
        Recording: a text file, .npz, .mat, .h5, .tdms, .parquet, .xlsx, or a ROS bag (.bag, .db3,
        .mcap or a folder).
    """

    file: Annotated[Path, typer.Argument()]

    def load(self) -> "edge_ident.Recording":
        """Read and check the recording."""
        return self.read(self.file)


def _pairs(given: list[str] | None, flag: str, what: str) -> dict[str, str]:
    """Parse NAME=… texts; a name may have the sign in it."""
    pairs = {}
    for text in given or []:
        name, sign, value = text.rpartition("=")
        if not sign or not name or not value:
            raise typer.BadParameter(f"write NAME={what}", param_hint=flag)
        pairs[name] = value
    return pairs
