"""The command line: thin commands over the public API, one file for each command or family."""

import os
import sys
from collections.abc import Iterable, Sequence
from functools import cache
from importlib import import_module
from typing import Final

import typer
from typer.models import CommandInfo

from edge_ident.cli import settings
from edge_ident.cli.command import RootGroup, begin, failure_of, tell, with_example
from edge_ident.support.process import INTERRUPTED, end_as_by_ctrl_c, uncut

GROUPS: Final = {
    "A board and its machine": {
        "init": "init",
        "ports": "machine",
        "doctor": "machine",
        "run": "run",
        "capture": "run",
        "gains": "gains",
        "home": "machine",
        "hold": "machine",
        "stop": "machine",
        "clear-fault": "machine",
        "registers": "machine",
        "report": "run",
        "profile": "machine",
    },
    "Recordings": {
        "import": "identify",
        "identify": "identify",
        "diagnose": "diagnose",
        "plan": "diagnose",
        "survey": "identify",
        "compare": "identify",
    },
    "Without a machine": {"simulate": "board", "board": "board", "plant": "board"},
    "Networks": {"train": "offline", "export": "offline"},
    "Settings": {"config": "config"},
}
"""The module of each command, in the groups and the order of the help."""
HOMES: Final = {name: home for group in GROUPS.values() for name, home in group.items()}


@uncut
def main() -> None:
    """Run the command line; ending signals interrupt it from here on, so that it can clean up."""
    whole = typer.main.get_command(app_for(sys.argv[1:]))
    try:
        end_as_by_ctrl_c()
        whole(prog_name="edge-ident")
    except KeyboardInterrupt:
        sys.exit(INTERRUPTED)
    except OSError as error:  # help, or a wrong option, for which there is no room
        failure = failure_of(error)
        assert failure is not None
        sys.exit(tell(error, failure, as_json=False))


def app_for(arguments: Sequence[str]) -> typer.Typer:
    """The app, with no more than the command that is named.

    To load and describe all commands takes an eighth of the start of one. All are needed for help,
    for a name that is none, and where there are settings, which may be those of any command.
    """
    named = next((word for word in arguments if not word.startswith("-")), "")
    if named not in HOMES or named == "config" or os.path.exists(settings.settings_file()):
        return whole_app()
    return _app_of([HOMES[named]])


@cache
def whole_app() -> typer.Typer:
    """The app with all commands; `app` for short."""
    return _app_of(dict.fromkeys(HOMES.values()))


def _app_of(modules: Iterable[str]) -> typer.Typer:
    app = typer.Typer(
        name="edge-ident",
        cls=RootGroup,
        callback=begin,
        help=with_example(begin.__doc__ or ""),
        no_args_is_help=True,
        rich_markup_mode=None,  # a panel cuts words where the terminal is narrow
        pretty_exceptions_enable=False,
    )
    for module in modules:
        import_module(f"{__name__}.{module}").register(app)
    panels = {name: title for title, group in GROUPS.items() for name in group}
    app.registered_commands.sort(key=lambda command: list(HOMES).index(_name(command)))
    for command in app.registered_commands:
        command.rich_help_panel = panels.get(_name(command))
    for group in app.registered_groups:
        group.rich_help_panel = panels.get(str(group.name))
    return app


def _name(command: CommandInfo) -> str:
    return str(command.name or getattr(command.callback, "__name__", ""))


def __getattr__(name: str) -> typer.Typer:
    if name == "app":
        return whole_app()
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
