"""Commands that work on files: identify, report."""

from pathlib import Path
from typing import Annotated

import typer

from edge_ident.cli.common import (
    UNTRUSTED,
    Json,
    ModelFile,
    NetworkFile,
    Output,
    Precision,
    Seed,
    built_in_or_given_network,
    deliver,
    given_model,
    guarded,
    leave_model,
    print_document,
)

RecordingFile = Annotated[Path, typer.Argument(metavar="FILE", help="Recording, .csv or .npz.")]
Columns = Annotated[
    list[str] | None,
    typer.Option("--column", metavar="NAME=CONTRACT_NAME", help="Rename a column; repeatable."),
]


def register(app: typer.Typer) -> None:
    """Add this file's commands."""
    app.command()(identify)
    app.command()(report)


@guarded
def identify(
    file: RecordingFile,
    column: Columns = None,
    network: NetworkFile = None,
    precision: Precision = "fp32",
    model: ModelFile = None,
    seed: Seed = 0,
    output: Output = None,
    json: Json = False,
) -> None:
    """Identify the parameters of every axis in a recording, the model's effects taken off first.

    Example: `edge-ident identify recording.csv --column pos=x_position_rad --json`
    """
    from edge_ident.identification.identify import identify as identify_recording
    from edge_ident.report.documents import identification_document
    from edge_ident.report.tables import print_identification
    from edge_ident.signals.recording_files import load_recording
    from edge_ident.support.stopwatch import Stopwatch

    watch = Stopwatch()
    with watch.stage("load"):
        recording = load_recording(file, parse_renames(column))
        loaded = built_in_or_given_network(network, precision)
        known = given_model(model)
    found = identify_recording(recording, loaded, model=known, seed=seed, stopwatch=watch)
    document = identification_document(found)
    deliver(document, "identification.json", output, json)
    if output:
        leave_model(found, file, known, output)
    if not json:
        print_identification(found)
    if not found.trusted:
        raise typer.Exit(UNTRUSTED)


@guarded
def report(
    folder: Annotated[Path, typer.Argument(help="Folder that `run` or `capture` left.")],
    output: Output = None,
    json: Json = False,
) -> None:
    """Draw what a run measured: effort against model, residual, tracking before and after.

    Example: `edge-ident report edge-ident-runs/2026-01-31T09-15-00`
    """
    from edge_ident.report.figures import draw_run

    picture = draw_run(folder, (output or folder) / "report.png")
    if json:
        print_document({"schema": "edge-ident/report/1", "figure": str(picture)})
    else:
        print(picture)


def parse_renames(given: list[str] | None) -> dict[str, str]:
    """From NAME=CONTRACT_NAME texts to a mapping."""
    renames = {}
    for text in given or []:
        name, sign, contract_name = text.partition("=")
        if not sign or not name or not contract_name:
            raise typer.BadParameter("write NAME=CONTRACT_NAME", param_hint="--column")
        renames[name] = contract_name
    return renames
