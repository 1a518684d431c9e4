"""The command gains: designs from a recording, or has one of the verbs of board_gains."""

from typing import Annotated, Any, Final

import typer
from typer.core import TyperGroup

from edge_ident.cli import board_gains
from edge_ident.cli.common import (
    UNTRUSTED,
    DriveFile,
    Json,
    ModelFile,
    NetworkFile,
    Output,
    Precision,
    built_in_or_given_network,
    deliver,
    given_model,
    guarded,
)
from edge_ident.cli.files import Columns, RecordingFile, parse_renames
from edge_ident.errors import DataError

_HELP: Final = """Design gains from a recording (`gains FILE`), or look after those of a board.

Example: `edge-ident gains capture.npz --bandwidth 12`
"""


class _DesignUnlessVerb(TyperGroup):
    """What does not begin with a verb is for `design`: `gains FILE` is `gains design FILE`."""

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        if args and args[0] != "--help" and args[0] not in self.commands:
            args = ["design", *args]
        return super().parse_args(ctx, args)


def register(app: typer.Typer) -> None:
    """Add this file's command, a group of verbs."""
    group = typer.Typer(cls=_DesignUnlessVerb, no_args_is_help=True, rich_markup_mode="markdown")
    group.command()(design)
    board_gains.register(group)
    app.add_typer(group, name="gains", help=_HELP)


@guarded
def design(
    file: RecordingFile,
    column: Columns = None,
    drive: DriveFile = None,
    bandwidth: Annotated[
        float | None,
        typer.Option("--bandwidth", min=0.1, help="Closed loop, rad/s; default: the highest."),
    ] = None,
    control_delay: Annotated[
        float, typer.Option("--control-delay", min=0.0, help="Encoder latch to effort, seconds.")
    ] = 0.0005,
    network: NetworkFile = None,
    precision: Precision = "fp32",
    model: ModelFile = None,
    output: Output = None,
    json: Json = False,
) -> None:
    """Identify a recording and design controller gains; nothing is written to a board.

    Example: `edge-ident gains capture.npz --bandwidth 12`
    """
    from edge_ident.control.gain_design import design as design_axis
    from edge_ident.control.position_loop import LoopHardware
    from edge_ident.drive.description import load_drive
    from edge_ident.identification.identify import identify as identify_recording
    from edge_ident.report.documents import gains_document
    from edge_ident.report.tables import print_designs, print_identification
    from edge_ident.signals.recording_files import load_recording

    described = load_drive(drive)
    recording = load_recording(file, parse_renames(column))
    loaded = built_in_or_given_network(network, precision)
    found = identify_recording(recording, loaded, model=given_model(model))
    if not json:
        print_identification(found)
    if not found.trusted:
        deliver(gains_document(found, {}), "gains.json", output, json)
        raise typer.Exit(UNTRUSTED)
    designs = {}
    for name, axis in found.axes.items():
        if name not in described.axes:
            raise DataError(
                f"the drive description has no axis {name}", "describe it, or pass another --drive"
            )
        axis_description = described.axes[name]
        hardware = LoopHardware(
            described.sampling_period_s,
            control_delay,
            axis_description.encoder_resolution_rad,
            axis_description.effort_limit_nm,
        )
        designs[name] = design_axis(axis.model, hardware, bandwidth)
    deliver(gains_document(found, designs), "gains.json", output, json)
    if not json:
        print_designs(designs)
