"""Defaults that a user sets once: a TOML file, below the environment and above the defaults."""

import json
import os
import re
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, Final

import typer

from edge_ident.errors import DataError
from edge_ident.support.atomic_files import atomic_write

PREFIX: Final = "EDGE_IDENT_"
FILE_VARIABLE: Final = "EDGE_IDENT_CONFIG_FILE"
BOARD: Final = ("device", "baud_rate")
"""Settings that the drive description may hold too; it belongs to the machine and precedes."""


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
    path = settings_file()
    try:
        return _from_toml(path.read_text(encoding="utf-8"))
    except (FileNotFoundError, NotADirectoryError):
        return {}
    except (OSError, ValueError) as error:
        raise DataError(
            f"{path}: the settings cannot be read: {error}",
            "correct the file, or remove it to use the defaults",
        ) from error


def _from_toml(text: str) -> dict[str, Any]:
    import tomllib  # most users have no settings

    return tomllib.loads(text)


def write_setting(key: str, value: Any) -> Path:
    """Write one setting, or remove it if the value is None; all other lines stay as they are.

    Raises
    ------
    DataError
        The file has the setting in a form that a line alone does not change; it stays as it is.
    """
    path = settings_file()
    text = path.read_text(encoding="utf-8") if path.exists() else ""
    lines = text.splitlines()
    if value is not None:
        # a JSON string, number or boolean is one of TOML too
        lines = _replaced(lines, key, f"{key} = {json.dumps(value, ensure_ascii=False)}")
    else:
        lines = [line for line in lines if not _sets(line, key)]
    text = "".join(f"{line}\n" for line in lines)
    if not _means(text, key, value):
        raise DataError(
            f"{path} has {key} as a table, in quotes or twice, and was not changed",
            "correct this setting in the file, or remove the file to use the defaults",
        )
    with atomic_write(path) as partial:
        partial.write_text(text, encoding="utf-8")
    return path


def _means(text: str, key: str, value: Any) -> bool:
    """Whether a file of this text has the value, or with None lacks the setting."""
    try:
        return bool(_from_toml(text).get(key) == value)
    except ValueError:
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


def default_map(context: typer.Context) -> dict[str, Any]:
    """The settings as defaults of commands, in the form that typer takes.

    Parameters
    ----------
    context : typer.Context
        Of the command line as a whole.

    Raises
    ------
    DataError
        The file cannot be used, or one of its settings cannot.
    """
    known, values = list(options(context.command)), read_settings()
    for key, value in values.items():
        replaced = [option for name, option in known if name == key]
        if not replaced:
            raise DataError(
                f"{settings_file()}: there is no setting {key}",
                f"remove it with: edge-ident config unset {key}",
            )
        for option in replaced:
            _check_value(context, option, key, value)
    return _defaults(context.command, {k: v for k, v in values.items() if k not in BOARD})


def _check_value(context: typer.Context, option: Any, key: str, value: Any) -> None:
    try:
        option.process_value(context, value)
    except (typer.BadParameter, OverflowError) as error:
        raise DataError(
            f"{settings_file()}: {key} = {value!r}: {error}",
            f"set it anew: edge-ident config set {key} VALUE, or remove it: config unset {key}",
        ) from error


def _defaults(command: Any, values: Mapping[str | None, Any]) -> dict[str, Any]:
    below = getattr(command, "commands", {})
    if below:
        return {name: _defaults(sub, values) for name, sub in below.items()}
    named = ((parameter.name, setting_name(parameter)) for parameter in command.params)
    return {name: values[key] for name, key in named if key in values}
