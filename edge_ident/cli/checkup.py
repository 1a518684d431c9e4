"""Commands that check whether everything is in place: ports, doctor."""

from dataclasses import asdict

import typer

import edge_ident
from edge_ident import commissioning
from edge_ident.cli.command import UNTRUSTED, command
from edge_ident.cli.messages import say
from edge_ident.cli.options import BaudRate, BoardOptions, ResultOptions
from edge_ident.cli.progress import shown_progress
from edge_ident.cli.sessions import baud_rate_of, device_of


def register(app: typer.Typer) -> None:
    """Add this file's commands."""
    app.command()(ports)
    app.command()(doctor)


@command
def ports(*, baud_rate: BaudRate = None, results: ResultOptions) -> None:
    """List the serial ports, and which of them has a board.

    A few bytes are sent to every port. Unplug devices that must not receive them. The list is
    printed; with --output it is also written to ports.json in that folder.

    Example: `edge-ident ports --baud-rate 921600`
    """
    with shown_progress() as bars:
        bars.stage("trying ports")
        rate = baud_rate_of(BoardOptions(baud_rate=baud_rate), edge_ident.load_drive())
        found = commissioning.ask_ports(rate, bars.samples)
    document = {"schema": "edge-ident/ports/1", "ports": [asdict(port) for port in found]}
    results.deliver(document, "ports.json")
    if not found:
        say("no serial port found; use --device virtual, or start edge-ident board --pty")
    for port in found if not results.json else []:
        print(f"{port.device}\t{port.description}\t{port.hardware_id}\t{port.answer}")
        if port.next_step:
            say(f"  {port.device}, next: {port.next_step}")


@command
def doctor(*, where: BoardOptions, results: ResultOptions) -> None:
    """Check this computer and, with a device, the link to the board; say how to solve problems.

    The checks cover packages, networks, ModemManager, and access rights and latency timers of
    serial ports; with a device also register map, state, round-trip time, clock and jitter. No axis
    moves, and nothing is written to the board. The result is printed; with --output it is also
    written to doctor.json in that folder.

    Example: `edge-ident doctor --device /dev/ttyACM0`
    """
    drive = edge_ident.load_drive(where.drive)
    device = device_of(where, drive)
    checks = commissioning.check_host()
    if device is not None:
        with shown_progress() as bars:
            bars.stage("timing requests")
            rate = baud_rate_of(where, drive)
            checks += commissioning.check_link(device, rate, bars.samples)
    document = {"schema": "edge-ident/doctor/1", "checks": [asdict(check) for check in checks]}
    results.deliver(document, "doctor.json")
    for check in checks if not results.json else []:
        print(f"{'ok ' if check.good else 'BAD'}  {check.what}: {check.detail}")
        if not check.good:
            print(f"     next: {check.next_step}")
    if not all(check.good for check in checks):
        raise typer.Exit(UNTRUSTED)
