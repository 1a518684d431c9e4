"""Commands that leave the machine at rest where it should be: home, hold, stop, clear-fault."""

import math
from dataclasses import replace
from typing import TYPE_CHECKING, Annotated, Final

import typer

from edge_ident import commissioning, report
from edge_ident.cli.command import UNTRUSTED, command, noting, settings_command, tell_ignored
from edge_ident.cli.messages import say
from edge_ident.cli.options import BoardOptions, ResultOptions
from edge_ident.cli.progress import shown_progress
from edge_ident.cli.sessions import connected, drive_or_built_in, located
from edge_ident.support.interrupts import HANGUP, deaf_to_interrupts

if TYPE_CHECKING:
    from edge_ident.commissioning import BoardStatus

_MAY_MOVE: Final = (
    "the machine may still be moving, or under effort: run edge-ident stop again, or use the "
    "wired emergency stop"
)

Targets = Annotated[
    list[str] | None,
    typer.Option(
        "--to",
        metavar="AXIS=RAD",
        help="Move this axis to this position, in rad or, as in x=90deg, in degrees; "
        "may be repeated.",
    ),
]
Distances = Annotated[
    list[str] | None,
    typer.Option(
        "--by",
        metavar="AXIS=RAD",
        help="Move this axis by this angle from where it stands, such as x=5deg; may be repeated.",
    ),
]
Duration = Annotated[
    float,
    typer.Option("--seconds", min=1.0, max=600.0, metavar="NUMBER", help="Time to hold, in s."),
]
Speed = Annotated[
    float | None,
    typer.Option(
        "--speed",
        metavar="NUMBER",
        help="Highest speed in rad/s; default: a fifth of the speed limit.",
    ),
]


def register(app: typer.Typer) -> None:
    """Add this file's commands."""
    app.command()(home)
    app.command()(hold)
    app.command()(stop)
    app.command("clear-fault")(clear_fault)


@command
def home(
    *,
    where: BoardOptions,
    to: Targets = None,
    by: Distances = None,
    speed: Speed = None,
    results: ResultOptions,
) -> None:
    """Move the axes slowly to position zero, to a position (--to) or by a distance (--by).

    The command does not search for a reference mark. Positions of an axis that is not homed count
    from where it stood when the board was switched on. The positions are printed with the distance
    that is left: where gains are weak, friction stops an axis short of its target. With --output
    they are also written to home.json in that folder. Exit code 1 means that an axis made less than
    half of the distance.

    Example: `edge-ident home --to x=1.5 --to z=-0.5 --device /dev/ttyACM0`
    """
    if to and by:
        raise typer.BadParameter("give either --to or --by", param_hint="--by")
    targets, distances = _angles(to or [], "--to"), _angles(by or [], "--by")
    with connected(where) as (board, _), shown_progress() as bars:
        if distances:
            done = commissioning.move_by(board, distances, bars, speed)
        else:
            zero = dict.fromkeys(board.axes, 0.0)
            done = commissioning.move_to(board, targets or zero, bars, speed)
    lines = report.home_lines(done)
    with noting(lines):
        results.deliver(report.home_document(done), "home.json")
        if not results.json:
            print("\n".join(lines), flush=True)
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
            angle = commissioning.plain_number(number.removesuffix("deg"))
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
def hold(*, where: BoardOptions, seconds: Duration = 10.0, results: ResultOptions) -> None:
    """Hold the axes where they stand, with the effort on, so that you can push against them.

    How far each axis was pushed and the largest effort are printed; with --output they are also
    written to hold.json in that folder. The effort is switched off at the end and on Ctrl-C.

    Example: `edge-ident hold --seconds 20 --device /dev/ttyACM0`
    """
    with connected(where) as (board, _), shown_progress() as bars:
        held = commissioning.hold(board, seconds, bars)
    results.deliver(report.hold_document(held), "hold.json")
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
    still be moving. The state of the board is printed; with --output it is also written to
    state.json.

    Example: `edge-ident stop --device /dev/ttyACM0`
    """
    tell_ignored(context.find_root().obj.settings_errors)
    try:
        with deaf_to_interrupts(HANGUP):
            address = located(_with_readable_drive(context, where))
            status = commissioning.stop_machine(address.device, address.baud_rate, say)
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

    The state of the board is printed; with --output it is also written to state.json.

    Example: `edge-ident clear-fault --device /dev/ttyACM0`
    """
    with connected(where) as (board, _):
        commissioning.clear_fault(board, say)
        _report_state(board.status(), results)


def _report_state(status: "BoardStatus", results: ResultOptions) -> None:
    state = status.state.name
    document = {"schema": "edge-ident/state/1", "state": state, "enabled": status.enabled}
    with noting([f"the board is {state}, its effort is {'on' if status.enabled else 'off'}"]):
        results.deliver(document, "state.json")
        if not results.json:
            print(state, flush=True)
