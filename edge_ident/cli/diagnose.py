"""The command diagnose: what a model gets wrong, and why."""

from pathlib import Path
from typing import Annotated, Literal

import typer

import edge_ident
from edge_ident import report
from edge_ident.cli.command import UNTRUSTED, command
from edge_ident.cli.messages import say
from edge_ident.cli.options import (
    Columns,
    ModelFile,
    ResultOptions,
    given_model,
    parse_renames,
    save_result_model,
)
from edge_ident.cli.progress import shown_progress

RecordingFiles = Annotated[
    list[Path], typer.Argument(metavar="FILE…", help="Recordings of one machine, .csv or .npz.")
]
ValidationFile = Annotated[
    Path | None,
    typer.Option(
        "--validate",
        metavar="FILE",
        envvar="EDGE_IDENT_VALIDATE",
        help="Recording on which the models, fitted to the other recordings, are scored.",
    ),
]
Tolerance = Annotated[
    float,
    typer.Option(
        "--tolerance",
        min=0.0,
        max=1.0,
        envvar="EDGE_IDENT_TOLERANCE",
        help="Smallest share of the rms effort that is worth naming.",
    ),
]
Stability = Annotated[
    bool,
    typer.Option(
        help="Repeat the search on disturbed data: what does not come back is suspected only."
    ),
]
KeepMinor = Annotated[
    bool,
    typer.Option("--keep-minor", help="Keep certain causes below the tolerance in the model."),
]

PageFormat = Annotated[
    Literal["html", "markdown"],
    typer.Option(
        "--format",
        envvar="EDGE_IDENT_FORMAT",
        help="Page in the folder: one HTML file for people, or Markdown for other documents.",
    ),
]


def register(app: typer.Typer) -> None:
    """Add this file's command."""
    app.command()(diagnose)


@command
def diagnose(
    *,
    files: RecordingFiles,
    validate: ValidationFile = None,
    model: ModelFile = None,
    tolerance: Tolerance = 0.01,
    stability: Stability = True,
    keep_minor: KeepMinor = False,
    column: Columns = None,
    page: PageFormat = "html",
    results: ResultOptions,
) -> None:
    """Find what the base model gets wrong, name the cause, extend the model, measure the gain.

    Example: `edge-ident diagnose monday.csv tuesday.csv --validate friday.csv --output diagnosis`
    """
    renames = parse_renames(column)
    recordings = [edge_ident.load_recording(file, renames) for file in files]
    held_out = edge_ident.load_recording(validate, renames) if validate else None
    known = given_model(model)
    with shown_progress() as bars:
        found = edge_ident.diagnose(
            recordings,
            model=known,
            validate=held_out,
            tolerance=tolerance,
            stability=stability,
            keep_minor=keep_minor,
            on_progress=bars.show,
        )
    folder = results.output
    model_file = save_result_model(found.model, files, folder) if folder else None
    results.deliver(report.diagnosis_document(found, model_file), "diagnosis.json")
    results.show(found)
    if folder:
        source = report.Provenance.of(files, validate)
        if page == "markdown":
            written = report.write_markdown(found, [name for name, _ in source.files], folder)
        else:
            written = report.write_page(found, source, folder, model_file)
        say(f"written: {written}")
    if not found.understood:
        raise typer.Exit(UNTRUSTED)
