"""Commands about boards: board (the virtual one), ports, registers, doctor."""

from dataclasses import asdict
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
    """Add this file's commands."""
    app.command()(board)
    app.command()(ports)
    app.command()(registers)
    app.command()(doctor)


@guarded
def board(
    pty: Annotated[bool, typer.Option("--pty", help="Serve on a pseudo-terminal.")] = False,
    tcp: Annotated[
        int | None,
        typer.Option(
            "--tcp", metavar="PORT", min=0, max=65535, help="Serve Modbus TCP on 127.0.0.1."
        ),
    ] = None,
    speed: Speed = "1",
    output: Output = None,
    json: Json = False,
) -> None:
    """Serve a virtual board with a flexible feed drive behind it, until Ctrl-C.

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

    serve(pty=pty, tcp_port=tcp, speed=_parse_speed(speed), on_ready=ready)


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


@guarded
def ports(output: Output = None, json: Json = False) -> None:
    """List serial ports that a board may be on.

    Example: `edge-ident ports`
    """
    from serial.tools import list_ports

    found = [
        {"device": port.device, "description": port.description, "hardware_id": port.hwid}
        for port in sorted(list_ports.comports())
    ]
    deliver({"schema": "edge-ident/ports/1", "ports": found}, "ports.json", output, json)
    if not found:
        say("no serial port found; try --device virtual, or edge-ident board --pty")
    for port in found if not json else []:
        print(f"{port['device']}\t{port['description']}\t{port['hardware_id']}")


@guarded
def registers(output: Output = None, json: Json = False) -> None:
    """Print the register map that host and board share.

    Example: `edge-ident registers | less`
    """
    from firmware_interface.registers import MAP_CRC, MAP_VERSION, REGISTERS

    rows = [
        {
            "name": register.name,
            "address": register.address,
            "type": register.type,
            "unit": register.unit,
            "access": register.access,
            "description": register.description,
        }
        for register in REGISTERS.values()
    ]
    document = {
        "schema": "edge-ident/registers/1",
        "map_version": MAP_VERSION,
        "map_crc": MAP_CRC,
        "registers": rows,
    }
    deliver(document, "registers.json", output, json)
    if not json:
        print(f"map version {MAP_VERSION}, CRC {MAP_CRC:08x}")
    for row in rows if not json else []:
        print("\t".join(str(value) for value in row.values()))


@guarded
def doctor(output: Output = None, json: Json = False) -> None:
    """Check this machine: packages, the built-in networks, serial ports and rights to them.

    Example: `edge-ident doctor`
    """
    from edge_ident.doctor import examine

    checks = examine()
    document = {"schema": "edge-ident/doctor/1", "checks": [asdict(check) for check in checks]}
    deliver(document, "doctor.json", output, json)
    for check in checks if not json else []:
        print(f"{'ok ' if check.good else 'BAD'}  {check.what}: {check.detail}")
        if not check.good:
            print(f"     next: {check.next_step}")
    if not all(check.good for check in checks):
        raise typer.Exit(1)
