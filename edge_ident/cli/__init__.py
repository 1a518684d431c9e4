"""The command line: thin commands over the library, one file for each family."""

import typer

from edge_ident.cli import (
    board,
    checkup,
    compare,
    diagnose,
    files,
    gains,
    motion,
    offline,
    registers,
    simulate,
)
from edge_ident.support.interrupts import end_as_by_ctrl_c

app = typer.Typer(
    name="edge-ident",
    help="Identify a feed drive, write better gains back safely, and say how far to trust them.",
    no_args_is_help=True,
    add_completion=False,
    rich_markup_mode="markdown",
    pretty_exceptions_enable=False,
)
for commands in (
    motion,
    files,
    gains,
    diagnose,
    simulate,
    compare,
    board,
    checkup,
    registers,
    offline,
):
    commands.register(app)


def main() -> None:
    """Entry point of the `edge-ident` script."""
    end_as_by_ctrl_c()
    app()
