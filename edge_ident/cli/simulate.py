"""The command simulate: from a model to a recording."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Final

import typer

from edge_ident.cli.common import Json, guarded, print_document, shown_progress
from edge_ident.cli.files import Columns, parse_renames

if TYPE_CHECKING:
    from edge_ident.drive.motions import MotionName
    from edge_ident.model.model import Model
    from edge_ident.simulation.references import References

_NAMED_MOTIONS: Final[dict[str, "MotionName"]] = {
    "paper": "sinusoid",
    "sinusoid": "sinusoid",
    "multisine": "multisine",
    "staircase": "staircase",
}
_SUFFIXES: Final = (".csv", ".npz")


def register(app: typer.Typer) -> None:
    """Add this file's command."""
    app.command()(simulate)


@guarded
def simulate(
    output: Annotated[
        Path, typer.Option("--output", "-o", metavar="REC", help="Recording, .csv or .npz.")
    ],
    model: Annotated[
        str,
        typer.Option(
            "--model",
            metavar="FILE|full|reduced",
            envvar="EDGE_IDENT_MODEL",
            help="Model file, or the built-in drive: flexible, or its rigid-body model.",
        ),
    ] = "full",
    motion: Annotated[
        str,
        typer.Option(
            "--motion",
            metavar="paper|multisine|staircase|FILE",
            envvar="EDGE_IDENT_MOTION",
            help="Named motion, or a recording whose motion is followed at its own sampling.",
        ),
    ] = "paper",
    column: Columns = None,
    cycles: Annotated[
        int | None, typer.Option("--cycles", min=1, help="Periods of a paper or multisine motion.")
    ] = None,
    noise: Annotated[
        float, typer.Option("--noise", min=0.0, help="White effort noise over the rms effort.")
    ] = 0.0,
    encoder_counts: Annotated[
        float | None,
        typer.Option(
            "--encoder-counts",
            min=0.0,
            help="Per turn or metre, 0: exact; default: 8400, or a million per metre.",
        ),
    ] = None,
    effort_resolution: Annotated[
        float | None,
        typer.Option(
            "--effort-resolution", min=0.0, help="Of one count, 0: exact; default: 0.004 N*m."
        ),
    ] = None,
    stiff: Annotated[
        bool,
        typer.Option("--stiff/--soft", help="Gains designed for the drive, or start-up gains."),
    ] = False,
    seed: Annotated[
        int, typer.Option("--seed", envvar="EDGE_IDENT_SEED", help="Of the noise.")
    ] = 0,
    json: Json = False,
) -> None:
    """Let a model's drive follow a motion in closed loop, and record it like a board.

    Example: `edge-ident simulate --model model.json --motion multisine --noise 0.02 -o rec.csv`
    """
    from edge_ident.report.documents import simulation_document
    from edge_ident.signals.recording_files import save_recording
    from edge_ident.simulation.scenario import Scenario, record

    if output.suffix not in _SUFFIXES:
        raise typer.BadParameter(f"end it in {' or '.join(_SUFFIXES)}", param_hint="--output")
    loaded = _model(model)
    scenario = Scenario(
        _references(loaded, motion, column, cycles),
        encoder_counts, effort_resolution, noise, stiff, seed,
    )  # fmt: skip
    with shown_progress() as observer:
        observer.stage(f"simulating {model}")
        recording = record(
            loaded, scenario, f"simulation of {model}",
            flexible=model == "full", on_progress=observer.samples,
        )  # fmt: skip
    save_recording(recording, output)
    if json:
        print_document(simulation_document(recording, output, model, motion, seed))
    else:
        print(output)


def _model(model: str) -> "Model":
    """The built-in drive, or what a file holds."""
    if model in ("full", "reduced"):
        from edge_ident.simulation.flexible import reduced_model

        return reduced_model()
    from edge_ident.model.model_files import load_model

    return load_model(Path(model))


def _references(
    model: "Model", motion: str, column: list[str] | None, cycles: int | None
) -> "References":
    """The named motion, or that of a recording."""
    from edge_ident.signals.recording_files import load_recording
    from edge_ident.simulation.references import named_references, recorded_references

    units = {name: axis.position_unit for name, axis in model.axes.items()}
    if cycles is not None and motion not in ("paper", "sinusoid", "multisine"):
        raise typer.BadParameter(f"{motion} has no periods to count", param_hint="--cycles")
    if motion in _NAMED_MOTIONS:
        return named_references(units, _NAMED_MOTIONS[motion], cycles)
    return recorded_references(load_recording(Path(motion), parse_renames(column)), units)
