"""The command simulate: from a model to a recording."""

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Final

import typer

import edge_ident
from edge_ident import report
from edge_ident.cli.command import command
from edge_ident.cli.file_options import FileOptions
from edge_ident.cli.messages import print_document, say
from edge_ident.cli.options import (
    Json,
    RecordingOutput,
    Seed,
    SimulatedCycles,
    check_named,
    for_axes,
    periods,
    recording_file,
    share,
)
from edge_ident.cli.progress import shown_progress

if TYPE_CHECKING:
    from typing import Literal

    Motion = (
        Literal["sinusoid", "multisine", "staircase"] | edge_ident.Recording | edge_ident.Trajectory
    )

_NAMED_MOTIONS: Final[dict[str, "Literal['sinusoid', 'multisine', 'staircase']"]] = {
    "sinusoid": "sinusoid",
    "multisine": "multisine",
    "staircase": "staircase",
    "paper": "sinusoid",  # its first name here; scripts may still use it
}
ModelName = Annotated[
    str,
    typer.Option(
        "--model",
        metavar="FILE|full|reduced",
        envvar="EDGE_IDENT_MODEL",
        help="Model file, or the built-in drive: full has elastic parts, reduced is a rigid body.",
    ),
]


Stiff = Annotated[
    bool,
    typer.Option(
        "--stiff/--soft", help="stiff: gains designed for this drive; soft: weak start-up gains."
    ),
]


@dataclass(frozen=True, kw_only=True)
class MotionOptions(FileOptions):
    """The motion that the drive follows."""

    motion: Annotated[
        str,
        typer.Option(
            "--motion",
            metavar="sinusoid|multisine|staircase|FILE",
            envvar="EDGE_IDENT_MOTION",
            help="Named motion, a motion that plan wrote (.json), or a recording: its motion is "
            "followed at its own sampling rate.",
        ),
    ] = "sinusoid"
    cycles: SimulatedCycles = None

    def load(self) -> "Motion":
        """Return the name of the motion, or what the file holds."""
        periods(self.context, _NAMED_MOTIONS.get(self.motion, self.motion), self.cycles)
        if self.motion in _NAMED_MOTIONS:
            return _NAMED_MOTIONS[self.motion]
        check_named(self.motion)
        path = Path(self.motion)
        return edge_ident.load_motion(path) if path.suffix == ".json" else self.read(path)


@dataclass(frozen=True)
class MeasurementOptions:
    """What lies between the drive and its recording."""

    noise: Annotated[
        float,
        typer.Option(
            "--noise",
            parser=share,
            metavar="SHARE",
            help="White noise of the effort, relative to the rms effort, such as 5% or 0.05.",
        ),
    ] = 0.0
    encoder_counts: Annotated[
        float | None,
        typer.Option(
            "--encoder-counts",
            min=0.0,
            metavar="NUMBER",
            help="Encoder counts per turn or metre; 0 is exact; default: 8400 per turn or a "
            "million per metre.",
        ),
    ] = None
    effort_resolution: Annotated[
        float | None,
        typer.Option(
            "--effort-resolution",
            min=0.0,
            metavar="NUMBER",
            help="Effort of one count; 0 is exact; default: 0.004 N*m, exact in other units.",
        ),
    ] = None
    seed: Seed = 0


def register(app: typer.Typer) -> None:
    """Add this file's command."""
    app.command()(simulate)


@command
def simulate(
    *,
    output: RecordingOutput,
    model: ModelName = "full",
    motion: MotionOptions,
    measurement: MeasurementOptions,
    stiff: Stiff = False,
    json: Json = False,
) -> None:
    """Simulate a drive that follows a motion in closed loop, and write a recording of it.

    The recording is written to the file or folder given by --output. Its path is printed.

    Example: `edge-ident simulate --model model.json --motion multisine --noise 0.02 -o rec.csv`
    """
    output = recording_file(output)
    followed, seed = motion.load(), measurement.seed
    drive = _model(model)
    if drive is not None and isinstance(followed, edge_ident.Recording):
        drive = for_axes(drive, followed.axes, model)
    with shown_progress() as bars:
        bars.stage(f"simulating {model}")
        recording = edge_ident.simulate(
            drive, followed, cycles=motion.cycles, noise=measurement.noise, stiff=stiff, seed=seed,
            encoder_counts=measurement.encoder_counts,
            effort_resolution=measurement.effort_resolution, on_progress=bars.samples,
        )  # fmt: skip
    edge_ident.save_recording(recording, output)
    left = {} if drive is None else edge_ident.outside_support(drive, recording)
    for name, findings in left.items():
        for finding in findings:
            say(f"warning: axis {name}: {finding.message}")
    if json:
        print_document(
            report.simulation_document(recording, output, model, motion.motion, seed, left)
        )
    else:
        print(output)


def _model(name: str) -> "edge_ident.Model | None":
    """The built-in drive (None: with its elastic parts), or the model of a file."""
    if name == "full":
        return None
    return edge_ident.reduced_model() if name == "reduced" else edge_ident.load_model(name)
