"""The command import: what a file of another program holds, and a recording made of it."""

from pathlib import Path
from typing import Annotated, Final, NoReturn

import typer

import edge_ident
from edge_ident import report
from edge_ident.cli.command import command
from edge_ident.cli.file_options import RecordingOptions
from edge_ident.cli.messages import print_document, say
from edge_ident.cli.options import Json

_SUFFIXES: Final = (".csv", ".npz")
OutputFile = Annotated[
    Path | None,
    typer.Option("--output", "-o", metavar="REC", help="Recording to write, .csv or .npz."),
]


def register(app: typer.Typer) -> None:
    """Add this file's command."""
    app.command("import")(import_file)


@command
def import_file(
    *, recording: RecordingOptions, output: OutputFile = None, json: Json = False
) -> None:
    """Show columns, units and sampling of a file, and write it as a recording of SI columns.

    Where it is not certain which column is what, the proposal is shown with the command that
    accepts it, and nothing is written. All commands that take a recording take the same options.

    Example: `edge-ident import scope.csv --unit Position=mm -o drive.npz`
    """
    if output is not None and output.suffix not in _SUFFIXES:
        raise typer.BadParameter(f"end it in {' or '.join(_SUFFIXES)}", param_hint="--output")
    found = recording.inspect(recording.file)
    if found.questions:
        _ask(found, recording, json)
    made = found.recording()
    if output is not None:
        edge_ident.save_recording(made, output)
    for line in report.scale_lines(made):
        say(line)
    if json:
        print_document(report.import_document(found, made, output))
        return
    for line in (*report.inspection_lines(found), *report.recording_lines(made)):
        print(line)
    if output is not None:
        print(output)


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
