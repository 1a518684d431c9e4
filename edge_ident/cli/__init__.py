"""The command line: thin commands over the library, one file for each family."""

import typer

from edge_ident.cli import (
    board,
    checkup,
    compare,
    diagnose,
    gains,
    identify,
    motion,
    offline,
    registers,
    run_report,
    simulate,
)
from edge_ident.support.interrupts import end_as_by_ctrl_c

app = typer.Typer(
    name="edge-ident",
    help="Identify a feed drive, diagnose its model, and write better gains back safely.",
    no_args_is_help=True,
    add_completion=False,
    rich_markup_mode="markdown",
    pretty_exceptions_enable=False,
)
for commands in (
    motion,
    identify,
    run_report,
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
