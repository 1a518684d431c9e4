"""What makes a function a command: groups of options, and errors turned into exit codes."""

import errno
import functools
import inspect
from collections.abc import Callable, Mapping
from dataclasses import MISSING, fields, is_dataclass
from typing import Any, Final, get_type_hints

import typer

from edge_ident.cli.messages import print_error, say
from edge_ident.errors import EdgeIdentError

UNTRUSTED: Final = 1
USAGE: Final = 2
INTERRUPTED: Final = 130
_NO_ROOM: Final = (errno.ENOSPC, errno.EFBIG, errno.EDQUOT)


def command(function: Callable[..., None]) -> Callable[..., None]:
    """Expand the option groups of a function, and turn its errors into exit codes.

    A parameter whose type is a dataclass becomes one option for each field of that dataclass;
    the function gets the dataclass. The user's errors are printed in two lines, cause and next
    step; the exit codes are those of the contract.
    """
    parameters = inspect.signature(function).parameters
    groups = {name: p.annotation for name, p in parameters.items() if is_dataclass(p.annotation)}

    @functools.wraps(function)
    def wrapper(**given: Any) -> None:
        as_json = bool(given.get("json"))
        try:
            function(**_grouped(given, groups))
        except EdgeIdentError as error:
            print_error(error, error.cause, error.next_step, as_json=as_json)
            raise typer.Exit(error.exit_code) from error
        except OSError as error:
            print_error(error, str(error), _file_remedy(error), as_json=as_json)
            raise typer.Exit(USAGE) from error
        except KeyboardInterrupt:
            say("interrupted")
            raise typer.Exit(INTERRUPTED) from None

    wrapper.__signature__ = _expanded(parameters, groups)  # type: ignore[attr-defined]
    return wrapper


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
    flat: list[inspect.Parameter] = []
    for name, parameter in parameters.items():
        flat += _options(groups[name]) if name in groups else [parameter]
    return inspect.Signature([p.replace(kind=inspect.Parameter.KEYWORD_ONLY) for p in flat])


def _options(group: Any) -> list[inspect.Parameter]:
    hints = get_type_hints(group, include_extras=True)
    return [
        inspect.Parameter(
            field.name,
            inspect.Parameter.KEYWORD_ONLY,
            default=inspect.Parameter.empty if field.default is MISSING else field.default,
            annotation=hints[field.name],
        )
        for field in fields(group)
    ]


def _file_remedy(error: OSError) -> str:
    full = error.errno in _NO_ROOM
    remedy = "make room there" if full else "check that the path exists and may be written"
    return f"{remedy}, or give another folder"
