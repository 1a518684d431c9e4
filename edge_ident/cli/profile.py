"""The command profile: where the time goes."""

from typing import Annotated

import typer

import edge_ident
from edge_ident import commissioning, report
from edge_ident.cli.command import command
from edge_ident.cli.options import BaudRate, BoardOptions, Device, ResultOptions
from edge_ident.cli.progress import shown_progress
from edge_ident.cli.sessions import baud_rate_of, device_of

Repetitions = Annotated[
    int,
    typer.Option(
        "--repetitions",
        min=1,
        metavar="NUMBER",
        help="Repetitions of every measurement; of those that need a motion, at most five.",
    ),
]


def register(app: typer.Typer) -> None:
    """Add this file's command."""
    app.command()(profile)


@command
def profile(
    *,
    device: Device = None,
    baud_rate: BaudRate = None,
    repetitions: Repetitions = 100,
    results: ResultOptions,
) -> None:
    """Measure how long each stage takes, from the last captured sample to verified gains.

    Without a device, a virtual board is started. The result is printed, with a bar for each stage
    where it stands in the whole. With --output it is also written to profile.json in that folder,
    and drawn as profile.svg.

    Example: `edge-ident profile --repetitions 200 --json`
    """
    given = BoardOptions(device, baud_rate)
    drive = edge_ident.load_drive()
    with shown_progress() as bars:
        profiled = commissioning.profile_device(
            device_of(given, drive), baud_rate_of(given, drive), repetitions, bars
        )
    if results.output:
        report.save_waterfall(profiled, results.output / "profile.svg")
    results.deliver(report.profile_document(profiled), "profile.json")
    results.show(report.profile_view(profiled))
