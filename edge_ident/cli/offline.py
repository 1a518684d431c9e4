"""Commands that need a checkout and torch: train, export."""

import importlib
from pathlib import Path
from typing import Annotated, Any, Final

import typer

from edge_ident.cli.common import (
    Json,
    ModelFile,
    given_model,
    guarded,
    print_document,
    shown_progress,
)
from edge_ident.cli.files import Columns, parse_renames
from edge_ident.errors import ModelError

CHECKPOINT: Final = "checkpoint.pt"


def register(app: typer.Typer) -> None:
    """Add this file's commands."""
    app.command()(train)
    app.command()(export)


@guarded
def train(
    output: Annotated[
        Path, typer.Option("--output", envvar="EDGE_IDENT_OUTPUT", help="Folder of the checkpoint.")
    ] = Path("runs/feed_drive"),
    configuration: Annotated[
        str,
        typer.Option(
            "--configuration",
            envvar="EDGE_IDENT_CONFIGURATION",
            help="improved; plain, without effects; or paper, the paper's recipe.",
        ),
    ] = "improved",
    motion_from: Annotated[
        Path | None,
        typer.Option(
            "--motion-from",
            metavar="RECORDING",
            help="Train for the motion of this recording instead of the paper's.",
        ),
    ] = None,
    axis: Annotated[
        str | None,
        typer.Option("--axis", help="Of that recording or model, where it has several."),
    ] = None,
    column: Columns = None,
    model: ModelFile = None,
    name: Annotated[
        str | None,
        typer.Option("--name", help="Of the network's files; default: that of the recording."),
    ] = None,
    resume: Annotated[bool, typer.Option("--resume", help="Go on with the checkpoint.")] = False,
    accelerator: Annotated[
        str | None,
        typer.Option(
            "--accelerator",
            envvar="EDGE_IDENT_ACCELERATOR",
            help="Torch device; default: a GPU where there is one.",
        ),
    ] = None,
    json: Json = False,
) -> None:
    """Train a network on simulated drives; Ctrl-C keeps the checkpoint, --resume goes on.

    With --model, every drive has the effects of that model.

    Example: `edge-ident train --output runs/mine --motion-from recording.csv`
    """
    chosen = _offline("export.configuration").configuration(configuration)
    motions = _offline("export.motion")
    if motion_from is None:
        motion = motions.paper_motion()
    else:
        from edge_ident.signals.recording_files import load_recording

        recording = load_recording(motion_from, parse_renames(column))
        motion = motions.motion_from(recording, axis, name or motion_from.stem)
    known = given_model(model)
    if known is not None:
        motion = motions.with_effects(motion, known, axis)
    trainer = _offline("export.train")
    with shown_progress() as observer:
        stage = ""

        def show(progress: Any) -> None:
            nonlocal stage
            if progress.stage != stage:
                stage = progress.stage
                observer.stage(f"training, {stage}")
            observer.samples(progress.step, progress.steps)
            if progress.loss is not None:
                observer.note(f"loss {progress.loss:.3g}")

        path = trainer.train(
            chosen,
            motion,
            output / CHECKPOINT,
            resume=resume,
            accelerator=accelerator,
            on_progress=show,
        )
    if json:
        losses = path.with_name("losses.csv")
        print_document(
            {"schema": "edge-ident/training/1", "checkpoint": str(path), "losses": str(losses)}
        )
    else:
        print(path)


@guarded
def export(
    checkpoint: Annotated[Path, typer.Argument(help="What `train` left.")] = Path(
        "runs/feed_drive/checkpoint.pt"
    ),
    output: Annotated[
        Path, typer.Option("--output", envvar="EDGE_IDENT_OUTPUT", help="Folder of networks.")
    ] = Path("edge_ident/networks"),
    json: Json = False,
) -> None:
    """Turn a checkpoint into ONNX, fp32 and int8, with parity checks and a manifest.

    Example: `edge-ident export runs/mine/checkpoint.pt --output networks`
    """
    exporter = _offline("export.onnx_export")
    with shown_progress() as observer:
        manifest = exporter.export(checkpoint, output, observer.stage)
    if json:
        print_document({"schema": "edge-ident/export/1", "manifest": str(manifest)})
    else:
        print(manifest)


def _offline(module: str) -> Any:
    """A module of the `export` package, or what is missing to have it."""
    try:
        return importlib.import_module(module)
    except ModuleNotFoundError as error:
        if (error.name or "").split(".")[0] == "export":
            raise ModelError(
                "training and export are not part of the installed package",
                "clone the project and install it with: pip install -e '.[train]'",
            ) from error
        raise ModelError(
            f"training and export need {error.name}",
            "install it with: pip install -e '.[train]'",
        ) from error
