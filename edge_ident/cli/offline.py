"""Commands that need a checkout and torch: train, export."""

import importlib
from pathlib import Path
from typing import Annotated, Any, Final

import typer

from edge_ident.cli.common import Json, guarded, print_document, shown_progress
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
            help="improved, or paper for the paper's recipe.",
        ),
    ] = "improved",
    resume: Annotated[bool, typer.Option("--resume", help="Go on with the checkpoint.")] = False,
    accelerator: Annotated[
        str | None,
        typer.Option("--accelerator", envvar="EDGE_IDENT_ACCELERATOR", help="Such as cuda."),
    ] = None,
    json: Json = False,
) -> None:
    """Train a network on simulated drives; Ctrl-C keeps the checkpoint, --resume goes on.

    Example: `edge-ident train --output runs/mine`
    """
    chosen = _offline("export.configuration").configuration(configuration)
    trainer = _offline("export.train")
    with shown_progress() as observer:
        stage = ""

        def show(progress: Any) -> None:
            nonlocal stage
            if progress.stage != stage:
                stage = progress.stage
                observer.stage(f"training, {stage}")
            observer.samples(progress.step, progress.steps)
            observer.note(f"loss {progress.loss:.3g}")

        path = trainer.train(
            chosen, output / CHECKPOINT, resume=resume, accelerator=accelerator, on_progress=show
        )
    if json:
        print_document({"schema": "edge-ident/training/1", "checkpoint": str(path)})
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
