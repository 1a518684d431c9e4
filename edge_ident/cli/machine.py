"""Commands that leave the machine at rest where it should be: home, stop, clear-fault."""

from typing import TYPE_CHECKING, Annotated

import typer

from edge_ident import commissioning, report
from edge_ident.cli.command import command
from edge_ident.cli.messages import say
from edge_ident.cli.options import BoardOptions, ResultOptions
from edge_ident.cli.progress import shown_progress
from edge_ident.cli.sessions import connected, located

if TYPE_CHECKING:
    from edge_ident.commissioning import BoardStatus

Targets = Annotated[
    list[str] | None,
    typer.Option(
        "--to", metavar="AXIS=RAD", help="Move this axis to this position; may be repeated."
    ),
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
    app.command()(stop)
    app.command("clear-fault")(clear_fault)


@command
def home(
    *,
    where: BoardOptions,
    to: Targets = None,
    speed: Speed = None,
    results: ResultOptions,
) -> None:
    """Move the axes slowly to position zero, or to the positions given with --to.

    The command does not search for a reference mark. Positions of an axis that is not homed count
    from where it stood when the board was switched on. The positions are printed; with --output
    they are also written to home.json in that folder.

    Example: `edge-ident home --to x=1.5 --to z=-0.5 --device /dev/ttyACM0`
    """
    named = _parse_targets(to or [])
    with connected(where) as (board, _), shown_progress() as bars:
        targets = named or dict.fromkeys(board.axes, 0.0)
        done = commissioning.move_to(board, targets, bars, speed)
    results.deliver(report.home_document(done), "home.json")
    for axis, way in done.ways.items() if not results.json else []:
        print(f"{axis}: {way.from_rad:.4f} → {way.reached_rad:.4f} rad")


def _parse_targets(texts: list[str]) -> dict[str, float]:
    """Parse AXIS=RAD texts."""
    targets = {}
    for text in texts:
        axis, _, number = text.partition("=")
        try:
            targets[axis] = float(number)
        except ValueError:
            raise typer.BadParameter(f"{text}: write AXIS=RAD", param_hint="--to") from None
    return targets


@command
def stop(*, where: BoardOptions, results: ResultOptions) -> None:
    """Bring the machine to rest and switch the effort off. This is not an emergency stop.

    Unconfirmed gains are rolled back. The effort stays on if another host controls the board. If
    another command of the same user has the port open, that command is interrupted as by Ctrl-C.
    The state of the board is printed; with --output it is also written to state.json.

    Example: `edge-ident stop --device /dev/ttyACM0`
    """
    address = located(where)
    _report_state(commissioning.stop_machine(address.device, address.baud_rate, say), results)


@command
def clear_fault(*, where: BoardOptions, results: ResultOptions) -> None:
    """Clear a latched fault after its cause is removed and the machine is at rest.

    The state of the board is printed; with --output it is also written to state.json.

    Example: `edge-ident clear-fault --device /dev/ttyACM0`
    """
    with connected(where) as (board, _):
        say(f"fault: {board.status().fault.name}")
        board.clear_fault()
        _report_state(board.status(), results)


def _report_state(status: "BoardStatus", results: ResultOptions) -> None:
    state = status.state.name
    document = {"schema": "edge-ident/state/1", "state": state, "enabled": status.enabled}
    results.deliver(document, "state.json")
    if not results.json:
        print(state)
