"""The command config: defaults that are set once, and where each value comes from."""

import os
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Annotated, Any, Final

import typer

import edge_ident
from edge_ident.cli import settings
from edge_ident.cli.command import CommandGroup, settings_command, tell_ignored, with_example
from edge_ident.cli.messages import say
from edge_ident.cli.options import ResultOptions
from edge_ident.cli.sessions import drive_or_built_in

_HELP: Final = """Show, set and remove defaults of options, such as the device of your board.

An option on the command line comes first, then its environment variable, then the settings file,
then the default. The settings are printed.

Example: `edge-ident config set device /dev/ttyACM0`
"""
Key = Annotated[str, typer.Argument(metavar="NAME", help="Setting, for example device.")]
Text = Annotated[str, typer.Argument(metavar="VALUE", help="Its value.")]


@dataclass(frozen=True)
class Setting:
    """The value of a setting, and where it comes from.

    Attributes
    ----------
    value : str, int, float, bool or None
    source : str
        "environment NAME", "drive description FILE", "settings file" or "default".
    """

    value: Any
    source: str


class _ShowUnlessVerb(CommandGroup):
    """`config` alone is `config show`."""

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        if not args or (args[0].startswith("-") and args[0] != "--help"):
            args = ["show", *args]
        return super().parse_args(ctx, args)


def register(app: typer.Typer) -> None:
    """Add this file's command, a group of verbs."""
    group = typer.Typer(cls=_ShowUnlessVerb, rich_markup_mode=None)
    group.command()(show)
    group.command("get")(get)
    group.command("set")(set_)
    group.command()(unset)
    app.add_typer(group, name="config", help=with_example(_HELP))


@settings_command
def show(*, context: typer.Context, results: ResultOptions) -> None:
    """Print every setting with its value and where the value comes from.

    Example: `edge-ident config show --json`
    """
    found, ignored = _all_settings(context)
    results.deliver(_document(found, ignored), "config.json")
    say(f"settings file: {settings.settings_file()}")
    tell_ignored(ignored)
    longest = max(len(_text(setting.value)) for setting in found.values())
    for key, setting in found.items() if not results.json else []:
        print(f"{key:14} {_text(setting.value):{longest}} {setting.source}")


@settings_command
def get(*, context: typer.Context, key: Key, results: ResultOptions) -> None:
    """Print the value of one setting.

    Example: `edge-ident config get device`
    """
    _option(context, key)
    settings_found, ignored = _all_settings(context)
    found = settings_found[key]
    results.deliver(_document({key: found}, ignored), "config.json")
    say(f"from: {found.source}")
    tell_ignored(ignored)
    if not results.json:
        print(_text(found.value))


@settings_command
def set_(*, context: typer.Context, key: Key, value: Text, results: ResultOptions) -> None:
    """Write a default into the settings file.

    Example: `edge-ident config set device tcp://192.0.2.7:502`
    """
    try:
        value.encode()
        checked = settings.checked_value(context, _option(context, key), value)
    except (ValueError, OverflowError) as error:
        raise typer.BadParameter(f"{value!r}: {error}", param_hint="VALUE") from error
    if not isinstance(checked, bool | int | float) or value.endswith("%"):
        checked = value  # a path or a percentage stays as it was written
    settings.read_settings()  # a file that cannot be read is not overwritten
    _written(context, settings.write_setting(key, checked), key, results)


@settings_command
def unset(*, context: typer.Context, key: Key, results: ResultOptions) -> None:
    """Remove a default from the settings file.

    Example: `edge-ident config unset device`
    """
    _written(context, settings.write_setting(key, None), key, results)


def _written(context: typer.Context, path: Any, key: str, results: ResultOptions) -> None:
    settings_found, ignored = _all_settings(context)
    found = {k: v for k, v in settings_found.items() if k == key}
    results.deliver(_document(found, ignored), "config.json")
    say(f"written: {path}")
    tell_ignored(ignored)
    for setting in found.values():
        say(f"in force: {key} = {_text(setting.value)} ({setting.source})")


def _option(context: typer.Context, key: str) -> Any:
    known = dict(settings.options(context.find_root().command))
    if key not in known:
        raise typer.BadParameter(
            f"there is no setting {key}; choose from {', '.join(sorted(known))}", param_hint="NAME"
        )
    return known[key]


def _all_settings(
    context: typer.Context,
) -> tuple[dict[str, Setting], tuple[edge_ident.EdgeIdentError, ...]]:
    """Every setting as it is now, and what of the file is ignored."""
    ignored = settings.use_settings(context.find_root())
    try:
        written = settings.read_settings()
    except edge_ident.DataError:  # which is what is ignored
        written = {}
    known = dict(settings.options(context.find_root().command))
    found = {key: _setting(key, known[key], written) for key in sorted(known)}
    drive = found["drive"].value
    described, error = drive_or_built_in(drive if isinstance(drive, str) else None)
    if error is not None:
        return found, (*ignored, error)
    for key in settings.BOARD:
        value = getattr(described, key)
        if value is not None and not found[key].source.startswith("environment"):
            found[key] = Setting(value, f"drive description {drive}")
    return found, ignored


def _setting(key: str, option: Any, written: dict[str, Any]) -> Setting:
    variable = settings.PREFIX + key.upper()
    if os.environ.get(variable):
        return Setting(os.environ[variable], f"environment {variable}")
    if key in written:
        return Setting(settings.shown(written[key]), "settings file")
    return Setting(option.default, "default")


def _text(value: Any) -> str:
    return "–" if value is None else str(value)


def _document(
    found: dict[str, Setting], ignored: Iterable[edge_ident.EdgeIdentError]
) -> dict[str, Any]:
    return {
        "schema": "edge-ident/config/1",
        "file": str(settings.settings_file()),
        "settings": {
            key: {
                "value": setting.value
                if isinstance(setting.value, bool | int | float | None)
                else str(setting.value),
                "source": setting.source,
            }
            for key, setting in found.items()
        },
        "ignored": [error.cause for error in ignored],
    }
