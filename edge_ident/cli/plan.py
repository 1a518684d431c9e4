"""The command plan: the motion that separates causes."""

from pathlib import Path
from typing import Annotated

import typer

import edge_ident
from edge_ident import report
from edge_ident.cli.command import UNTRUSTED, command
from edge_ident.cli.diagnose import RecordingFiles
from edge_ident.cli.file_options import FileOptions
from edge_ident.cli.messages import print_document, say
from edge_ident.cli.options import DriveFile, Json, ModelFile, Seed, drive_for, model_for, named
from edge_ident.cli.progress import shown_progress
from edge_ident.support.stopwatch import keep

MotionOutput = Annotated[
    Path | None,
    typer.Option(
        "--output",
        "-o",
        metavar="FILE",
        parser=named,
        help="File to write the motion to, for capture --motion FILE.",
    ),
]
Seconds = Annotated[
    float | None,
    typer.Option(
        "--seconds",
        min=1.0,
        max=600.0,
        metavar="NUMBER",
        envvar="EDGE_IDENT_SECONDS",
        help="Duration of the motion; default: as in the drive description.",
    ),
]


def register(app: typer.Typer) -> None:
    """Add this file's command."""
    app.command()(plan)


@command
def plan(
    *,
    files: RecordingFiles,
    drive: DriveFile = None,
    model: ModelFile = None,
    seconds: Seconds = None,
    seed: Seed = 0,
    reading: FileOptions,
    output: MotionOutput = None,
    json: Json = False,
) -> None:
    """Design a motion that separates the causes that the recordings leave open.

    The recordings are diagnosed first. The motion and its overshoot stay inside the limits of the
    drive description (--drive; default: the built-in drive). The motion and the causes that it
    separates are printed; with --output, the motion is written to that file.

    Example: `edge-ident plan recording.csv --drive press.toml --output motion.json`
    """
    recordings = [reading.read(file) for file in files]
    axes = recordings[0].axes
    limits, known = drive_for(drive, axes), model_for(model, axes)
    say(_whose(drive))
    keep()
    with shown_progress() as bars:
        diagnosis = edge_ident.diagnose(recordings, model=known, on_progress=bars.show)
        bars.stage("designing the motion")
        found = edge_ident.plan_motion(diagnosis, recordings, limits, duration_s=seconds, seed=seed)
    written = output if found.trajectory is not None else None
    if found.trajectory is not None and output is not None:
        edge_ident.save_motion(found.trajectory, output)
        say(f"written: {output}; run it with: edge-ident capture --motion {output}")
    elif found.trajectory is not None:
        say("keep the motion with --output FILE, and run it with: edge-ident capture --motion FILE")
    if json:
        print_document(report.plan_document(found, written))
    else:
        report.show(found)
    if found.trajectory is None:
        say("next:  " + report.plan_next_step(found))
    if found.pairs and not all(pair.separated for pair in found.pairs):
        raise typer.Exit(UNTRUSTED)


def _whose(drive: Path | None) -> str:
    """Sentence that says whose limits the motion keeps."""
    if drive is not None:
        return f"limits: those of {drive}"
    return (
        "limits: those of the built-in drive, which may be more than your machine bears. Give its "
        "own with --drive FILE; edge-ident init writes such a file"
    )
