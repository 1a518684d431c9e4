"""Commands that look at a board: ports, doctor, registers, profile."""

from dataclasses import asdict
from typing import TYPE_CHECKING, Annotated

import typer

import edge_ident
from edge_ident import commissioning, report
from edge_ident.cli.command import UNTRUSTED, command, noting
from edge_ident.cli.messages import say
from edge_ident.cli.options import BaudRate, BoardOptions, DriveFile, ResultOptions
from edge_ident.cli.progress import shown_progress
from edge_ident.cli.sessions import baud_rate_of, connected, device_of

if TYPE_CHECKING:
    from edge_ident import Board


# Commands that check whether everything is in place: ports, doctor.


def register(app: typer.Typer) -> None:
    """Add this file's commands."""
    app.command()(ports)
    app.command()(doctor)
    app.command()(registers)
    app.command()(profile)


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


# The command registers: the map, and single registers of a board.

RegisterName = Annotated[
    str | None,
    typer.Argument(metavar="NAME", help="A register, or a group of registers such as limits.x."),
]
NewValues = Annotated[
    list[str] | None,
    typer.Option(
        "--write",
        metavar="VALUE",
        help="Value to write, in the unit of the register; repeat for an array.",
    ),
]
Yes = Annotated[bool, typer.Option("--yes", help="Required to confirm a write.")]


@command
def registers(
    *,
    name: RegisterName = None,
    write: NewValues = None,
    yes: Yes = False,
    where: BoardOptions,
    results: ResultOptions,
) -> None:
    """Print the register map or, with a device, the values on the board; write a register.

    A value is written only if it is within the range of the register and the board is idle. It is
    read back. The registers are printed; with --output they are also written to registers.json.

    Example: `edge-ident registers watchdog.timeout --write 0.5 --yes --device /dev/ttyACM0`
    """
    chosen = commissioning.registers_named(name)
    if not chosen:
        raise typer.BadParameter(
            f"there is no register or group {name}; edge-ident registers lists all",
            param_hint="NAME",
        )
    values: dict[str, tuple[float, ...]] = {}
    version = commissioning.MAP_VERSION
    if write is not None or device_of(where, edge_ident.load_drive(where.drive)):
        with connected(where) as (board, _):
            version = board.identity.map_version
            chosen = commissioning.registers_of(board, chosen)
            if write is not None:
                _write(board, name, write, yes)
            values = {entry.name: board.register_values(entry.name) for entry in chosen}
    with noting([] if write is None else [f"{name} is written"]):
        results.deliver(report.registers_document(chosen, values, version), "registers.json")
        if not results.json:
            print("\n".join(report.register_lines(chosen, values, version)), flush=True)


def _write(board: "Board", name: str | None, texts: list[str], yes: bool) -> None:
    target = commissioning.REGISTERS.get(name or "")
    if target is None:
        raise typer.BadParameter("give the name of one register to write", param_hint="NAME")
    try:
        values = commissioning.parse_values(target, texts)
    except ValueError as error:
        raise typer.BadParameter(str(error), param_hint="--write") from error
    commissioning.check_write(target, values)
    if not yes:
        now = report.values_text(board.register_values(target.name))
        raise typer.BadParameter(
            f"{target.name} would change from {now} to {report.values_text(values)} {target.unit}; "
            "nothing was written: add --yes to write it",
            param_hint="--write",
        )
    commissioning.write_register(board, target, values)


# The command profile: where the time goes.

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
