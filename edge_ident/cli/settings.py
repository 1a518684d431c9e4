"""Defaults that a user sets once: a TOML file, below the environment and above the defaults."""

import json
import math
import os
import re
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, Final

import typer

from edge_ident.errors import DataError
from edge_ident.support.documents import MOST_DESCRIPTION_BYTES, atomic_write, from_toml, read_bytes

PREFIX: Final = "EDGE_IDENT_"
FILE_VARIABLE: Final = "EDGE_IDENT_CONFIG_FILE"
BOARD: Final = ("device", "baud_rate")
"""Settings that the drive description may hold too; it belongs to the machine and precedes."""
# Largest number that is shown digit by digit; Python refuses more than 4300 digits.
_MOST_BITS: Final = 64
# Settings of `BOARD` that can be used, for the command line that runs.
_of_board: Final[dict[str, Any]] = {}


def settings_file() -> Path:
    """Where the settings are."""
    given = os.environ.get(FILE_VARIABLE)
    return Path(given) if given else Path(typer.get_app_dir("edge-ident")) / "config.toml"


def read_settings() -> dict[str, Any]:
    """Read the settings; empty where there is no file.

    Raises
    ------
    DataError
        If the file cannot be read or is no TOML.
    """
    text = _text()
    try:
        return from_toml(text) if text else {}
    except ValueError as error:
        raise _unreadable(error) from error


def _text() -> str:
    try:
        return read_bytes(settings_file(), MOST_DESCRIPTION_BYTES).decode("utf-8")
    except (FileNotFoundError, NotADirectoryError):
        return ""
    except (OSError, ValueError) as error:
        raise _unreadable(error) from error


def _unreadable(error: Exception) -> DataError:
    return DataError(
        f"{settings_file()}: the settings cannot be read: {error}",
        "correct the file, or remove it to use the defaults",
    )


def write_setting(key: str, value: Any) -> Path:
    """Write one setting, or remove it if the value is None; all other lines stay as they are.

    Raises
    ------
    DataError
        The file has the setting in a form that a line alone does not change, or cannot be read; it
        stays as it is.
    """
    path, lines = settings_file(), _text().splitlines()
    if value is not None:
        # a JSON string, number or boolean is one of TOML too, but for one character
        written = json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")
        lines = _replaced(lines, key, f"{key} = {written}")
    else:
        lines = [line for line in lines if not _sets(line, key)]
    text = "".join(f"{line}\n" for line in lines)
    if not _means(text, key, value):
        raise DataError(
            f"{path} has {key} as a table, in quotes, twice or over several lines, and was "
            "not changed",
            "correct this setting in the file, or remove the file to use the defaults",
        )
    with atomic_write(path) as partial:
        partial.write_text(text, encoding="utf-8")
    return path


def _means(text: str, key: str, value: Any) -> bool:
    """Whether a file of this text has the value, or with None lacks the setting."""
    try:
        return bool(from_toml(text).get(key) == value)
    except ValueError:
        read_settings()  # where the file itself is damaged, that is what to tell
        return False


def _replaced(lines: list[str], key: str, new: str) -> list[str]:
    if not any(_sets(line, key) for line in lines):
        return [new, *lines]  # before any table
    return [new if _sets(line, key) else line for line in lines]


def _sets(line: str, key: str) -> bool:
    return bool(re.match(rf"\s*{re.escape(key)}\s*=", line))


def options(command: Any) -> Iterator[tuple[str, Any]]:
    """Every option of every command that a setting may replace, by the setting's name."""
    for parameter in command.params:
        key = setting_name(parameter)
        if key:
            yield key, parameter
    for below in getattr(command, "commands", {}).values():
        yield from options(below)


def setting_name(parameter: Any) -> str | None:
    """The setting of an option: its environment variable, without prefix and in small letters."""
    variable = parameter.envvar
    if not isinstance(variable, str) or not variable.startswith(PREFIX):
        return None
    return variable.removeprefix(PREFIX).lower()


def use_settings(context: Any) -> tuple[DataError, ...]:
    """Make defaults of commands of those settings that can be used.

    Parameters
    ----------
    context : Context
        Of the command line as a whole; it gets the defaults in the form that typer takes.

    Returns
    -------
    tuple of DataError
        Why the file cannot be used, or one of its settings cannot.
    """
    errors, usable = list[DataError](), dict[str | None, Any]()
    try:
        written = read_settings()
    except DataError as error:
        written = {}
        errors.append(error)
    known = list(options(context.command)) if written else []
    for key, value in written.items():
        try:
            usable[key] = _checked(context, key, value, [o for name, o in known if name == key])
        except DataError as error:
            errors.append(error)
    _of_board.clear()
    _of_board.update({key: usable.pop(key) for key in BOARD if key in usable})
    context.default_map = _defaults(context.command, usable)
    return tuple(errors)


def board_setting(key: str) -> Any:
    """A setting of `BOARD` that can be used, for the command line that runs; None without one."""
    return _of_board.get(key)


def _checked(context: Any, key: str, value: Any, replaced: list[Any]) -> Any:
    """A setting as the options take it that it replaces."""
    if not replaced:
        raise DataError(
            f"{settings_file()}: there is no setting {key}",
            f"remove it with: edge-ident config unset {key}",
        )
    try:
        found = [checked_value(context, option, value) for option in replaced][-1]
        return found if isinstance(found, bool | int | float) else str(value)
    except (typer.BadParameter, ValueError, OverflowError) as error:
        raise DataError(
            f"{settings_file()}: {key} = {shown(value)!r}: {error}",
            f"set it anew: edge-ident config set {key} VALUE, or remove it: config unset {key}",
        ) from error


def checked_value(context: Any, option: Any, value: Any) -> Any:
    """What an option makes of a value, which may be of any type that TOML has.

    Raises
    ------
    typer.BadParameter, ValueError, OverflowError
        The option does not take it.
    """
    if not isinstance(value, str | bool | int | float):
        raise typer.BadParameter("a list, a table or a date is no value of a setting")
    if "\0" in str(value):
        raise typer.BadParameter("no option takes a null character")
    if isinstance(value, bool) and not option.is_flag:
        raise typer.BadParameter("only a switch is true or false")
    # as text, as on the command line
    found = option.process_value(context, value if isinstance(value, bool) else str(value))
    if isinstance(found, float) and not math.isfinite(found):
        raise typer.BadParameter(f"{found} is no finite number")
    return found


def shown(value: Any) -> str | bool | int | float:
    """A value of the file as a sentence or a document can hold it."""
    if isinstance(value, int) and value.bit_length() > _MOST_BITS:
        return f"a number of {value.bit_length()} bits"
    finite = isinstance(value, int) or (isinstance(value, float) and math.isfinite(value))
    return value if finite else str(value)


def _defaults(command: Any, values: Mapping[str | None, Any]) -> dict[str, Any]:
    below = getattr(command, "commands", {})
    if below:
        return {name: _defaults(sub, values) for name, sub in below.items()}
    named = ((parameter.name, setting_name(parameter)) for parameter in command.params)
    return {name: values[key] for name, key in named if key in values}
