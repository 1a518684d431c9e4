"""The command line: thin commands over the public API, one file for each command or family."""

import typer

from edge_ident.cli import (
    board,
    capture,
    checkup,
    compare,
    diagnose,
    gains,
    identify,
    import_file,
    machine,
    offline,
    profile,
    registers,
    run,
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
    run,
    capture,
    profile,
    machine,
    identify,
    import_file,
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
