"""Commands that look at a board, or leave its machine at rest where it should be."""

import math
from dataclasses import asdict, replace
from pathlib import Path
from typing import Annotated, Final

import typer

import edge_ident
from edge_ident import commissioning, report
from edge_ident.cli.command import UNTRUSTED, command, noting, settings_command, tell_ignored
from edge_ident.cli.messages import say, shown_progress
from edge_ident.cli.options import BaudRate, BoardOptions, ResultOptions, Setting
from edge_ident.cli.sessions import baud_rate_of, connected, device_of, drive_or_built_in, located
from edge_ident.support.process import HANGUP, deaf_to_interrupts
from edge_ident.support.words import plain_number

_MAY_MOVE: Final = (
    "the machine may still be moving, or under effort: run edge-ident stop again, or use the "
    "wired emergency stop"
)


def register(app: typer.Typer) -> None:
    """Add this file's commands."""
    app.command()(ports)
    app.command()(doctor)
    app.command()(registers)
    app.command()(profile)
    app.command()(home)
    app.command()(hold)
    app.command()(stop)
    app.command("clear-fault")(clear_fault)


@command
def home(
    *,
    where: BoardOptions,
    to: list[str] | None = None,
    by: list[str] | None = None,
    speed: float | None = None,
    results: ResultOptions,
) -> None:
    """Move the axes slowly to position zero, to a position (--to) or by a distance (--by).

    The command does not search for a reference mark. Positions of an axis that is not homed count
    from where it stood when the board was switched on. The positions are printed with the distance
    that is left: where gains are weak, friction stops an axis short of its target. With --output
    they are also written to home.json in that folder. Exit code 1 means that an axis made less than
    half of the distance.

    Example: `edge-ident home --to x=1.5 --to z=-0.5 --device /dev/ttyACM0`

    Parameters
    ----------
    to : AXIS=RAD
        Move this axis to this position, in rad or, as in x=90deg, in degrees; may be repeated.
    by : AXIS=RAD
        Move this axis by this angle from where it stands, such as x=5deg; may be repeated.
    speed : NUMBER
        Highest speed in rad/s; default: a fifth of the speed limit.
    """
    if to and by:
        raise typer.BadParameter("give either --to or --by", param_hint="--by")
    targets, distances = _angles(to or [], "--to"), _angles(by or [], "--by")
    with connected(where) as (board, _), shown_progress() as bars:
        if distances:
            done = commissioning.homing.move_by(board, distances, bars, speed)
        else:
            zero = dict.fromkeys(board.axes, 0.0)
            done = commissioning.homing.move_to(board, targets or zero, bars, speed)
    lines = report.run_documents.home_lines(done)
    with noting(lines):
        results.deliver(report.run_documents.home_document(done), "home.json", *lines)
    for axis in done.stuck:
        say(
            f"axis {axis} made less than half of its way. Look whether it can move; where only "
            "friction holds it, a longer way or better gains move it"
        )
    if done.stuck:
        raise typer.Exit(UNTRUSTED)


def _angles(texts: list[str], option: str) -> dict[str, float]:
    """Parse texts of AXIS=RAD or AXIS=NUMBERdeg, in rad."""
    angles = {}
    for text in texts:
        axis, _, number = text.partition("=")
        degrees = number.endswith("deg")
        try:
            angle = plain_number(number.removesuffix("deg"))
        except ValueError:
            raise typer.BadParameter(
                f"{text}: write the axis and a number, such as x=1.57 (rad) or x=90deg",
                param_hint=option,
            ) from None
        if axis in angles:
            raise typer.BadParameter(f"{axis} is named twice", param_hint=option)
        angles[axis] = math.radians(angle) if degrees else angle
    return angles


@command
def hold(
    *,
    where: BoardOptions,
    seconds: Annotated[float, typer.Option(min=1.0, max=600.0)] = 10.0,
    results: ResultOptions,
) -> None:
    """Hold the axes where they stand, with the effort on, so that you can push against them.

    The command prints how far each axis was pushed, and the largest effort; with --output, also to
    hold.json. The effort is switched off at the end and on Ctrl-C.

    Example: `edge-ident hold --seconds 20 --device /dev/ttyACM0`

    Parameters
    ----------
    seconds : NUMBER
        Time to hold, in s.
    """
    with connected(where) as (board, _), shown_progress() as bars:
        held = commissioning.homing.hold(board, seconds, bars)
    results.deliver(report.run_documents.hold_document(held), "hold.json")
    for axis, one in held.items() if not results.json else []:
        pushed_rad = round(one.pushed_rad, 4) + 0.0  # no negative zero
        print(f"{axis}: pushed by up to {pushed_rad:.4f} rad, effort {one.effort_nm:.2f} N*m")


@settings_command
def stop(*, context: typer.Context, where: BoardOptions, results: ResultOptions) -> None:
    """Bring the machine to rest and switch the effort off. This is not an emergency stop.

    Unconfirmed gains are rolled back. Control is taken from any other host, whose command then
    ends; a command of the same user on this computer is interrupted as by Ctrl-C. The command fails
    if the effort stays on, or if another host keeps the board. Invalid settings are reported and
    ignored. Closing the terminal does not end the command; Ctrl-C does, and the machine may then
    still be moving. With --output, the state of the board is also written to state.json.

    Example: `edge-ident stop --device /dev/ttyACM0`
    """
    tell_ignored(context.find_root().obj.settings_errors)
    try:
        with deaf_to_interrupts(HANGUP):
            address = located(_with_readable_drive(context, where))
            status = commissioning.safety.stop_machine(address.device, address.baud_rate, say)
    except KeyboardInterrupt as interruption:
        interruption.add_note(_MAY_MOVE)
        raise
    _report_state(status, results)


def _with_readable_drive(context: typer.Context, where: BoardOptions) -> BoardOptions:
    """The board to stop, without an unreadable drive description that is not needed to find it."""
    _, error = drive_or_built_in(where.drive)
    source = context.get_parameter_source("drive")
    set_once = source is not None and source.name == "DEFAULT_MAP"
    if error is None or not (where.device or set_once):
        return where
    tell_ignored([error])
    return replace(where, drive=None)


@command
def clear_fault(*, where: BoardOptions, results: ResultOptions) -> None:
    """Clear a latched fault after its cause is removed and the machine is at rest.

    With --output, the state of the board is also written to state.json.

    Example: `edge-ident clear-fault --device /dev/ttyACM0`
    """
    with connected(where) as (board, _):
        commissioning.safety.clear_fault(board, say)
        _report_state(board.status(), results)


def _report_state(status: "commissioning.board.BoardStatus", results: ResultOptions) -> None:
    state = status.state.name
    document = {"schema": "edge-ident/state/1", "state": state, "enabled": status.enabled}
    with noting([f"the board is {state}, its effort is {'on' if status.enabled else 'off'}"]):
        results.deliver(document, "state.json", state)


# Commands that check whether everything is in place: ports, doctor.


@command
def ports(*, baud_rate: BaudRate = None, results: ResultOptions) -> None:
    """List the serial ports, and which of them has a board.

    A few bytes are sent to every port. Unplug devices that must not receive them. With --output,
    the list is also written to ports.json.

    Example: `edge-ident ports --baud-rate 921600`
    """
    with shown_progress() as bars:
        bars.stage("trying ports")
        rate = baud_rate_of(BoardOptions(baud_rate=baud_rate), edge_ident.load_drive())
        found = commissioning.ports.ask_ports(rate, bars.samples)
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
    moves, and nothing is written to the board. With --output, the result is also written to
    doctor.json.

    Example: `edge-ident doctor --device /dev/ttyACM0`
    """
    drive = edge_ident.load_drive(where.drive)
    device = device_of(where, drive)
    checks = commissioning.doctor.check_host()
    if device is not None:
        with shown_progress() as bars:
            bars.stage("timing requests")
            rate = baud_rate_of(where, drive)
            checks += commissioning.doctor.check_link(device, rate, bars.samples)
    document = {"schema": "edge-ident/doctor/1", "checks": [asdict(check) for check in checks]}
    results.deliver(document, "doctor.json")
    for check in checks if not results.json else []:
        print(f"{'ok ' if check.good else 'BAD'}  {check.what}: {check.detail}")
        if not check.good:
            print(f"     next: {check.next_step}")
    if not all(check.good for check in checks):
        raise typer.Exit(UNTRUSTED)


# The command registers: the map, and single registers of a board.


@command
def registers(
    *,
    name: Annotated[str | None, typer.Argument()] = None,
    write: list[str] | None = None,
    yes: bool = False,
    where: BoardOptions,
    results: ResultOptions,
) -> None:
    """Print the register map or, with a device, the values on the board; write a register.

    A value is written only if it is within the range of the register and the board is idle. It is
    read back. With --output, the registers are also written to registers.json.

    Example: `edge-ident registers watchdog.timeout --write 0.5 --yes --device /dev/ttyACM0`

    Parameters
    ----------
    name : NAME
        A register, or a group of registers such as limits.x.
    write : VALUE
        Value to write, in the unit of the register; repeat for an array.
    yes
        Required to confirm a write.
    """
    chosen = commissioning.register_access.registers_named(name)
    if not chosen:
        raise typer.BadParameter(
            f"there is no register or group {name}; edge-ident registers lists all",
            param_hint="NAME",
        )
    values: dict[str, tuple[float, ...]] = {}
    version = commissioning.registers.MAP_VERSION
    if write is not None or device_of(where, edge_ident.load_drive(where.drive)):
        with connected(where) as (board, _):
            version = board.identity.map_version
            chosen = commissioning.register_access.registers_of(board, chosen)
            if write is not None:
                _write(board, name, write, yes)
            values = {entry.name: board.register_values(entry.name) for entry in chosen}
    with noting([] if write is None else [f"{name} is written"]):
        document = report.machine.registers_document(chosen, values, version)
        lines = report.machine.register_lines(chosen, values, version)
        results.deliver(document, "registers.json", *lines)


def _write(board: "edge_ident.Board", name: str | None, texts: list[str], yes: bool) -> None:
    target = commissioning.registers.REGISTERS.get(name or "")
    if target is None:
        raise typer.BadParameter("give the name of one register to write", param_hint="NAME")
    try:
        values = commissioning.register_access.parse_values(target, texts)
    except ValueError as error:
        raise typer.BadParameter(str(error), param_hint="--write") from error
    commissioning.register_access.check_write(target, values)
    if not yes:
        now, then = map(report.machine.values_text, (board.register_values(target.name), values))
        raise typer.BadParameter(
            f"{target.name} would change from {now} to {then} {target.unit}; nothing was written: "
            "add --yes to write it",
            param_hint="--write",
        )
    commissioning.register_access.write_register(board, target, values)


# The command profile: where the time goes.


@command
def profile(
    *,
    device: str | None = None,
    baud_rate: BaudRate = None,
    drive: Setting[Path | None] = None,
    repetitions: Annotated[int, typer.Option(min=1)] = 100,
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

    Parameters
    ----------
    device : DEVICE
        Board to measure; its axes move. A port such as /dev/ttyACM0, a pySerial URL,
        tcp://HOST:PORT, or virtual. Default: virtual; EDGE_IDENT_DEVICE and the settings file do
        not count here.
    repetitions : NUMBER
        Repetitions of each measurement; those that need a motion are repeated five times at most.
        100 repetitions take several minutes.
    """
    folder = results.folder()
    described = edge_ident.load_drive(drive)
    if device is None:
        say("measuring a virtual board; to move and measure a machine, name it with --device")
    rate = baud_rate_of(BoardOptions(device, baud_rate, drive), described)
    with shown_progress() as bars:
        profiled = commissioning.latency.profile_device(device, rate, described, repetitions, bars)
    if folder:
        report.machine.save_waterfall(profiled, folder / "profile.svg")
    results.deliver(report.run_documents.profile_document(profiled), "profile.json")
    results.show(report.machine.profile_view(profiled))
