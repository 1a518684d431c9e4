"""The command plant: the virtual drive alone, for firmware that runs elsewhere."""

from pathlib import Path
from typing import Annotated

import typer

from edge_ident import commissioning
from edge_ident.cli.command import command
from edge_ident.cli.hiding import HideOptions
from edge_ident.cli.messages import say
from edge_ident.cli.options import ResultOptions

Socket = Annotated[
    Path | None,
    typer.Option(
        "--socket", metavar="PATH", help="Unix socket to serve the drive at; it is created."
    ),
]


def register(app: typer.Typer) -> None:
    """Add this file's command."""
    app.command()(plant)


@command
def plant(*, socket: Socket = None, faults: HideOptions, results: ResultOptions) -> None:
    """Serve the virtual drive without a board, for firmware to control, until Ctrl-C.

    The reference firmware connects to it with its option --plant PATH. Every connection gets a new
    drive at rest. The path is printed; with --output it is also written to plant.json in that
    folder. With --reveal, what the same options hide is printed, and no drive is served.

    Example: `edge-ident plant --socket ./drive --hide backlash`
    """
    hidden = faults.hidden(of_machine=True)
    if faults.reveal:
        faults.tell_alone("plant", {"socket": None}, hidden, results)
        return
    if socket is None:
        raise typer.BadParameter("give --socket PATH")

    def ready(path: str) -> None:
        results.deliver({"schema": "edge-ident/plant/1", "socket": path}, "plant.json")
        if not results.json:
            print(path, flush=True)
        say(f"ready; start the firmware with: --plant {path}   (Ctrl-C to end)")

    known = hidden or commissioning.Hidden((), ())
    commissioning.serve_plant(socket, known.plant, ready)
