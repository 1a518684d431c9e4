"""What makes a function a command: groups of options, and errors turned into exit codes."""

import functools
import inspect
import math
import sys
import time
import traceback
from collections.abc import Callable, Iterable, Mapping
from dataclasses import MISSING, dataclass, fields, is_dataclass
from typing import Annotated, Any, Final, get_type_hints

import typer

from edge_ident.cli.command_group import with_example
from edge_ident.cli.failures import INTERNAL, Failure, failure_of, tell
from edge_ident.cli.messages import NORMAL, Verbosity, detail, say_always, telling
from edge_ident.errors import EdgeIdentError

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

    A parameter whose type is a dataclass becomes one option for each field of that dataclass;
    the function gets the dataclass. The user's errors are printed in two lines, cause and next
    step; the exit codes are those of the contract. With --json the error is a document on stdout.
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
    wrapper.__signature__ = _expanded(parameters, groups)  # type: ignore[attr-defined]
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


def _expanded(
    parameters: Mapping[str, inspect.Parameter], groups: Mapping[str, Any]
) -> inspect.Signature:
    """The signature that typer reads: the fields of a group in the place of the group."""
    flat = [_keyword("context", typer.Context)]
    for name, parameter in parameters.items():
        if name != "context":
            flat += _options(groups[name]) if name in groups else [parameter]
    flat += [_keyword("quiet", Quiet, False), _keyword("verbose", Verbose, False)]
    return inspect.Signature([p.replace(kind=inspect.Parameter.KEYWORD_ONLY) for p in flat])


def _options(group: Any) -> list[inspect.Parameter]:
    hints = get_type_hints(group, include_extras=True)
    return [
        _keyword(
            field.name,
            hints[field.name],
            inspect.Parameter.empty if field.default is MISSING else field.default,
        )
        for field in fields(group)
        if field.name != "context"
    ]


def _keyword(
    name: str, annotation: Any, default: Any = inspect.Parameter.empty
) -> inspect.Parameter:
    return inspect.Parameter(
        name, inspect.Parameter.KEYWORD_ONLY, default=default, annotation=annotation
    )
