"""Commands that need a checkout and torch: train, export."""

import importlib
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Final

import typer

from edge_ident.cli.command import command
from edge_ident.cli.file_options import FileOptions
from edge_ident.cli.messages import print_document
from edge_ident.cli.options import Json, ModelFile, given_model
from edge_ident.cli.progress import Progress, shown_progress
from edge_ident.errors import ModelError

CHECKPOINT: Final = "checkpoint.pt"

CheckpointFolder = Annotated[
    Path,
    typer.Option(
        "--output",
        "-o",
        metavar="FOLDER",
        envvar="EDGE_IDENT_OUTPUT",
        help="Folder to write the checkpoint and the loss curves to.",
    ),
]
Configuration = Annotated[
    str,
    typer.Option(
        "--configuration",
        envvar="EDGE_IDENT_CONFIGURATION",
        metavar="improved|plain|paper",
        help="Training recipe: improved; plain, which has no effects; or that of the paper.",
    ),
]
Accelerator = Annotated[
    str | None,
    typer.Option(
        "--accelerator",
        envvar="EDGE_IDENT_ACCELERATOR",
        metavar="DEVICE",
        help="Torch device such as cpu or cuda; default: a GPU if there is one.",
    ),
]
Checkpoint = Annotated[Path, typer.Argument(metavar="FILE", help="Checkpoint written by train.")]
NetworkFolder = Annotated[
    Path,
    typer.Option(
        "--output",
        "-o",
        metavar="FOLDER",
        envvar="EDGE_IDENT_OUTPUT",
        help="Folder to write the networks and their manifest to.",
    ),
]


@dataclass(frozen=True, kw_only=True)
class TrainedMotion(FileOptions):
    """The motion and the effects that a network is trained for."""

    motion_from: Annotated[
        Path | None,
        typer.Option(
            "--motion-from",
            metavar="FILE",
            help="Recording with the motion to train for; default: the sinusoid of the paper.",
        ),
    ] = None
    axis: Annotated[
        str | None,
        typer.Option(
            "--axis", metavar="AXIS", help="Axis of the recording or model, if it has several."
        ),
    ] = None
    model: ModelFile = None
    name: Annotated[
        str | None,
        typer.Option(
            "--name",
            metavar="NAME",
            help="Name of the files of the network; default: that of the recording.",
        ),
    ] = None

    def load(self) -> Any:
        """Return the motion that `export` trains for."""
        motions = _offline("export.motion")
        if self.motion_from is None:
            motion = motions.paper_motion()
        else:
            recording = self.read(self.motion_from)
            motion = motions.motion_from(recording, self.axis, self.name or self.motion_from.stem)
        known = given_model(self.model)
        return motion if known is None else motions.with_effects(motion, known, self.axis)


def register(app: typer.Typer) -> None:
    """Add this file's commands."""
    app.command()(train)
    app.command()(export)


@command
def train(
    *,
    output: CheckpointFolder = Path("runs/feed_drive"),
    configuration: Configuration = "improved",
    motion: TrainedMotion,
    resume: Annotated[
        bool, typer.Option("--resume", help="Continue from the checkpoint in the folder.")
    ] = False,
    accelerator: Accelerator = None,
    json: Json = False,
) -> None:
    """Train a network on simulated drives; after Ctrl-C, --resume continues the training.

    With --model, every simulated drive has the effects of that model. The checkpoint and the loss
    curves are written to the folder given by --output (default: runs/feed_drive). The path of the
    checkpoint is printed.

    Example: `edge-ident train --output runs/mine --motion-from recording.csv`
    """
    chosen = _offline("export.configuration").configuration(configuration)
    known_motion = motion.load()
    trainer = _offline("export.train")
    with shown_progress() as bars:
        path = trainer.train(
            chosen, known_motion, output / CHECKPOINT, resume=resume, accelerator=accelerator,
            on_progress=_shown_on(bars),
        )  # fmt: skip
    if json:
        losses = path.with_name("losses.csv")
        print_document(
            {"schema": "edge-ident/training/1", "checkpoint": str(path), "losses": str(losses)}
        )
    else:
        print(path)


def _shown_on(bars: Progress) -> Any:
    """What the training calls with its progress."""

    def show(progress: Any) -> None:
        bars.show(f"training, {progress.stage}", progress.step, progress.steps)
        if progress.loss is not None:
            bars.note(f"loss {progress.loss:.3g}")

    return show


@command
def export(
    *,
    checkpoint: Checkpoint = Path("runs/feed_drive/checkpoint.pt"),
    output: NetworkFolder = Path("networks"),
    json: Json = False,
) -> None:
    """Convert a checkpoint to ONNX networks, fp32 and int8, check them, and write a manifest.

    The files are written to the folder given by --output (default: networks). The path of the
    manifest is printed. The network that comes with edge-ident is not replaced.

    Example: `edge-ident export runs/mine/checkpoint.pt --output networks`
    """
    exporter = _offline("export.onnx_export")
    with shown_progress() as bars:
        manifest = exporter.export(checkpoint, output, bars.stage)
    if json:
        print_document({"schema": "edge-ident/export/1", "manifest": str(manifest)})
    else:
        print(manifest)


def _offline(module: str) -> Any:
    """Load a module of the `export` package.

    Raises
    ------
    ModelError
        The package or one of its dependencies is not installed.
    """
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
