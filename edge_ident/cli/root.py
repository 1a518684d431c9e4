"""What comes before the name of a command: the version, how much is told, the user's settings."""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Annotated, Any, Final

import typer

import edge_ident
from edge_ident.cli import settings
from edge_ident.cli.command import (
    INTERRUPTION,
    USAGE,
    Beginning,
    CommandGroup,
    Failure,
    Quiet,
    Verbose,
    failure_of,
    print_failure,
    take_plain_numbers,
    tell,
)
from edge_ident.cli.messages import Verbosity

# the base of all of typer's usage errors has no public name
_UsageError: Final[type[Any]] = typer.BadParameter.__mro__[1]


def _print_version(wanted: bool) -> None:
    if wanted:
        print(f"edge-ident {edge_ident.__version__}")
        raise typer.Exit


Version = Annotated[
    bool,
    typer.Option("--version", callback=_print_version, is_eager=True, help="Print the version."),
]


def begin(
    context: typer.Context,
    *,
    version: Version = False,
    quiet: Quiet = False,
    verbose: Verbose = False,
) -> None:
    """Identify a feed drive, diagnose its model, and write better gains back safely.

    Results go to stdout, messages to stderr. `edge-ident COMMAND --help` explains a command.

    Example: `edge-ident run --device virtual`
    """
    context.obj = Beginning(Verbosity(quiet, verbose), settings.use_settings(context))


class RootGroup(CommandGroup):
    """All commands; a usage error is also a document where --json was given."""

    def __init__(self, *given: Any, **named: Any) -> None:
        super().__init__(*given, **named)
        take_plain_numbers(self)

    def make_context(self, info_name: str | None, args: list[str], *more: Any, **extra: Any) -> Any:
        """Parse what stands before the command."""
        self._as_json = "--json" in args
        with self._reported():
            return super().make_context(info_name, args, *more, **extra)

    def invoke(self, ctx: Any) -> Any:
        """Parse the rest, and run the command."""
        with self._reported():
            return super().invoke(ctx)

    @contextmanager
    def _reported(self) -> Iterator[None]:
        """Report what ends the command line before, between and after its commands."""
        try:
            yield
        except typer.Exit:
            raise
        except _UsageError as error:
            if self._as_json:
                path = error.ctx.command_path if error.ctx else "edge-ident"
                cause = error.format_message()
                print_failure(error, Failure(USAGE, "usage", cause, f"see {path} --help"))
            raise
        except (Exception, KeyboardInterrupt) as error:
            if failure_of(error) is not INTERRUPTION:
                raise
            raise typer.Exit(tell(error, INTERRUPTION, as_json=self._as_json)) from error
