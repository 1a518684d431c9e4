"""The command board: a virtual board to connect to."""

from typing import Annotated

import typer

from edge_ident import commissioning
from edge_ident.cli.command import command
from edge_ident.cli.messages import say
from edge_ident.cli.options import ResultOptions

Pty = Annotated[
    bool, typer.Option("--pty", help="Offer the board at a pseudo-terminal, like a serial port.")
]
TcpPort = Annotated[
    int | None,
    typer.Option(
        "--tcp",
        metavar="PORT",
        min=0,
        max=65535,
        help="Offer the board over Modbus TCP at this port.",
    ),
]
Address = Annotated[
    str,
    typer.Option("--bind", metavar="ADDRESS", help="Network address of this computer for --tcp."),
]
Speed = Annotated[
    str,
    typer.Option(
        "--speed",
        envvar="EDGE_IDENT_SPEED",
        metavar="FACTOR",
        help="Speed of time in the board: a factor of real time, or max for as fast as possible.",
    ),
]


def register(app: typer.Typer) -> None:
    """Add this file's command."""
    app.command()(board)


@command
def board(
    *,
    pty: Pty = False,
    tcp: TcpPort = None,
    bind: Address = "127.0.0.1",
    speed: Speed = "1",
    results: ResultOptions,
) -> None:
    """Run a virtual board with a flexible feed drive until Ctrl-C.

    Modbus has no authentication: anyone who can connect to the port controls the board. Only this
    computer can connect unless --bind gives another address. The name of the device is printed;
    with --output it is also written to board.json in that folder.

    Example: `edge-ident board --pty --speed 10`
    """
    if pty == (tcp is not None):
        raise typer.BadParameter("give either --pty or --tcp PORT")

    def ready(device: str) -> None:
        results.deliver({"schema": "edge-ident/board/1", "device": device}, "board.json")
        if not results.json:
            print(device, flush=True)
        say(f"ready; connect with: edge-ident run --device {device}   (Ctrl-C to end)")

    if tcp is not None:
        say("Modbus has no authentication: anyone who can connect to this port controls the board")
    commissioning.serve(pty=pty, tcp_port=tcp, bind=bind, speed=_parse_speed(speed), on_ready=ready)


def _parse_speed(text: str) -> float | None:
    """Parse a factor of real time; None stands for max."""
    if text == "max":
        return None
    try:
        speed = float(text)
    except ValueError:
        speed = 0.0
    if not 0.01 <= speed <= 100.0:
        raise typer.BadParameter("give a number from 0.01 to 100, or max", param_hint="--speed")
    return speed
