"""The command import: what a file of another program holds, and a recording made of it."""

from typing import NoReturn

import typer

import edge_ident
from edge_ident import report
from edge_ident.cli.command import command
from edge_ident.cli.file_options import RecordingOptions
from edge_ident.cli.messages import print_document, say
from edge_ident.cli.options import Json, OptionalRecordingOutput, recording_file


def register(app: typer.Typer) -> None:
    """Add this file's command."""
    app.command("import")(import_file)


@command
def import_file(
    *, recording: RecordingOptions, output: OptionalRecordingOutput = None, json: Json = False
) -> None:
    """Show the columns, units and sampling of a file, and convert it to a recording in SI units.

    If the meaning of a column is not certain, a proposal is printed with the command that accepts
    it, and nothing is written. All commands that read a recording have the same options. With
    --output, the recording is written to that file or folder, and its path is printed.

    Example: `edge-ident import scope.csv --unit Position=mm -o drive.npz`
    """
    target = None if output is None else recording_file(output)
    if target is not None and target.exists() and target.samefile(recording.file):
        raise typer.BadParameter(
            f"{target} is the file to import, which may hold more than the recording",
            param_hint="--output",
        )
    found = recording.inspect(recording.file)
    if found.questions:
        _ask(found, recording, json)
    made = found.recording()
    if target is not None:
        edge_ident.save_recording(made, target)
    for line in (*report.resting_lines(found, made), *report.scale_lines(made)):
        say(line)
    if json:
        print_document(report.import_document(found, made, target))
        return
    tell = print if target is None else say  # where a file is written, its path is the result
    for line in (*report.inspection_lines(found), *report.recording_lines(made)):
        tell(line)
    if target is not None:
        print(target)


def _ask(found: "edge_ident.Inspection", recording: RecordingOptions, as_json: bool) -> NoReturn:
    """Show a proposal, what is not certain of it, and the command that accepts it."""
    if as_json:
        print_document(report.import_document(found, None, None))
    else:
        for line in report.inspection_lines(found):
            print(line)
    say(f"error: {recording.doubt(found)}")
    say(f"next:  {recording.accepting(found, recording.file)}")
    raise typer.Exit(edge_ident.DataError.exit_code)
