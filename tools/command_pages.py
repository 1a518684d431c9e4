"""Writes docs/commands.md, every command with its options, from the commands' own declarations.

python -m tools.command_pages            write the page
python -m tools.command_pages --check    write nothing; exit code 1 when the page is out of date
"""

import re
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any, Final

import typer

from edge_ident.cli import app
from tools.generated_page import write_or_check

PAGE: Final = Path(__file__).parents[1] / "docs" / "commands.md"
_INTRODUCTION: Final = """\
<!-- Generated from edge_ident/cli/*.py by tools/command_pages.py; do not edit. -->
# Commands

`--help` behind a command prints the same. An environment variable gives the value of its option
where the command line does not; the [settings file](files.md#settings) comes after it. [Exit
codes](files.md#exit-codes) are the same for all commands.
"""
_CHOICES: Final = re.compile(r"[\w-]+(?:\|[\w-]+)+")
_EXAMPLE: Final = re.compile(r"\x08?\nExample:\n +(.+)")


def main(arguments: list[str]) -> int:
    """Write the page, or check it."""
    return write_or_check(arguments, PAGE, render(), "tools.command_pages")


def render() -> str:
    """The page's text."""
    commands = dict(_commands(typer.main.get_command(app), ""))
    rows = {name: list(_options(command)) for name, command in commands.items()}
    everywhere = [row for row in rows["identify"] if all(row in others for others in rows.values())]
    lines = [_INTRODUCTION, "| command | what it does |", "| --- | --- |"]
    for name, command in commands.items():
        purpose = " ".join(command.help.split("\n\n")[0].split())
        link = f"[{name}](#edge-ident-{name.replace(' ', '-')})"
        lines.append(f"| {link} | {_cell(_marked(purpose))} |")
    lines += ["", "## Options of every command", "", *_table(everywhere)]
    for name, command in commands.items():
        own = [row for row in rows[name] if row not in everywhere]
        lines += _section(name, command, own)
    return "\n".join(lines)


def _commands(group: Any, before: str) -> Iterator[tuple[str, Any]]:
    """Commands by their whole name, without the groups that hold them."""
    for name, command in group.commands.items():
        if hasattr(command, "commands"):
            yield from _commands(command, f"{before}{name} ")
        elif not command.hidden:
            yield before + name, command


def _section(name: str, command: Any, rows: list[str]) -> Iterator[str]:
    text = _EXAMPLE.sub("", command.help).strip()
    yield f"## edge-ident {name}"
    yield ""
    yield _marked(text)
    yield ""
    for example in _EXAMPLE.findall(command.help):
        yield from ("```", example, "```", "")
    yield from _table(rows)


def _table(rows: list[str]) -> Iterator[str]:
    if rows:
        yield "| option | meaning | default | environment |"
        yield "| --- | --- | --- | --- |"
        yield from rows
        yield ""


def _options(command: Any) -> Iterator[str]:
    context = typer.Context(command)
    for option in command.params:
        if option.hidden:
            continue
        names = [*sorted(option.opts, key=len, reverse=True), *option.secondary_opts]
        if option.param_type_name == "argument":
            names = [option.metavar or option.name.upper()]
        value = _value(option, context)
        named = ", ".join(f"`{name}{f' {value}' if value else ''}`" for name in names)
        cells = (named, _marked(option.help or ""), _default(option), _code(option.envvar or ""))
        yield f"| {' | '.join(map(_cell, cells))} |"


def _value(option: Any, context: Any) -> str:
    """What follows an option's name: a word for its kind, or the choices."""
    if option.param_type_name == "argument" or option.is_flag:
        return ""
    if option.metavar:
        return str(option.metavar)
    choices = _CHOICES.search(option.get_help_record(context)[0])
    return choices[0] if choices else ""


def _default(option: Any) -> str:
    default = option.default
    if default is None or default is False or default == [] or default == ():
        return ""
    if default is True:
        return _code(option.opts[0])
    return _code(str(getattr(default, "value", default)))


def _marked(text: str) -> str:
    """Options in a sentence as code."""
    return re.sub(r"(?<![\w-])(--[a-z][a-z0-9-]*)", r"`\1`", text)


def _code(text: str) -> str:
    return f"`{text}`" if text else ""


def _cell(text: str) -> str:
    return text.replace("|", "\\|")


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
