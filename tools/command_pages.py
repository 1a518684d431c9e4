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

`--help` behind a command prints the same. Values come from the command line, then from the
environment where an option is marked *: `EDGE_IDENT_` and its name in capitals, such as
`EDGE_IDENT_BAUD_RATE`. The [settings file](files.md#settings) comes after it. [Exit
codes](files.md#exit-codes) are the same for all commands. Every command prints its result.
"""
_OFTEN: Final = 3  # an option of so many commands is explained once
_ALL: Final = "Options of every command"
_SEVERAL: Final = "Options of several commands"
_READING: Final = "Options for reading a recording"
_VIRTUAL: Final = "Options of the virtual drive"
_CHOICES: Final = re.compile(r"[\w-]+(?:\|[\w-]+)+")
# What most commands say of their result.
_WRITTEN: Final = re.compile(
    r"The [\w ]+ (?:is|are)\s+printed; with\s+--output\s+(?:it\s+is|they\s+are)\s+also\s+"
    r"written\s+to\s+([\w.]+?)(\s+in\s+that\s+folder)?\."
)
_EXAMPLE: Final = re.compile(r"\x08?\nExample:\n +(.+)")


def main(arguments: list[str]) -> int:
    """Write the page, or check it."""
    return write_or_check(arguments, PAGE, render(), "tools.command_pages")


def render() -> str:
    """The page's text."""
    commands = dict(_commands(typer.main.get_command(app), ""))
    rows = {name: list(_options(command)) for name, command in commands.items()}
    shared = _shared(rows)
    lines = [_INTRODUCTION, *_overview(commands)]
    for title, common in shared.items():
        lines += [f"## {title}", "", *_table(common)]
    for name, command in commands.items():
        lines += _section(name, command, rows[name], shared)
    return "\n".join(lines)


def _commands(group: Any, before: str) -> Iterator[tuple[str, Any]]:
    """Commands by their whole name, without the groups that hold them."""
    for name, command in group.commands.items():
        panel = getattr(command, "rich_help_panel", None)
        if hasattr(command, "commands"):
            for verb, sub in _commands(command, f"{before}{name} "):
                sub.rich_help_panel = panel
                yield verb, sub
        elif not command.hidden:
            yield before + name, command


def _overview(commands: dict[str, Any]) -> Iterator[str]:
    panels: dict[str, list[str]] = {}
    for name, command in commands.items():
        link = f"[{name}](#edge-ident-{name.replace(' ', '-')})"
        panels.setdefault(command.rich_help_panel, []).append(link)
    yield from (f"- {panel}: {', '.join(links)}" for panel, links in panels.items())
    yield ""


def _shared(rows: dict[str, list[str]]) -> dict[str, list[str]]:
    """Options that at least three commands have, so that they are explained once."""
    users: dict[str, set[str]] = {}
    for name, own in rows.items():
        for row in filter(_is_option, own):
            users.setdefault(row, set()).add(name)
    common = [row for row, names in users.items() if len(names) >= _OFTEN]
    reading, virtual = ({*users[_first(common, option)]} for option in ("--column", "--hide"))
    shared: dict[str, list[str]] = {title: [] for title in (_ALL, _SEVERAL, _READING, _VIRTUAL)}
    for row in common:
        title = _ALL if len(users[row]) == len(rows) else _SEVERAL
        if users[row] == reading:
            title = _READING
        elif users[row] == virtual:
            title = _VIRTUAL
        shared[title].append(row)
    return shared


def _is_option(row: str) -> bool:
    return row.startswith("| `-")


def _first(rows: list[str], option: str) -> str:
    return next(row for row in rows if row.startswith(f"| `{option} "))


def _section(
    name: str, command: Any, rows: list[str], shared: dict[str, list[str]]
) -> Iterator[str]:
    text = _WRITTEN.sub(r"--output writes \1.", _EXAMPLE.sub("", command.help).strip())
    yield f"## edge-ident {name}"
    yield ""
    yield _marked(text)
    yield ""
    yield from ("```", *_EXAMPLE.findall(command.help), "```", "")
    several = {row for common in shared.values() for row in common}
    yield from _table([row for row in rows if row not in several])
    also = [_name(row) for row in shared[_SEVERAL] if row in rows]
    also += [
        f"the [{title[0].lower()}{title[1:]}](#{title.lower().replace(' ', '-')})"
        for title in (_READING, _VIRTUAL)
        if shared[title][0] in rows
    ]
    if also:
        yield f"Also {', '.join(also)}."
        yield ""


def _name(row: str) -> str:
    """`--device` of its row."""
    return re.sub(r"[ `].*", "", row.removeprefix("| `")).join("``")


def _table(rows: list[str]) -> Iterator[str]:
    if rows:
        yield "| option | meaning |"
        yield "| --- | --- |"
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
        # the value stands behind the first name only
        named = ", ".join(f"`{name}`" for name in [f"{names[0]} {value}".strip(), *names[1:]])
        default = _default(option)
        meaning = _marked(option.help or "") + (f" Default: {default}." if default else "")
        yield f"| {_cell(named)}{' *' if option.envvar else ''} | {_cell(meaning)} |"


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
