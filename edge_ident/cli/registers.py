"""The command registers: the map, and single registers of a board."""

import math
from typing import TYPE_CHECKING, Annotated, Any

import typer

from edge_ident.cli.common import (
    BaudRate,
    Device,
    DriveFile,
    Json,
    Output,
    deliver,
    guarded,
)
from edge_ident.cli.sessions import connected

if TYPE_CHECKING:
    from firmware_interface.register import Register


def register(app: typer.Typer) -> None:
    """Add this file's command."""
    app.command()(registers)


@guarded
def registers(
    name: Annotated[
        str | None, typer.Argument(metavar="[NAME]", help="One register, or a group: limits.x")
    ] = None,
    write: Annotated[
        list[str] | None,
        typer.Option(
            "--write", metavar="VALUE", help="In the register's unit; repeat it for an array."
        ),
    ] = None,
    yes: Annotated[
        bool, typer.Option("--yes", help="Without this word nothing is written.")
    ] = False,
    device: Device = None,
    baud_rate: BaudRate = None,
    drive: DriveFile = None,
    output: Output = None,
    json: Json = False,
) -> None:
    """Print the register map; with --device, the values of a board. Write one register.

    A write is checked against the register's range, done on an idle board only, and read back.

    Example: `edge-ident registers watchdog.timeout --write 0.5 --yes --device /dev/ttyACM0`
    """
    from edge_ident.commissioning.register_access import registers_named
    from edge_ident.drive.description import load_drive

    chosen = registers_named(name)
    if not chosen:
        raise typer.BadParameter(f"there is no register {name}", param_hint="NAME")
    values: dict[str, tuple[float, ...]] = {}
    if write is not None or device or load_drive(drive).device:
        with connected(device, baud_rate, drive) as (board, _):
            if write is not None:
                _write(board, name, write, yes)
            values = {entry.name: board.register_values(entry.name) for entry in chosen}
    _deliver(chosen, values, output, json)


def _write(board: Any, name: str | None, texts: list[str], yes: bool) -> None:
    from edge_ident.commissioning.register_access import check_write, parse_values, write_register
    from firmware_interface.registers import REGISTERS

    target = REGISTERS.get(name or "")
    if target is None:
        raise typer.BadParameter("name one register to write", param_hint="NAME")
    try:
        values = parse_values(target, texts)
    except ValueError as error:
        raise typer.BadParameter(str(error), param_hint="--write") from error
    check_write(target, values)
    if not yes:
        now = board.register_values(target.name)
        raise typer.BadParameter(
            f"{target.name} would go from {_numbers(now)} to {_numbers(values)} {target.unit}; "
            "nothing was written: add --yes",
            param_hint="--write",
        )
    write_register(board, target, values)


def _deliver(
    chosen: "list[Register]", values: dict[str, tuple[float, ...]], output: Any, json: bool
) -> None:
    from firmware_interface.registers import MAP_CRC, MAP_VERSION

    document = {
        "schema": "edge-ident/registers/1",
        "map_version": MAP_VERSION,
        "map_crc": MAP_CRC,
        "registers": [_row(entry, values.get(entry.name)) for entry in chosen],
    }
    deliver(document, "registers.json", output, json)
    if json:
        return
    print(f"map version {MAP_VERSION}, CRC {MAP_CRC:08x}")
    for entry in chosen:
        print("\t".join(_line(entry, values.get(entry.name))))


def _row(entry: "Register", values: tuple[float, ...] | None) -> dict[str, Any]:
    from dataclasses import asdict

    row = asdict(entry)
    if values is not None:
        row["values"] = [value if math.isfinite(value) else None for value in values]
        row["believable"] = _believable(entry, values)
    return row


def _line(entry: "Register", values: tuple[float, ...] | None) -> list[str]:
    from edge_ident.commissioning.register_access import code_name

    kind = entry.type if entry.count == 1 else f"{entry.type}[{entry.count}]"
    limits = "" if entry.minimum is None else f"{entry.minimum:g}…{entry.maximum:g}"
    line = [f"{entry.address:#06x}", entry.name, kind, f"{entry.scale:g}", entry.unit]
    line += [entry.access, limits]
    if values is None:
        return [*line, entry.description]
    shown = (code_name(entry, values[0]) if entry.count == 1 else None) or _numbers(values)
    doubt = "" if _believable(entry, values) else "\tcannot be"
    return [*line, shown + doubt]


def _believable(entry: "Register", values: tuple[float, ...]) -> bool:
    """Whether the board may send this; what a host has yet to write may be anything."""
    from firmware_interface.received import believable

    return entry.access == "rw" or all(believable(entry, value) for value in values)


def _numbers(values: tuple[float, ...]) -> str:
    return " ".join(f"{value:.9g}" for value in values)
