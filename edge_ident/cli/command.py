"""What makes a function a command: groups of options, exit codes, help in sentences; and what comes
before its name: the version, how much is told, the user's settings.
"""

import copy
import errno
import functools
import inspect
import math
import re
import sys
import time
import traceback
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import MISSING, dataclass, fields, is_dataclass
from functools import partial
from typing import Annotated, Any, Final, NamedTuple, get_args, get_origin, get_type_hints

import typer
from typer.core import TyperGroup
from typer.models import OptionInfo

import edge_ident
from edge_ident.cli import options, settings
from edge_ident.cli.messages import (
    NORMAL,
    Verbosity,
    detail,
    print_document,
    say,
    say_always,
    telling,
)
from edge_ident.errors import EdgeIdentError
from edge_ident.support.process import INTERRUPTED, flushed, interrupted
from edge_ident.support.words import on_a_line

# What makes a function a command: groups of options, and errors turned into exit codes.

UNTRUSTED: Final = 1

Quiet = Annotated[
    bool, typer.Option("--quiet", "-q", help="Print only the result, and errors on stderr.")
]
Verbose = Annotated[
    bool, typer.Option("--verbose", "-v", help="Say on stderr what is done and how long it takes.")
]


@dataclass(frozen=True)
class Beginning:
    """What stands before the name of the command, and what the settings file did.

    Attributes
    ----------
    verbosity : Verbosity
    settings_errors : tuple of EdgeIdentError
        Why the settings file cannot be used, or some of its settings cannot.
    """

    verbosity: Verbosity = NORMAL
    settings_errors: tuple[EdgeIdentError, ...] = ()


def command(function: Callable[..., None]) -> Callable[..., None]:
    """Expand the option groups of a function, and turn its errors into exit codes.

    A parameter whose type is a dataclass becomes one option for each field of that dataclass; the
    function gets the dataclass. An option has the name of its parameter. What it takes and what it
    means stand in the docstring, or in that of `edge_ident.cli.options` where several commands have
    it. What else typer is to know of it stands in its type.

    The user's errors are printed in two lines, cause and next step; the exit codes are those of the
    contract. With --json the error is a document on stdout.
    """
    return _command(function, needs_settings=True)


def settings_command(function: Callable[..., None]) -> Callable[..., None]:
    """Make a command that also works while the settings file cannot be used.

    To mend it, or because a machine has to be stopped. Settings that can be used are.
    """
    return _command(function, needs_settings=False)


def _command(function: Callable[..., None], *, needs_settings: bool) -> Callable[..., None]:
    parameters = inspect.signature(function).parameters
    groups = {name: p.annotation for name, p in parameters.items() if is_dataclass(p.annotation)}
    in_groups = {field.name for group in groups.values() for field in fields(group)}

    @functools.wraps(function)
    def wrapper(context: typer.Context, quiet: bool, verbose: bool, **given: Any) -> None:
        began = context.find_root().obj or Beginning()
        as_json = bool(given.get("json"))
        if "context" in {*parameters, *in_groups}:
            given["context"] = context
        with telling(_verbosity(began.verbosity, quiet, verbose)):
            _check_finite(context, given)
            try:
                if needs_settings and began.settings_errors:
                    raise began.settings_errors[0]
                _timed(function, _grouped(given, groups))
            except (typer.Exit, typer.BadParameter):
                raise
            except (Exception, KeyboardInterrupt) as error:
                raise typer.Exit(_report(error, as_json=as_json)) from error

    wrapper.__doc__ = with_example(function.__doc__ or "")
    wrapper.__signature__ = _expanded(function, groups)  # type: ignore[attr-defined]
    return wrapper


def tell_ignored(errors: Iterable[EdgeIdentError]) -> None:
    """Say which settings are ignored, and why."""
    for error in errors:
        say_always(f"ignored: {error.cause}")
        say_always(f"next:    {error.next_step}")


def _check_finite(context: typer.Context, given: Mapping[str, Any]) -> None:
    for option in context.command.params:
        value = given.get(option.name or "")
        if isinstance(value, float) and not math.isfinite(value):
            raise typer.BadParameter(f"{value} is no finite number", context, option)


def _timed(function: Callable[..., None], given: Mapping[str, Any]) -> None:
    began_s = time.perf_counter()
    function(**given)
    sys.stdout.flush()  # a full disk shows here, and not after the exit code is chosen
    detail(f"done in {time.perf_counter() - began_s:.2f} s")


def _verbosity(before: Verbosity, quiet: bool, verbose: bool) -> Verbosity:
    """Verbosity by the options before and after the name of the command."""
    wanted = Verbosity(before.quiet or quiet, before.verbose or verbose)
    if wanted.quiet and wanted.verbose:
        raise typer.BadParameter("choose one of --quiet and --verbose")
    return wanted


def _report(error: BaseException, *, as_json: bool) -> int:
    """Tell the user about an error, and choose the exit code."""
    failure = failure_of(error)
    if failure is None:
        traceback.print_exception(error)
        cause = f"{type(error).__name__}: {error}"
        failure = Failure(INTERNAL, "internal", cause, "report this as a defect of edge-ident")
    return tell(error, failure, as_json=as_json)


def _grouped(given: dict[str, Any], groups: Mapping[str, Any]) -> dict[str, Any]:
    """Gather the options of each group."""
    gathered = {
        name: group(**{field.name: given.pop(field.name) for field in fields(group)})
        for name, group in groups.items()
    }
    return given | gathered


def _expanded(function: Callable[..., None], groups: Mapping[str, Any]) -> inspect.Signature:
    """The signature that typer reads: the fields of a group in the place of the group."""
    flat = [_keyword("context", typer.Context)]
    for name, parameter in inspect.signature(function).parameters.items():
        if name in groups:
            flat += _options(groups[name])
        elif name != "context":
            flat.append(_option(name, parameter.annotation, parameter.default, function.__doc__))
    flat += [_keyword("quiet", Quiet, False), _keyword("verbose", Verbose, False)]
    return inspect.Signature(flat)


def _options(group: Any) -> Iterator[inspect.Parameter]:
    hints = get_type_hints(group, include_extras=True)
    for field in fields(group):
        if field.name != "context":
            default = inspect.Parameter.empty if field.default is MISSING else field.default
            yield _option(field.name, hints[field.name], default, _docstrings(group))


def _docstrings(group: Any) -> str:
    """Docstrings of a group and of those that it extends; the first that names an option counts."""
    return "\n\n".join(inspect.cleandoc(of.__doc__ or "") for of in group.__mro__[:-1])


def _option(name: str, annotation: Any, default: Any, text: str | None) -> inspect.Parameter:
    """An option or argument with its flag, what it takes and its help, as a docstring has them."""
    kind, *given = get_args(annotation) if get_origin(annotation) is Annotated else (annotation,)
    info: Any = copy.copy(given[0]) if given else typer.Option()
    if isinstance(info, OptionInfo):
        given_flags = (info.default, *(info.param_decls or ()))
        flags: list[Any] = [flag for flag in given_flags if flag is not ...]
        if not any(flag.startswith("--") for flag in flags):
            flags.insert(0, f"--{name.replace('_', '-')}")
        info.default, info.param_decls = ..., flags
        if info.envvar == settings.PREFIX:
            info.envvar += flags[0].removeprefix("--").replace("-", "_").upper()
    if info.help is None:
        said = _said_of(name, text) or _said_of(name, options.__doc__)
        info.metavar, info.help = (said[1], " ".join(said[2].split())) if said else (None, None)
    return _keyword(name, Annotated[kind, info], default)


def _said_of(name: str, text: str | None) -> re.Match[str] | None:
    """What a docstring says of an option: what it takes, and its help."""
    pattern = rf"^{name}(?: : (.+))?\n((?:    .+\n?)+)"
    return re.search(pattern, inspect.cleandoc(text or ""), re.M)


def _keyword(
    name: str, annotation: Any, default: Any = inspect.Parameter.empty
) -> inspect.Parameter:
    return inspect.Parameter(
        name, inspect.Parameter.KEYWORD_ONLY, default=default, annotation=annotation
    )


# What typer does not do by itself: help in whole sentences, and numbers as they are written.


class CommandGroup(TyperGroup):
    """A group that lists its commands with the whole first sentence of their help."""

    def format_commands(self, ctx: Any, formatter: Any) -> None:
        """Write the commands; a line that is too long continues on the next."""
        groups: dict[str, list[tuple[str, str]]] = {}
        for name, command in self.commands.items():
            if not command.hidden:
                said = " ".join((command.help or "").split("\n\n")[0].split())
                title = getattr(command, "rich_help_panel", None)
                title = title if isinstance(title, str) else "Commands"
                groups.setdefault(title, []).append((name, said))
        for title, rows in groups.items():
            with formatter.section(title):
                formatter.write_dl(rows)


def with_example(text: str) -> str:
    """A help text without options and marks, whose example is a line of its own."""
    text = inspect.cleandoc(text).partition("\n\nParameters\n")[0]
    text = re.sub(r"^Example: `(.+)`", "\b\nExample:\n  \\1", text, flags=re.M)
    return text.replace("`", "")


def take_plain_numbers(command: Any) -> None:
    """Make every option of a command, and of those below it, refuse underscores in numbers."""
    for parameter in command.params:
        kind = parameter.type
        if kind.name.startswith(("float", "int")):
            parameter.type = copy.copy(kind)  # options without a range share theirs
            parameter.type.convert = partial(_converted, kind)
    for below in getattr(command, "commands", {}).values():
        take_plain_numbers(below)


def _converted(kind: Any, value: Any, parameter: Any, context: Any) -> Any:
    if "_" in str(value):
        kind.fail(f"{value!r} is not a valid {kind.name}.", parameter, context)
    return kind.convert(value, parameter, context)


# Errors that a user can act on, with their exit codes.

USAGE: Final = 2
FILE: Final = 5
"""A file that cannot be read, or a result that cannot be written."""
UNREAD: Final = 141
"""Nobody reads the result any more: as a shell says of other programs that a closed pipe ends."""
INTERNAL: Final = 70
"""A defect of the program itself, by the number that sysexits.h has for it."""
# Characters of a cause or a next step: forty columns by headings of a line each.
_LONGEST: Final = 4000
_NO_ROOM: Final = (errno.ENOSPC, errno.EFBIG, errno.EDQUOT)


class Failure(NamedTuple):
    """An error as it is reported.

    Attributes
    ----------
    exit_code : int
    code : {"link", "board", "data", "model", "gains", "file", "usage", "interrupted", "internal"}
        What failed, for scripts.
    cause, next_step : str
        One line each.
    """

    exit_code: int
    code: str
    cause: str
    next_step: str


INTERRUPTION: Final = Failure(
    INTERRUPTED, "interrupted", "the command was interrupted", "run it again when you are ready"
)
CLOSED: Final = Failure(
    FILE,
    "file",
    "the output was closed before the result was written to it",
    "let what reads it read to the end; files are written",
)
UNREAD_RESULT: Final = CLOSED._replace(exit_code=UNREAD)


def failure_of(error: BaseException) -> Failure | None:
    """What to tell about an error; None for what a user cannot act on."""
    if isinstance(error, EdgeIdentError):
        return Failure(error.exit_code, error.code, error.cause, error.next_step)
    if isinstance(error, BrokenPipeError):
        return CLOSED if _notes(error) else UNREAD_RESULT
    if isinstance(error, OSError):
        return Failure(FILE, "file", str(error), _remedy(error))
    if isinstance(error, KeyboardInterrupt) or interrupted():
        return INTERRUPTION
    return None


def tell(error: BaseException, failure: Failure, *, as_json: bool) -> int:
    """Print an error on stderr, as a document on stdout where JSON is wanted; the exit code."""
    if failure is INTERRUPTION:
        say("interrupted")
    elif failure is not UNREAD_RESULT:
        say_always(f"error: {_line(failure.cause)}")
        say_always(f"next:  {_line(failure.next_step)}")
    for note in _notes(error):
        say_always(f"note:  {_line(note)}")
    flushed(sys.stdout)
    if as_json:
        print_failure(error, failure)
    return failure.exit_code


def _line(sentence: str) -> str:
    """One line, whatever stands in the names that it quotes, and no more than a person reads."""
    line = on_a_line(sentence)
    return line if len(line) <= _LONGEST else f"{line[:_LONGEST]}…"


def print_failure(error: BaseException, failure: Failure) -> None:
    """Print the one JSON document of a command that failed, schema edge-ident/error/1."""
    document = {
        "schema": "edge-ident/error/1",
        "code": failure.code,
        "error": type(error).__name__,
        "message": failure.cause,
        "cause": failure.cause,
        "next_step": failure.next_step,
        "notes": _notes(error),
        "exit_code": failure.exit_code,
    }
    try:
        print_document(document)
    except OSError:  # stdout may be what failed
        flushed(sys.stdout)


@contextmanager
def noting(done: Iterable[str]) -> Iterator[None]:
    """Note on whatever ends the body early what has been done to the machine by then."""
    try:
        yield
    except BaseException as error:
        for sentence in done:
            error.add_note(sentence)
        raise


def _notes(error: BaseException) -> list[str]:
    """What became of the machine, one line each."""
    return list(getattr(error, "__notes__", ()))


def _remedy(error: OSError) -> str:
    full = error.errno in _NO_ROOM
    remedy = "free some space on that disk" if full else "check the path and your rights to it"
    return f"{remedy}, or choose another place"


# What comes before the name of a command: the version, how much is told, the user's settings.

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
