"""The command profile: where the time goes."""

from typing import Annotated

import typer

import edge_ident
from edge_ident import commissioning, report
from edge_ident.cli.command import command
from edge_ident.cli.messages import say
from edge_ident.cli.options import BaudRate, BoardOptions, DriveFile, ResultOptions
from edge_ident.cli.progress import shown_progress
from edge_ident.cli.sessions import baud_rate_of

MovedDevice = Annotated[
    str | None,
    typer.Option(
        "--device",
        metavar="DEVICE",
        help="Board to measure; its axes move. A port such as /dev/ttyACM0, a pySerial "
        "URL, tcp://HOST:PORT, or virtual. Default: virtual; EDGE_IDENT_DEVICE and "
        "the settings file do not count here.",
    ),
]
Repetitions = Annotated[
    int,
    typer.Option(
        "--repetitions",
        min=1,
        metavar="NUMBER",
        help="Repetitions of each measurement; those that need a motion are repeated five "
        "times at most. 100 repetitions take several minutes.",
    ),
]


def register(app: typer.Typer) -> None:
    """Add this file's command."""
    app.command()(profile)


@command
def profile(
    *,
    device: MovedDevice = None,
    baud_rate: BaudRate = None,
    drive: DriveFile = None,
    repetitions: Repetitions = 100,
    results: ResultOptions,
) -> None:
    """Measure how long each stage takes, from the last captured sample to verified gains.

    By default a virtual board is measured. With --device, your board is: its axes move with the
    effort on, once along the sinusoid of the drive description, then up to ten times along its
    first second. The active gains are committed and rolled back repeatedly; at the end, gains that
    were staged before are staged again. The result is printed, with a bar that shows when each
    stage runs. With --output it is also written to profile.json in that folder, and drawn as
    profile.svg.

    Example: `edge-ident profile --repetitions 200 --json`

    Example: `edge-ident profile --device /dev/ttyACM0 --drive press.toml`
    """
    folder = results.folder()
    described = edge_ident.load_drive(drive)
    if device is None:
        say("measuring a virtual board; to move and measure a machine, name it with --device")
    rate = baud_rate_of(BoardOptions(device, baud_rate, drive), described)
    with shown_progress() as bars:
        profiled = commissioning.profile_device(device, rate, described, repetitions, bars)
    if folder:
        report.save_waterfall(profiled, folder / "profile.svg")
    results.deliver(report.profile_document(profiled), "profile.json")
    results.show(report.profile_view(profiled))
