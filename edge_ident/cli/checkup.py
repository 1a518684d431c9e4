"""Commands that look whether all is in place: ports, doctor."""

from dataclasses import asdict

import typer

from edge_ident.cli.common import (
    UNTRUSTED,
    BaudRate,
    Device,
    DriveFile,
    Json,
    Output,
    deliver,
    guarded,
    say,
    shown_progress,
)


def register(app: typer.Typer) -> None:
    """Add this file's commands."""
    app.command()(ports)
    app.command()(doctor)


@guarded
def ports(baud_rate: BaudRate = None, output: Output = None, json: Json = False) -> None:
    """List serial ports with what answered when each was asked for a board's identity.

    A few bytes go out at every port; close those of devices that must not see them.

    Example: `edge-ident ports --baud-rate 921600`
    """
    from edge_ident.commissioning.ports import ask_ports
    from firmware_interface.connection import DEFAULT_BAUD_RATE

    with shown_progress() as observer:
        observer.stage("asking ports")
        found = ask_ports(baud_rate or DEFAULT_BAUD_RATE, observer.samples)
    document = {"schema": "edge-ident/ports/1", "ports": [asdict(port) for port in found]}
    deliver(document, "ports.json", output, json)
    if not found:
        say("no serial port found; try --device virtual, or edge-ident board --pty")
    for port in found if not json else []:
        print(f"{port.device}\t{port.description}\t{port.hardware_id}\t{port.answer}")
        if port.next_step:
            say(f"  {port.device}, next: {port.next_step}")


@guarded
def doctor(
    device: Device = None,
    baud_rate: BaudRate = None,
    drive: DriveFile = None,
    output: Output = None,
    json: Json = False,
) -> None:
    """Check this machine and, with --device, the link to a board; each trouble with its remedy.

    Packages, networks, ModemManager, rights and latency timers of ports; then register map,
    state, round-trip time, clock and jitter. Nothing is moved or written.

    Example: `edge-ident doctor --device /dev/ttyACM0`
    """
    from edge_ident.commissioning.doctor import check_host
    from edge_ident.commissioning.link_checks import check_link
    from edge_ident.drive.description import load_drive
    from firmware_interface.connection import DEFAULT_BAUD_RATE

    described = load_drive(drive)
    url = device or described.device
    checks = check_host()
    if url is not None:
        with shown_progress() as observer:
            observer.stage("timing requests")
            rate = baud_rate or described.baud_rate or DEFAULT_BAUD_RATE
            checks += check_link(url, rate, observer.samples)
    document = {"schema": "edge-ident/doctor/1", "checks": [asdict(check) for check in checks]}
    deliver(document, "doctor.json", output, json)
    for check in checks if not json else []:
        print(f"{'ok ' if check.good else 'BAD'}  {check.what}: {check.detail}")
        if not check.good:
            print(f"     next: {check.next_step}")
    if not all(check.good for check in checks):
        raise typer.Exit(UNTRUSTED)
