"""The command line: thin commands over the public API, one file for each command or family."""

import sys

import typer

from edge_ident.cli import (
    board,
    capture,
    checkup,
    compare,
    config,
    diagnose,
    gains,
    identify,
    import_file,
    init,
    machine,
    offline,
    plan,
    plant,
    profile,
    registers,
    root,
    run,
    run_report,
    simulate,
    survey,
)
from edge_ident.cli.command_group import with_example
from edge_ident.support.interrupts import INTERRUPTED, end_as_by_ctrl_c

app = typer.Typer(
    name="edge-ident",
    cls=root.RootGroup,
    callback=root.begin,
    help=with_example(root.begin.__doc__ or ""),
    no_args_is_help=True,
    rich_markup_mode=None,  # a panel cuts words where the terminal is narrow
    pretty_exceptions_enable=False,
)
for commands in (
    init,
    run,
    capture,
    profile,
    machine,
    identify,
    import_file,
    run_report,
    gains,
    diagnose,
    plan,
    survey,
    simulate,
    compare,
    board,
    plant,
    checkup,
    registers,
    offline,
    config,
):
    commands.register(app)


def main() -> None:
    """Run the command line; ending signals interrupt it from here on, so that it can clean up."""
    whole = typer.main.get_command(app)
    try:
        end_as_by_ctrl_c()
        whole(prog_name="edge-ident")
    except KeyboardInterrupt:
        sys.exit(INTERRUPTED)
