"""The command board: a virtual one to connect to."""

from typing import Annotated

import typer

from edge_ident.cli.common import Json, Output, deliver, guarded, say

Speed = Annotated[
    str,
    typer.Option(
        "--speed",
        envvar="EDGE_IDENT_SPEED",
        help="Times real time, or max: time passes as fast as the host asks.",
    ),
]


def register(app: typer.Typer) -> None:
    """Add this file's command."""
    app.command()(board)


@guarded
def board(
    pty: Annotated[bool, typer.Option("--pty", help="Serve on a pseudo-terminal.")] = False,
    tcp: Annotated[
        int | None,
        typer.Option("--tcp", metavar="PORT", min=0, max=65535, help="Serve Modbus TCP."),
    ] = None,
    bind: Annotated[
        str,
        typer.Option("--bind", metavar="ADDRESS", help="Of this host, for --tcp."),
    ] = "127.0.0.1",
    speed: Speed = "1",
    output: Output = None,
    json: Json = False,
) -> None:
    """Serve a virtual board with a flexible feed drive behind it, until Ctrl-C.

    Modbus has no authentication: whoever reaches the port commands the board. TCP is bound to
    this host alone unless --bind says otherwise.

    Example: `edge-ident board --pty --speed 10`
    """
    from firmware_interface.virtual.server import serve

    if pty == (tcp is not None):
        raise typer.BadParameter("choose one of --pty and --tcp PORT")

    def ready(device: str) -> None:
        deliver({"schema": "edge-ident/board/1", "device": device}, "board.json", output, json)
        if not json:
            print(device, flush=True)
        say(f"serving; connect with: edge-ident run --device {device}   (Ctrl-C ends)")

    if tcp is not None:
        say("Modbus has no authentication: whoever reaches this port commands the board")
    serve(pty=pty, tcp_port=tcp, bind=bind, speed=_parse_speed(speed), on_ready=ready)


def _parse_speed(text: str) -> float | None:
    """Factor of real time; None stands for max."""
    if text == "max":
        return None
    try:
        speed = float(text)
    except ValueError:
        speed = 0.0
    if not 0.01 <= speed <= 100.0:
        raise typer.BadParameter("give a number from 0.01 to 100, or max", param_hint="--speed")
    return speed
