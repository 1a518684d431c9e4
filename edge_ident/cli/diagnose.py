"""The command that finds what a model gets wrong: diagnose."""

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from edge_ident.cli.common import (
    UNTRUSTED,
    Json,
    ModelFile,
    Output,
    ProgressBars,
    deliver,
    guarded,
    say,
    shown_progress,
)
from edge_ident.cli.files import Columns, parse_renames

if TYPE_CHECKING:
    from edge_ident.diagnosis.result import Diagnosis


def register(app: typer.Typer) -> None:
    """Add this file's command."""
    app.command()(diagnose)


@guarded
def diagnose(
    files: Annotated[
        list[Path], typer.Argument(metavar="FILE…", help="Recordings of one machine, .csv or .npz.")
    ],
    validate: Annotated[
        Path | None,
        typer.Option(
            "--validate",
            metavar="FILE",
            envvar="EDGE_IDENT_VALIDATE",
            help="Recording on which the models that were fitted to the others are scored.",
        ),
    ] = None,
    model: ModelFile = None,
    column: Columns = None,
    output: Output = None,
    json: Json = False,
) -> None:
    """Find what the base model gets wrong, name the cause, extend the model, measure the gain.

    Example: `edge-ident diagnose monday.csv tuesday.csv --validate friday.csv --output diagnosis`
    """
    from edge_ident.diagnosis.diagnose import diagnose as diagnose_recordings
    from edge_ident.diagnosis.motion_check import with_motion_errors
    from edge_ident.diagnosis.present.document import diagnosis_document
    from edge_ident.diagnosis.present.page import write_page
    from edge_ident.diagnosis.present.tables import print_diagnosis
    from edge_ident.model.model_files import MODEL_FILE, load_model, save_model, sourced_model
    from edge_ident.signals.recording_files import load_recording

    renames = parse_renames(column)
    recordings = [load_recording(file, renames) for file in files]
    held_out = load_recording(validate, renames) if validate else None
    start = load_model(model) if model else None
    with shown_progress() as bars:
        found = diagnose_recordings(
            recordings, model=start, validate=held_out, on_progress=_staged(bars)
        )
        bars.stage("motion")
        found = with_motion_errors(found, recordings)
    model_file = output / MODEL_FILE if output else None
    if model_file:
        axes = {name: axis.model for name, axis in found.axes.items()}
        save_model(sourced_model(axes, files), model_file)
    deliver(diagnosis_document(found, model_file), "diagnosis.json", output, json)
    if not json:
        print_diagnosis(found)
    if output:
        say(f"written: {write_page(found, [file.name for file in files], output)}")
    if not _trusted(found):
        raise typer.Exit(UNTRUSTED)


def _staged(bars: ProgressBars) -> Callable[[str, int, int], None]:
    """Shows what the diagnosis tells of its progress, a bar for each stage."""
    current = ""

    def show(stage: str, done: int, of: int) -> None:
        nonlocal current
        if stage != current:
            current = stage
            bars.stage(stage)
        bars.samples(done, of)

    return show


def _trusted(found: "Diagnosis") -> bool:
    """Whether every axis is understood."""
    from edge_ident.diagnosis.result import Verdict

    return all(axis.verdict is not Verdict.UNEXPLAINED for axis in found.axes.values())
