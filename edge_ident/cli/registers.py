"""The command registers: the map, and single registers of a board."""

from typing import TYPE_CHECKING, Annotated

import typer

import edge_ident
from edge_ident import commissioning, report
from edge_ident.cli.command import command
from edge_ident.cli.failures import noting
from edge_ident.cli.options import BoardOptions, ResultOptions
from edge_ident.cli.sessions import connected, device_of

if TYPE_CHECKING:
    from edge_ident import Board

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


def register(app: typer.Typer) -> None:
    """Add this file's command."""
    app.command()(registers)


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
