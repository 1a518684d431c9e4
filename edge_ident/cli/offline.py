"""Commands that need a checkout: train, export."""

import importlib
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Annotated, Any, Final

import typer

from edge_ident.cli.command import UNTRUSTED, command
from edge_ident.cli.file_options import FileOptions
from edge_ident.cli.messages import (
    Progress,
    duration,
    print_result,
    say,
    say_always,
    shown_progress,
)
from edge_ident.cli.options import Setting, given_model, result_folder, setting
from edge_ident.errors import ModelError

CHECKPOINT: Final = "checkpoint.pt"
DEFAULT_RUN: Final = Path("runs/feed_drive")
TRAIN_EXTRA: Final = "-e '.[train]'"


@dataclass(frozen=True, kw_only=True)
class TrainedMotion(FileOptions):
    """The motion and the effects that a network is trained for.

    Attributes
    ----------
    motion_from : FILE
        Recording with the motion to train for; default: the sinusoid of the paper.
    name : NAME
        Name of the files of the network; default: that of the recording.
    """

    motion_from: Path | None = None
    model: Setting[Path | None] = None
    name: str | None = None

    def load(self) -> Any:
        """Return the motion that `export` trains for, of the axis that was named."""
        if len(self.axis or ()) > 1:
            raise typer.BadParameter("a network is trained for one axis", param_hint="--axis")
        axis = self.axis[0] if self.axis else None
        motions = _offline("export.motion")
        if self.motion_from is None:
            motion = motions.paper_motion()
        else:
            recording = self.read(self.motion_from)
            motion = motions.motion_from(recording, axis, self.name or self.motion_from.stem)
        known = given_model(self.model)
        return motion if known is None else motions.with_effects(motion, known, axis)


def register(app: typer.Typer) -> None:
    """Add this file's commands."""
    app.command()(train)
    app.command()(export)


@command
def train(
    *,
    output: Annotated[Path, setting("-o", parser=result_folder)] = DEFAULT_RUN,
    configuration: Setting[str] = "improved",
    motion: TrainedMotion,
    resume: bool = False,
    accelerator: Setting[str | None] = None,
    json: bool = False,
) -> None:
    """Train a network on simulated drives; after Ctrl-C, --resume continues the training.

    With --model, every simulated drive has the effects of that model. The checkpoint and the loss
    curves are written to the folder given by --output (default: runs/feed_drive). The path of the
    checkpoint is printed.

    Example: `edge-ident train --output runs/mine --motion-from recording.csv`

    Parameters
    ----------
    output : FOLDER
        Folder to write the checkpoint and the loss curves to.
    configuration : improved|plain|paper
        Training recipe: improved; plain, which has no effects; or that of the paper.
    resume
        Continue from the checkpoint in the folder; begin anew if there is none.
    accelerator : DEVICE
        Torch device such as cpu or cuda; default: a GPU if there is one.
    """
    chosen = _offline("export.configuration").configuration(configuration)
    known_motion = motion.load()
    trainer = _offline("export.train")
    with shown_progress() as bars:
        try:
            path = trainer.train(
                chosen, known_motion, output / CHECKPOINT, resume=resume, accelerator=accelerator,
                on_progress=_shown_on(bars),
            )  # fmt: skip
        except KeyboardInterrupt as interruption:
            interruption.add_note("the same command with --resume continues the training")
            raise
    losses = path.with_name("losses.csv")
    document = {"schema": "edge-ident/training/1", "checkpoint": str(path), "losses": str(losses)}
    print_result(document, path, as_json=json)


def _shown_on(bars: Progress) -> Any:
    """What the training calls with its progress."""

    def show(progress: Any) -> None:
        bars.show(f"training, {progress.stage}", progress.step, progress.steps)
        left = None if progress.left_s is None else f"{duration(progress.left_s)} left in all"
        loss = None if progress.loss is None else f"loss {progress.loss:.3g}"
        bars.note(", ".join(filter(None, [left, loss])))

    return show


@command
def export(
    *,
    checkpoint: Annotated[Path | None, typer.Argument()] = None,
    output: Annotated[Path, setting("-o", parser=result_folder)] = Path("networks"),
    c: Path | None = None,
    network: Path | None = None,
    int8: Annotated[bool, typer.Option("--int8/--no-int8")] = True,
    json: bool = False,
) -> None:
    """Convert a checkpoint to ONNX networks, or write an int8 network as C for a microcontroller.

    The networks, fp32 and int8, are checked and written to the folder given by --output (default:
    networks), with a manifest. The path of the manifest is printed. The network that comes with
    edge-ident is not replaced. Where quantization costs too much accuracy, the int8 network is left
    out: the command says how much, and ends with exit code 1. --no-int8 leaves it out in any case.

    With --c, an int8 network is written as C99: a header, whose path is printed, and two other
    files. This needs onnx, but not torch.

    Example: `edge-ident export runs/mine/checkpoint.pt --output networks`

    Example: `edge-ident export --c firmware/network`

    Parameters
    ----------
    checkpoint : FILE
        Checkpoint written by train; default: runs/feed_drive/checkpoint.pt.
    output : FOLDER
        Folder to write the networks and their manifest to.
    c : FOLDER
        Write an int8 network to this folder as C99, instead of converting a checkpoint.
    network : FILE
        With --c: int8 network (.onnx) with its manifest in the same folder; default: the built-in
        network.
    int8
        Also write the int8 network, or leave it out.
    """
    if c is not None:
        if checkpoint is not None:
            raise typer.BadParameter(
                "export the checkpoint first, then give its int8 network with --network",
                param_hint="--c",
            )
        _export_c(c, network, json)
        return
    if network is not None:
        raise typer.BadParameter("goes with --c only", param_hint="--network")
    exporter = _offline("export.onnx_export")
    with shown_progress() as bars:
        exported = exporter.export(
            checkpoint or DEFAULT_RUN / CHECKPOINT, output, bars.stage, int8=int8
        )
    change = exported.int8
    figures = None if change is None else {**asdict(change), "written": change.small}
    manifest = str(exported.manifest)
    document = {"schema": "edge-ident/export/1", "manifest": manifest, "int8": figures}
    print_result(document, manifest, as_json=json)
    if change is not None:
        (say if change.small else say_always)(str(change))
        if not change.small:
            raise typer.Exit(UNTRUSTED)


def _export_c(folder: Path, network: Path | None, json: bool) -> None:
    source = _offline("export.c_source.source", "onnx").export_c(folder, network)
    sizes = source.sizes
    document = {
        "schema": "edge-ident/c-source/1",
        "files": [str(folder / name) for name in source.files],
        "network_sha256": source.sha256,
        **asdict(sizes),
    }
    if not json:
        say(
            f"{sizes.constants_bytes} bytes of constants, {sizes.memory_bytes} of memory and "
            f"{sizes.image_bytes} for the image"
        )
    print_result(document, folder / f"{source.name}.h", as_json=json)


def _offline(module: str, packages: str = TRAIN_EXTRA) -> Any:
    """Load a module of the `export` package, which needs those packages.

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
                f"clone the project and install it with: pip install {TRAIN_EXTRA}",
            ) from error
        raise ModelError(
            f"training and export need {error.name}", f"install it with: pip install {packages}"
        ) from error
